// What each effect of the catalogue would do to the residuals, to first order.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/parameters/table.h"
#include "master/diagnose/places/patch.h"
#include "master/diagnose/study.h"

namespace gapfarm {

// A way in which an effect may show.  Effects with a place or a direction that no slope leads to
// have several, one a place.
struct Signature {
  std::string effect;
  Eigen::MatrixXd columns;              // whitened; the first ones belong to `parameters`
  std::vector<std::string> parameters;  // table keys whose values the fitted coefficients are, or
                                        // empty: see EffectDiagnosis::start
  std::map<std::string, double> fixed;  // other parameters of the effect at this signature
  double penalty = 0.5;                 // nats that its best fit gains by luck
  bool whole = false;  // the column is all that the effect does at `fixed`, and no slope
};

// All of the catalogue but `left_out` and what cannot be simulated: by finite differences of
// predictions, one batch of farm work.
Result<std::vector<Signature>> signatures(Predictor& predictor, const Study& study,
                                          const std::vector<std::string>& excluded);

// Discs of floor, simulated trial by trial.  One that cannot be simulated explains nothing.
Result<std::vector<Signature>> patch_signatures(Predictor& predictor, const Study& study,
                                                const std::vector<Patch>& places);

// Middle of the start places along each axis.
Eigen::Vector2d middle_of(const Study& study);

inline constexpr char kPatchEffect[] = "friction_patch";

// The disc that a signature of the effect is of, and its parameters.
Patch patch_of(const Signature& signature);
std::map<std::string, double> patch_values(const Patch& patch);

// EffectDiagnosis::search_error of a patch.
double patch_search_error(const Parameter& p, double value, double gain);

}  // namespace gapfarm
