// Parts of a floor on which wheels travel less far than elsewhere, or farther.
#pragma once

#include <Eigen/Core>
#include <string_view>

#include "common/robot/robot.h"

namespace gapfarm {

// Where a robot is and which way it heads.
struct RobotPlace {
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d ahead = Eigen::Vector2d::UnitX();  // of length 1
};

// Ratios are of how far a wheel travels there.
class FloorParts {
 public:
  // Before a value's name: of a floor that is known to be so, whatever else there is.
  static constexpr std::string_view kKnown = "known_";

  // Places are counted from `origin_m` of the world.
  explicit FloorParts(const Eigen::Vector2d& origin_m) : origin_m_(origin_m) {}

  // Whether a value of the kinematic model (common/score/kinematic.h) is one of these.
  static bool has(std::string_view name);
  // Takes it; others are none of its business.
  void put(std::string_view name, double value);

  bool even() const;
  // Under a wheel of a robot that stands there; 1 where nobody knows where that is.
  double under(const RobotPlace* at, const RobotWheel& wheel) const;
  // The mean of all wheels, or of the driven ones.
  double under_wheels(const RobotPlace* at, const GroundRobot& robot, bool driven) const;

 private:
  struct Parts {
    double edge_rad = 0, edge_m = 0, edge_ratio = 1;
    Eigen::Vector2d beyond = Eigen::Vector2d::UnitX();  // of the edge, by its angle
    double patch_x_m = 0, patch_y_m = 0, patch_radius_m = 0, patch_ratio = 1;
  };
  struct Row {
    std::string_view name;
    double Parts::*value;
  };
  static const Row* find(std::string_view name);

  Eigen::Vector2d origin_m_;
  Parts parts_, known_;
};

}  // namespace gapfarm
