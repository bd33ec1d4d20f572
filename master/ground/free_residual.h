// What a smooth correction of a fit's ends would still foresee: what is left when nothing of the
// catalogue explains more.
#pragma once

#include <optional>
#include <string>

#include "master/ground/fit/window_fit.h"

namespace gapfarm {

struct FreeResidual {
  WindowFit held_out;      // corrected, every stretch by what was learned of the others
  std::string depends_on;  // "place, speeds"
  bool of_world = false;   // on place or heading
};

// The ends of windows of poses, which `held_out` predicts without having been fitted to them,
// corrected as those of single drives are (master/diagnose/correction/fit.h), each length by
// itself.  Nothing where nothing helps.
std::optional<FreeResidual> fit_free_residual(const WindowFitter& fitter,
                                              const WindowFit& held_out);

}  // namespace gapfarm
