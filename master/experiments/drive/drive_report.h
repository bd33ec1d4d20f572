// What came of driving, as text, CSV and a page.
#pragma once

#include <optional>
#include <string>
#include <vector>

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

// Over runs, m.
struct RunDistance {
  double median = 0;
  Interval middle_90;  // 5 % and 95 %
};

// Distances of one driver's runs to a real path.
struct RealDistances {
  RunDistance lettier, hausdorff, frechet;
};
RealDistances distances_to(std::span<const DrivenRun> runs, std::span<const PathPoint> real,
                           double spacing_m);

struct DriverReport {
  std::string name;  // "simulation", "constant velocity", ...
  std::vector<DrivenRun> runs;
  std::optional<PathBand> band;  // none for a driver without spread
  EndEllipse end;
  std::optional<RealDistances> real;
};

struct DriveReport {
  double coverage = 0.9;
  std::vector<DriverReport> drivers;
  std::vector<PathPoint> real;                   // on the floor; empty: none
  std::vector<Eigen::Vector2d> targets;          // empty: a list of commands
  std::optional<RealDistances> real_to_targets;  // of the straight lines between the targets
};

std::string drive_text(const DriveReport& report);
std::string band_csv(const DriveReport& report);
std::string ends_csv(const DriveReport& report);
std::string drive_page(const DriveReport& report, const std::string& title);

}  // namespace gapfarm
