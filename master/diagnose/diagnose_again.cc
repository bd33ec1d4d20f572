// What the first search of the catalogue leaves to be seen better.

#include <algorithm>

#include "master/diagnose/diagnose_steps.h"
#include "master/diagnose/noise.h"

namespace gapfarm {

// Strong effects drew the base to themselves and passed for noise where they are not smooth: the
// catalogue is gone through once more from the base that fits beside them, with the noise that they
// leave.
Status DiagnosisRun::search_again() {
  const JointFit found = std::move(*estimates_);
  Regression left(nuisances_, study_.whiten(found.residuals));
  left.add(found.jacobian);
  study_.trust.clear();
  estimate_noise(left, blocks_, &study_);
  tuned_alone_ = study_.base;
  for (auto& [row, value] : study_.base) value = found.at.at(row);
  if (Status s = subject_.tune(predictor_, /*keep=*/true, &study_); !s) return s;
  if (Status s = rebuild_nuisances(); !s) return s;
  return search_catalogue();
}

// What repeats of a trial have in common was kept from the effects as another physics' misfit, but
// a simulation that misses it is not whole.
void DiagnosisRun::compare_with_repeats() {
  const Eigen::Index own = nuisances_.cols() - study_.misfit_columns;
  Regression without(nuisances_.leftCols(own), estimates_ ? study_.whiten(estimates_->residuals)
                                                          : study_.whitened_residuals());
  for (const ChosenEffect& c : chosen_) without.add(c.candidate.signature.columns);
  const std::vector<Leftover> common = leftovers(
      without, {{"what its repeats have in common", nuisances_.rightCols(study_.misfit_columns)}});
  leftovers_.insert(leftovers_.end(), common.begin(), common.end());
  std::stable_sort(leftovers_.begin(), leftovers_.end(),
                   [](const Leftover& a, const Leftover& b) { return a.log10_p < b.log10_p; });
}

}  // namespace gapfarm
