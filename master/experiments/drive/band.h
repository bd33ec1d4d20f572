// Bands that hold whole paths, ellipses of final poses, and distances to a real path.
#pragma once

#include "common/base/interval.h"
#include "common/math/path_distance.h"
#include "master/experiments/drive/drive.h"

namespace gapfarm {

// A run at equal shares of each leg's time, so that runs correspond point by point.
struct GridPoint {
  std::size_t leg = 0;
  double share = 0;  // of the leg's time to rest
  Pose pose;
};
// REQUIRES: every leg has a path.
std::vector<GridPoint> on_grid(const DrivenRun& run, unsigned points_a_leg);

struct BandPoint {
  std::size_t leg = 0;
  double share = 0;
  Pose middle;                   // medians
  Eigen::Vector3d below, above;  // from the middle to the band's ends: m, m, rad
};

// A band of x, y and heading that holds a whole path with probability `coverage`: at every point at
// once, not point by point.  Its shape, from each point's 5 % and 95 % quantiles, comes from half
// of the runs; one factor, from the other half's greatest excursions, widens it until it holds
// enough of them (split conformal; Lei et al., JASA 2018), so that it is not fitted to what it is
// judged by.
class PathBand {
 public:
  // REQUIRES: at least 4 runs with the same legs, coverage in (0, 1).
  static PathBand fit(std::span<const DrivenRun> runs, double coverage, unsigned points_a_leg = 20);

  const std::vector<BandPoint>& points() const { return points_; }
  // Greatest excursion of a run in units of the band: at most 1 when all of it lies inside.
  double excursion(const DrivenRun& run) const;

 private:
  std::vector<BandPoint> points_;
  unsigned points_a_leg_ = 0;
};

// Where runs end: mean, and the ellipse of x and y that holds `coverage` of a normal distribution.
struct EndEllipse {
  Pose mean;
  Eigen::Matrix2d covariance;  // m^2, world axes
  double heading_deviation_rad = 0;
  double major_m = 0, minor_m = 0;  // half axes
  double direction_rad = 0;         // of the major one
};
// REQUIRES: at least two runs.
EndEllipse end_ellipse(std::span<const DrivenRun> runs, double coverage);

// The run's way on the floor with points at least `spacing_m` apart, and its end.
std::vector<PathPoint> floor_path(const DrivenRun& run, double spacing_m);
std::vector<PathPoint> floor_path(std::span<const PathSample> path, double spacing_m);

}  // namespace gapfarm
