// Where a search for a disc goes next.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "master/diagnose/places/patch.h"

namespace gapfarm {

// A disc that was simulated, and what it does: whitened shifts of the ends.
struct MarkedDisc {
  Patch patch;
  Eigen::VectorXd mark;
};

// How far moves go: standard deviations of place and radius (m), and of the ratio's logarithm.
struct PatchStep {
  double length_m = 0, log_ratio = 0;
};

// Where discs near `from` lead: as far as their marks are linear in place, radius and the ratio's
// logarithm there, the disc that leaves least of `left`; none where too few are near.  A regression
// over discs a step apart sees the slope of a mark that is a stair of single drives from near by.
std::optional<Patch> linear_best(const MarkedDisc& from, const std::vector<MarkedDisc>& near,
                                 const Eigen::VectorXd& left, const PatchStep& step);

}  // namespace gapfarm
