// Discs moved to where their simulation explains most.
#pragma once

#include <vector>

#include "common/random/stream.h"
#include "master/diagnose/fit/selection.h"
#include "master/diagnose/places/patch_moves.h"

namespace gapfarm {

// One that can be simulated and distinguished from none, for a robot `scale` times an SRV-1.
Patch bounded_patch(Patch patch, double scale);

// With what they gain, in their order.
Result<std::vector<EffectCandidate>> simulated_discs(Predictor& predictor, const Study& study,
                                                     const Regression& explained,
                                                     const std::vector<Patch>& patches,
                                                     const PatchTrials& trials = touched_trials);

// What a rim does to each drive that crosses it makes many hills.  So the best few discs are moved
// at random, in ever smaller steps, and to where the marks of all that lie near lead; half of the
// drives that cross a rim, the first heat, choose who is simulated in the others, too.
class PatchClimb {
 public:
  // REQUIRES: all outlive it.
  PatchClimb(Predictor& predictor, const Study& study, const Regression& explained);

  struct Climbed {
    std::vector<EffectCandidate> discs;  // the best few, in all trials
    bool left = false;                   // behind what explains more, and climbing no longer
  };
  // `discs`: the best first, at least one.  `behind`: something else explains more, so the climb
  // goes on only while it gains.
  Result<Climbed> run(std::vector<EffectCandidate> discs, bool behind);

 private:
  PatchTrials heat(bool first) const;
  std::vector<Patch> moved(const std::vector<EffectCandidate>& discs, const PatchStep& step);
  Eigen::VectorXd in_first_heat(Eigen::VectorXd mark) const;
  void remember(const std::vector<EffectCandidate>& discs);
  Result<std::vector<EffectCandidate>> race(const std::vector<Patch>& patches);
  Result<std::vector<EffectCandidate>> follow(const EffectCandidate& leader, const PatchStep& step);

  Predictor* predictor_;
  const Study* study_;
  const Regression* explained_;
  Stream stream_;
  std::vector<bool> first_heat_;    // of every trial
  std::vector<MarkedDisc> marked_;  // all that were simulated, in the first heat
};

}  // namespace gapfarm
