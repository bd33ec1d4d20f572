#include "master/io/logs/row_values.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <tuple>
#include <utility>

#include "common/pose/pose.h"

namespace gapfarm {
namespace {

// A quaternion this far from unit length was not measured (Motive and TUM write zeros).
constexpr double kUnitLength = 0.1;

}  // namespace

bool to_pose(const TableMap& map, std::vector<double>& values) {
  const auto value = [&](std::string_view role) {
    for (std::size_t i = 0; i < map.columns.size(); ++i) {
      if (map.columns[i].role == role) return values[i];
    }
    return 0.0;
  };
  const bool y_up = map.up == "y";
  double theta = value("theta");
  if (map.find("qw") != nullptr) {
    double x = value("qx"), y = value("qy"), z = value("qz"), w = value("qw");
    const double length = std::sqrt(x * x + y * y + z * z + w * w);
    if (std::abs(length - 1) > kUnitLength) return false;
    // With y up the floor's y is -z: turned about x, which keeps x.
    if (y_up) std::tie(y, z) = std::pair(-z, y);
    theta = std::atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z);
  }
  values = {value("t"), value("x"), y_up ? -value("z") : value("y"), wrap_angle(theta)};
  return true;
}

bool at_its_time(const TableMap& map, bool poses, std::vector<double>& before,
                 std::vector<double>& values) {
  const auto any = [&](bool MappedColumn::*kind) {
    return std::any_of(map.columns.begin(), map.columns.end(),
                       [&](const MappedColumn& c) { return c.*kind; });
  };
  const bool rates = any(&MappedColumn::rate), increments = any(&MappedColumn::increment);
  const double last = before.empty() ? 0 : before[0];
  if (map.intervals) values[0] += last;  // the end of its stretch
  if (!map.intervals && !rates && !increments) return true;
  const bool begins = before.empty() && !map.intervals;
  const double dt = values[0] - last;
  if (!begins && !(dt >= 0 && (dt > 0 || poses))) return false;
  std::vector<double> row = rates ? before : values;
  for (std::size_t c = 0; c < row.size() && !begins; ++c) {
    if (map.columns[c].rate) row[c] = (values[c] - before[c]) / dt;
    if (map.columns[c].increment) row[c] = values[c] / dt;
  }
  if (!poses && !row.empty()) row[0] = last;
  before = values;
  values = std::move(row);
  return !begins;
}

}  // namespace gapfarm
