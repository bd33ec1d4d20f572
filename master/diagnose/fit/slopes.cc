#include "master/diagnose/fit/slopes.h"

#include <utility>

#include "master/diagnose/subject.h"

namespace gapfarm {
namespace {

// In the order in which they are tried, in steps.
constexpr double kTries[] = {1, -1, 0.1, -0.1};

Slope slope_between(const std::vector<Pose>& from, const std::vector<Pose>& to, double step) {
  Slope slope;
  for (std::size_t i = 0; i < from.size(); ++i) {
    slope.push_back(local_difference(from[i], to[i]) / step);
  }
  return slope;
}

}  // namespace

Result<SlopePoint> slope_point(Predictor& predictor, const Study& study, const Overrides& at,
                               const std::vector<Pose>& ends) {
  const double rate = study.subject->slope_rate_hz;
  const std::uint32_t headings = study.subject->slope_headings;
  if (rate == 0) return SlopePoint{at, ends};
  const std::size_t row = study.table->row("step_rate");
  const auto own = at.find(row);
  if ((own != at.end() ? own->second : predictor.problem().values[row]) <= rate) {
    return SlopePoint{at, ends};
  }
  SlopePoint coarse{at, {}, headings};
  coarse.at[row] = rate;
  auto there = predictor.attempt({{coarse.at, {}, headings}});
  if (!there) return there.error();
  if (!there->front()) return SlopePoint{at, ends};
  coarse.ends = std::move(*there->front());
  return coarse;
}

Result<std::vector<std::optional<Slope>>> slopes_at(Predictor& predictor, const SlopePoint& from,
                                                    const std::vector<SlopeRequest>& requests) {
  const ParameterTable& table = predictor.problem().table();
  std::vector<std::optional<Slope>> slopes(requests.size());
  for (double share : kTries) {
    std::vector<PredictionRequest> tries;
    std::vector<std::size_t> of;
    for (std::size_t k = 0; k < requests.size(); ++k) {
      if (slopes[k]) continue;
      const Parameter& row = table[requests[k].row];
      const double moved = from.at.at(requests[k].row) + share * requests[k].step;
      if (moved < row.lower || moved > row.upper) continue;
      tries.push_back({from.at, {}, from.headings});
      tries.back().at[requests[k].row] = moved;
      of.push_back(k);
    }
    if (tries.empty()) continue;
    const auto moved = predictor.attempt(tries);
    if (!moved) return moved.error();
    for (std::size_t j = 0; j < of.size(); ++j) {
      if (!(*moved)[j]) continue;
      slopes[of[j]] = slope_between(from.ends, *(*moved)[j], share * requests[of[j]].step);
    }
  }
  return slopes;
}

std::optional<Slope> central_slope(const std::vector<Pose>& middle,
                                   const std::optional<std::vector<Pose>>& up,
                                   const std::optional<std::vector<Pose>>& down, double step) {
  if (up && down) return slope_between(*down, *up, 2 * step);
  if (up) return slope_between(middle, *up, step);
  if (down) return slope_between(middle, *down, -step);
  return std::nullopt;
}

}  // namespace gapfarm
