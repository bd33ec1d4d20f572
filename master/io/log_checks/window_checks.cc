#include "master/io/log_checks/window_checks.h"

#include <algorithm>
#include <cmath>

#include "common/math/statistics.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {
namespace {

constexpr double kShrinks = 1.4;   // as kFaultShrinks of a ground robot's diagnosis
constexpr double kNearest = 1e-3;  // of the median motion: nobody predicts closer

// Of the program's way, what a log in another unit must leave when it is put right: between two
// units lies a factor of ten.
constexpr double kSameWay = 0.3;

struct Fault {
  const char* name;
  const char* text;
  const char* remedy;
  double metres;       // a logged length
  double x_x, x_y;     // x put right, of x and y as logged
  double y_x, y_y;     // and y
  double sense, turn;  // of headings; rad
};

constexpr Fault kFaults[] = {
    {"unit_error", "These look like centimetres.", "Multiply x and y by 0.01.", 0.01, 1, 0, 0, 1, 1,
     0},
    {"unit_error", "These look like millimetres.", "Multiply x and y by 0.001.", 0.001, 1, 0, 0, 1,
     1, 0},
    {"sides_swapped", "The robot turns the other way than the program does.",
     "Exchange left and right in the commands, or mirror the poses.", 1, 1, 0, 0, -1, -1, 0},
    {"heading_flipped", "Headings grow the other way round than turns do.", "Negate theta.", 1, 1,
     0, 0, 1, -1, 0},
    {"axis_mirrored", "One axis points the other way than headings say.", "Negate x or y.", 1, 1, 0,
     0, -1, 1, 0},
    {"axis_mirrored", "One axis points the other way than headings say.", "Negate x or y.", 1, -1,
     0, 0, 1, 1, 0},
    {"axes_swapped", "x and y are exchanged.", "Exchange x and y.", 1, 0, 1, 1, 0, 1, 0},
    {"heading_turned", "Headings are half a turn off.", "Add pi to theta, or set marker.yaw.", 1, 1,
     0, 0, 1, 1, M_PI},
    {"heading_turned", "Headings are a quarter turn off.", "Add pi/2 to theta, or set marker.yaw.",
     1, 1, 0, 0, 1, 1, M_PI / 2},
    {"heading_turned", "Headings are a quarter turn off.",
     "Subtract pi/2 from theta, or set marker.yaw.", 1, 1, 0, 0, 1, 1, -M_PI / 2}};

Pose put_right(const Fault& f, const Pose& X) {
  return {f.metres * (f.x_x * X.x + f.x_y * X.y), f.metres * (f.y_x * X.x + f.y_y * X.y),
          f.sense * X.theta + f.turn};
}

// Medians over windows: how far they end from where they are predicted to, and from their start.
struct Misfit {
  double position_m = 0, heading_rad = 0, way_m = 0;
};

Misfit misfit(const TrialLog& log, std::span<const Pose> ends, const Fault* fault) {
  std::vector<double> position, heading, way;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const Trial& t = log.trials[i];
    const Pose wanted = between(t.X_WS, ends[i]);
    const Pose logged = fault == nullptr
                            ? between(t.X_WS, t.X_WE)
                            : between(put_right(*fault, t.X_WS), put_right(*fault, t.X_WE));
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
  const Fault* best = nullptr;
  Misfit after = before;
  for (const Fault& fault : kFaults) {
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
