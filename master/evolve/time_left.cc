#include "master/evolve/time_left.h"

#include <algorithm>

namespace gapfarm {
namespace {

// Of so many when `done` of them took `wall_s`.
std::optional<double> at_this_pace(double left, double done, double wall_s) {
  if (done <= 0) return std::nullopt;
  return std::max(0.0, left) * wall_s / done;
}

}  // namespace

std::optional<double> time_left_s(const EvolutionSettings& settings, const Pace& pace) {
  const auto generations =
      static_cast<double>(settings.generations) - static_cast<double>(pace.generation) - pace.share;
  std::optional<double> left = at_this_pace(
      generations, static_cast<double>(pace.generations_here) + pace.share, pace.wall_here_s);
  const auto sooner = [&](std::optional<double> other) {
    if (other) left = std::min(left.value_or(*other), *other);
  };
  if (settings.evaluations) {
    sooner(at_this_pace(
        static_cast<double>(*settings.evaluations) - static_cast<double>(pace.evaluations),
        static_cast<double>(pace.evaluations_here), pace.wall_here_s));
  }
  if (settings.time_s) sooner(std::max(0.0, *settings.time_s - pace.wall_s));
  return left;
}

}  // namespace gapfarm
