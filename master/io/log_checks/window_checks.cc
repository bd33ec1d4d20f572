#include "master/io/log_checks/window_checks.h"

#include <algorithm>
#include <cmath>

#include "common/math/statistics.h"
#include "master/io/log_checks/log_checks.h"
#include "master/io/log_checks/pose_faults.h"

namespace gapfarm {
namespace {

constexpr double kShrinks = 1.4;   // as kFaultShrinks of a ground robot's diagnosis
constexpr double kNearest = 1e-3;  // of the median motion: nobody predicts closer

// Of the program's way, what a log in another unit must leave when it is put right: between two
// units lies a factor of ten.
constexpr double kSameWay = 0.3;

// Medians over windows: how far they end from where they are predicted to, and from their start.
struct Misfit {
  double position_m = 0, heading_rad = 0, way_m = 0;
};

Misfit misfit(const TrialLog& log, std::span<const Pose> ends, const PoseFault* fault) {
  std::vector<double> position, heading, way;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const Trial& t = log.trials[i];
    const Pose wanted = between(t.X_WS, ends[i]);
    const Pose logged = fault == nullptr
                            ? between(t.X_WS, t.X_WE)
                            : between(fault->put_right(t.X_WS), fault->put_right(t.X_WE));
    position.push_back(std::hypot(logged.x - wanted.x, logged.y - wanted.y));
    heading.push_back(std::abs(wrap_angle(logged.theta - wanted.theta)));
    way.push_back(std::hypot(logged.x, logged.y));
  }
  return {median(position), median(heading), median(way)};
}

}  // namespace

void check_windows(const TrialLog& log, std::span<const Pose> ends,
                   std::vector<SanityFinding>* findings) {
  if (ends.empty()) return;
  std::vector<double> ways, turns;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const Pose wanted = between(log.trials[i].X_WS, ends[i]);
    ways.push_back(std::hypot(wanted.x, wanted.y));
    turns.push_back(std::abs(wanted.theta));
  }
  const double least_m = std::max(1e-6, kNearest * median(ways));
  const double least_rad = std::max(1e-6, kNearest * median(turns));
  const auto size = [&](const Misfit& m) {
    return std::cbrt(std::pow(std::max(m.position_m, least_m), 2) *
                     std::max(m.heading_rad, least_rad));
  };
  const Misfit before = misfit(log, ends, nullptr);
  const PoseFault* best = nullptr;
  Misfit after = before;
  for (const PoseFault& fault : kPoseFaults) {
    const Misfit put = misfit(log, ends, &fault);
    if (fault.metres != 1 && put.way_m < kSameWay * median(ways)) continue;
    if (size(put) * (best == nullptr ? kShrinks : 1) >= size(after)) continue;
    best = &fault;
    after = put;
  }
  if (best == nullptr) return;
  findings->push_back({best->name,
                       "Half of the windows end farther than " + few_digits(before.position_m) +
                           " m and " + few_digits(before.heading_rad) +
                           " rad from where the program has them; put right, " +
                           few_digits(after.position_m) + " m and " +
                           few_digits(after.heading_rad) + " rad. " + best->text,
                       best->remedy});
}

}  // namespace gapfarm
