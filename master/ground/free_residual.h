// What a smooth correction of a fit's ends would still foresee: what is left when nothing of the
// catalogue explains more.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "master/ground/fit/window_fit.h"

namespace gapfarm {

struct FreeResidual {
  WindowFit held_out;      // corrected, every stretch by what was learned of the others
  std::string depends_on;  // "place, speeds"
  bool of_world = false;   // on place or heading
  std::string covariate;   // what it varies with above all: "left side's speed"
  bool sure = false;       // that it closes more than is tolerated; who judges it sets this
};

// Where a window that misses by this (m, m, rad, in the expected end's axes) is expected to end.
Pose expected_end(const Trial& window, const Eigen::Vector3d& residual);

// How fast a window's end is reached where it is expected, on the arc to it.
struct WindowSpeeds {
  double ahead_m_s = 0, turn_rad_s = 0;
  double left_m_s = 0, right_m_s = 0;  // of the sides, as if all drives had two
};
// Of every window.
std::vector<WindowSpeeds> window_speeds(const WindowFitter& fitter, const WindowFit& fit);

// The ends of windows of poses, which `held_out` predicts without having been fitted to them,
// corrected as those of single drives are (master/diagnose/correction/fit.h), each length by
// itself.  Nothing where nothing helps.
std::optional<FreeResidual> fit_free_residual(const WindowFitter& fitter,
                                              const WindowFit& held_out);

}  // namespace gapfarm
