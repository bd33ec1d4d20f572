#include "common/score/floor_parts.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace gapfarm {
namespace {

// Half of the way over which a wheel passes from one floor to the other (what touches the floor and
// what a tracker errs by): a hard step would have no slope.
constexpr double kBorder_m = 0.02;

// Of a wheel that stands so far beyond the border.
double ratio_beyond(double ratio, double beyond_m) {
  return 1 + (ratio - 1) * std::clamp(0.5 + beyond_m / (2 * kBorder_m), 0.0, 1.0);
}

}  // namespace

const FloorParts::Row* FloorParts::find(std::string_view name) {
  static constexpr Row kRows[] = {
      {"edge_angle", &Parts::edge_rad},    {"edge_offset", &Parts::edge_m},
      {"edge_ratio", &Parts::edge_ratio},  {"patch_x", &Parts::patch_x_m},
      {"patch_y", &Parts::patch_y_m},      {"patch_radius", &Parts::patch_radius_m},
      {"patch_ratio", &Parts::patch_ratio}};
  const auto row = std::ranges::find(kRows, name, &Row::name);
  return row == std::end(kRows) ? nullptr : row;
}

bool FloorParts::has(std::string_view name) { return find(name) != nullptr; }

void FloorParts::put(std::string_view name, double value) {
  const bool known = name.starts_with(kKnown);
  const Row* row = find(known ? name.substr(kKnown.size()) : name);
  Parts& to = known ? known_ : parts_;  // GCC 12 makes a copy of it behind .*
  if (row == nullptr) return;
  to.*row->value = value;
  to.beyond = {std::cos(to.edge_rad), std::sin(to.edge_rad)};
}

bool FloorParts::even() const {
  return parts_.edge_ratio == 1 && parts_.patch_ratio == 1 && known_.edge_ratio == 1 &&
         known_.patch_ratio == 1;
}

double FloorParts::under(const RobotPlace* at, const RobotWheel& wheel) const {
  if (at == nullptr || even()) return 1;
  const Eigen::Vector2d left(-at->ahead[1], at->ahead[0]);
  const Eigen::Vector2d place =
      at->place_m + wheel.x_m.value_or(0) * at->ahead + wheel.y_m.value_or(0) * left - origin_m_;
  double ratio = 1;
  for (const Parts* p : {&parts_, &known_}) {
    if (p->edge_ratio != 1) {
      ratio *= ratio_beyond(p->edge_ratio, p->beyond.dot(place) - p->edge_m);
    }
    if (p->patch_ratio != 1) {
      const Eigen::Vector2d middle(p->patch_x_m, p->patch_y_m);
      ratio *= ratio_beyond(p->patch_ratio, p->patch_radius_m - (place - middle).norm());
    }
  }
  return ratio;
}

double FloorParts::under_wheels(const RobotPlace* at, const GroundRobot& robot, bool driven) const {
  double sum = 0, counted = 0;
  for (const RobotWheel& wheel : robot.wheels) {
    if (driven && !wheel.driven) continue;
    sum += under(at, wheel);
    counted += 1;
  }
  return counted > 0 ? sum / counted : 1;
}

}  // namespace gapfarm
