// What ground_hypotheses() and change_hypotheses() are put together from.
#pragma once

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "master/ground/hypotheses.h"
#include "master/ground/tolerances.h"

namespace gapfarm {

// Two floors in one log: beyond an edge, or within a patch, a wheel travels less far, or farther
// (common/score/kinematic_body.h).
GroundHypothesis floor_edge();
GroundHypothesis friction_patch();

// A floor that is not level: the robot goes farther than its wheels downhill, and less far uphill;
// a throttle is driven by its weight (common/score/kinematic.h).
GroundHypothesis floor_tilt();

class Catalogue {
 public:
  Catalogue(const GroundRobot& robot, std::vector<KinematicRow> rows)
      : robot_(robot), rows_(std::move(rows)) {}

  void wrong_commands();
  void wrong_poses();
  void wrong_sides_of_poses();
  void wrong_increments();
  void sizes();
  void all_sizes();
  void steering();
  void motors();
  void marker();
  void tracker();
  void floors();
  void world();
  GroundHypothesis& fault(const std::string& name, std::vector<std::string> aliases,
                          const std::string& thing, const std::string& remedy,
                          std::function<void(RunLog*)> put_right) {
    all.push_back({name, std::move(aliases), thing, {}, std::move(put_right), 1, remedy});
    return all.back();
  }

  std::vector<GroundHypothesis> all;

 private:
  KinematicRow row(const std::string& name) const {
    return *std::ranges::find(rows_, name, &KinematicRow::name);
  }
  GroundHypothesis& value(const std::string& name, std::vector<std::string> aliases,
                          const std::string& thing, std::vector<KinematicRow> freed) {
    const double more_values = static_cast<double>(freed.size()) - 1;
    all.push_back({name, std::move(aliases), thing, std::move(freed)});
    all.back().price = kPriceOfAValue * more_values;
    return all.back();
  }

  const GroundRobot& robot_;
  std::vector<KinematicRow> rows_;
};

}  // namespace gapfarm
