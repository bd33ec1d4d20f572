// Parts of a floor on which wheels travel less far than elsewhere, or farther.
#pragma once

#include <Eigen/Core>
#include <string_view>

namespace gapfarm {

// Places are of the frame that its user says; ratios are of how far a wheel travels there.
class FloorParts {
 public:
  // Takes a value of the kinematic model by its name (common/score/kinematic.h); others are none of
  // its business.
  void put(std::string_view name, double value);

  bool even() const { return edge_ratio_ == 1 && patch_ratio_ == 1; }
  double ratio_at(const Eigen::Vector2d& place) const;

 private:
  double edge_rad_ = 0, edge_m_ = 0, edge_ratio_ = 1;
  Eigen::Vector2d patch_m_ = Eigen::Vector2d::Zero();
  double patch_radius_m_ = 0, patch_ratio_ = 1;
};

}  // namespace gapfarm
