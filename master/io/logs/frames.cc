#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "common/base/ranges.h"
#include "master/io/logs/topics.h"

namespace gapfarm {
namespace {

constexpr std::string_view kTransform = "transform.";
constexpr std::array kParts = {"translation.x", "translation.y", "translation.z", "rotation.x",
                               "rotation.y",    "rotation.z",    "rotation.w"};

bool has(std::string_view text, std::string_view word) { return text.find(word) != text.npos; }

bool is_odometry_frame(std::string_view frame) { return has(frame, "odom"); }

// REP 105's, and what simulators and trackers call theirs.
bool is_world_frame(std::string_view frame) {
  return frame == "map" || frame == "earth" || frame == "world" || has(frame, "ground_truth");
}

using Columns = std::array<std::size_t, kParts.size()>;

std::optional<Columns> columns_of(const LogTable& table) {
  Columns columns{};
  for (std::size_t i = 0; i < kParts.size(); ++i) {
    const auto found = table.find(std::string(kTransform) + kParts[i]);
    if (!found) return {};
    columns[i] = *found;
  }
  return columns;
}

bool changes(const LogTable& table, const Columns& columns) {
  return std::ranges::any_of(columns, [&](std::size_t c) {
    return std::ranges::any_of(indices(table.rows()),
                               [&](std::size_t r) { return table.at(r, c) != table.at(0, c); });
  });
}

Eigen::Isometry3d transform(const LogTable& table, std::size_t row, const Columns& c) {
  const auto v = [&](std::size_t i) { return table.at(row, c[i]); };
  return Eigen::Translation3d(v(0), v(1), v(2)) *
         Eigen::Quaterniond(v(6), v(3), v(4), v(5)).normalized();
}

std::optional<LogTable> localised(const LogTable& corrections, const LogTable& odometry) {
  const auto of_map = columns_of(corrections), of_odometry = columns_of(odometry);
  if (!of_map || !of_odometry || !changes(corrections, *of_map)) return {};
  LogTable out = odometry;
  const std::string topic = odometry.topic.substr(0, odometry.topic.rfind(':'));
  out.frame = corrections.frame;
  out.topic = topic + ":" + out.frame + ":" + out.child;
  out.source.replace(out.source.size() - odometry.topic.size(), odometry.topic.size(), out.topic);
  out.values.clear();
  std::size_t last = 0;
  for (std::size_t r = 0; r < odometry.rows(); ++r) {
    while (last < corrections.rows() && corrections.at(last, 0) <= odometry.at(r, 0)) ++last;
    if (last == 0) continue;
    const Eigen::Isometry3d X =
        transform(corrections, last - 1, *of_map) * transform(odometry, r, *of_odometry);
    const Eigen::Quaterniond q(X.linear());
    const double parts[] = {
        X.translation().x(), X.translation().y(), X.translation().z(), q.x(), q.y(), q.z(), q.w()};
    for (std::size_t c = 0; c < odometry.columns.size(); ++c) {
      out.values.push_back(odometry.at(r, c));
    }
    double* row = &out.values[out.values.size() - odometry.columns.size()];
    for (std::size_t i = 0; i < kParts.size(); ++i) row[(*of_odometry)[i]] = parts[i];
  }
  return out;
}

}  // namespace

bool is_odometry(const LogTable& table) {
  const bool type = has(table.type, "Odometry");
  if (!type && table.child.empty()) return false;
  if (is_world_frame(table.frame) || has(table.topic, "ground_truth")) return false;
  return type || is_odometry_frame(table.frame);
}

bool shows_robot(const Recording& recording, const LogTable& table) {
  if (table.child.empty()) return true;
  if (is_odometry_frame(table.child)) return false;
  return is_world_frame(table.frame) || is_odometry_frame(table.frame) ||
         std::ranges::none_of(recording.tables,
                              [&](const LogTable& other) { return other.child == table.frame; });
}

void add_localised(Recording& recording) {
  std::vector<LogTable> added;
  for (const LogTable& odometry : recording.tables) {
    if (odometry.child.empty() || !is_odometry_frame(odometry.frame)) continue;
    for (const LogTable& corrections : recording.tables) {
      if (corrections.child != odometry.frame || is_odometry_frame(corrections.frame)) continue;
      if (auto table = localised(corrections, odometry)) added.push_back(*std::move(table));
    }
  }
  std::ranges::move(added, std::back_inserter(recording.tables));
}

}  // namespace gapfarm
