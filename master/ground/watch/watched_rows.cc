// What is watched of robots of a kind: names of a diagnosis, values of the kinematics.
#include <algorithm>
#include <utility>

#include "common/base/ranges.h"
#include "master/ground/fit/window_fit.h"
#include "master/ground/watch/changes.h"

namespace gapfarm {
namespace {

// That offsets of commands differ by from run to run: half a percent of a wheel by a thousandth;
// fast turns slip as they like.
constexpr double kOffsetShare = 0.001, kTurnSpeedShare = 0.03;

}  // namespace

WatchedRows watched_rows(const GroundRobot& robot) {
  WatchedRows watched;
  watched.rows = change_rows(robot);
  const std::vector<GroundHypothesis> changes = change_hypotheses(robot, watched.rows);
  for (KinematicRow& row : command_offsets(robot)) {
    row.tolerance = row.name.ends_with("_speed") ? kTurnSpeedShare : kOffsetShare;
    watched.rows.push_back(std::move(row));
  }
  const auto p = static_cast<Eigen::Index>(watched.rows.size());
  watched.owned = Eigen::VectorXd::Zero(p);
  const std::vector<KinematicRow> kept = kinematic_rows(robot);
  std::vector<GroundHypothesis> catalogue = ground_hypotheses(robot);
  catalogue.insert(catalogue.end(), changes.begin(), changes.end());
  const auto add = [&](const GroundHypothesis& h, const KinematicRow& row,
                       Eigen::VectorXd direction) {
    watched.values.push_back({h.name, row.name, h.thing, row.unit, row.nominal,
                              plausible_error(row), least_value(row), direction});
  };
  for (Eigen::Index k = 0; k < p; ++k) {
    const KinematicRow& row = watched.rows[static_cast<std::size_t>(k)];
    watched.owned[k] = row.tolerance;
    for (const KinematicRow& other : kept) {
      if (other.name == row.name) watched.owned[k] = other.tolerance;
    }
    // Wheels that stand farther out turn the robot less far.
    const bool inverse = row.name == "turn";
    const std::string name = inverse ? "arm" : row.name;
    const auto h = std::ranges::find_if(catalogue, [&](const GroundHypothesis& of) {
      return contains(of.freed, name, &KinematicRow::name);
    });
    if (h == catalogue.end()) continue;
    add(*h, inverse ? h->freed.front() : row, (inverse ? -1 : 1) * Eigen::VectorXd::Unit(p, k));
  }
  // All wheels alike.
  Eigen::VectorXd travel = Eigen::VectorXd::Zero(p);
  for (Eigen::Index k = 0; k < p; ++k) {
    const std::string& name = watched.rows[static_cast<std::size_t>(k)].name;
    for (const char* wheel : {"left", "right", "ahead", "aside", "turn"}) {
      if (name == wheel) travel[k] = 1;
    }
  }
  for (const GroundHypothesis& h : catalogue) {
    if (h.freed.size() != 1 || h.freed[0].name != "travel") continue;
    add(h, h.freed[0], travel);
    break;
  }
  return watched;
}

}  // namespace gapfarm
