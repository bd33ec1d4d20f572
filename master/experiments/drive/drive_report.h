// What came of driving, as text, CSV and a page.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "master/experiments/drive/band.h"

namespace gapfarm {

// Distances of one driver's runs to a real path: medians over runs, m, with 5 % and 95 %.
struct RealDistances {
  double lettier = 0, hausdorff = 0, frechet = 0;
  Interval lettier_90, hausdorff_90, frechet_90;
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
