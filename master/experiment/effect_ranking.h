// Which effect of a scenario's catalogue explains what its tuned base leaves over?
//
// Base, and base and one effect together, are fitted to all but a part of the trials and predict
// that part; every part is left out once.  What an effect gains there is not bought by its
// parameters, whatever the scenario and however it is simulated.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "common/base/interval.h"
#include "master/experiment/crossfit.h"
#include "master/experiment/tuning.h"

namespace gapfarm {

struct EffectRankingPlan {
  std::vector<std::string> effects;   // to be tried; empty: the whole catalogue
  std::vector<Gene> ranges;           // of effects' parameters, in place of the catalogue's bounds
  std::vector<std::string> together;  // columns: trials alike in all of them are left out together
  unsigned folds = 5;                 // parts
  double coverage = 0.95;             // of the intervals, over all effects that were tried
  unsigned bootstraps = 4000;
  // Of the base, which is fitted twice, the second time from where the first ended; a fit with more
  // genes gets evaluations in proportion.
  TuningSettings tuning;
  StageHooks hooks;  // the base is a stage, and each effect
};

struct RankedParameter {
  std::size_t row = 0;
  double value = 0;  // fitted to all trials
  Interval folds;    // least and greatest of the fits that leave a part out
};

struct EffectGain {
  std::string effect;
  std::string failure;  // how a simulation failed; empty: none did, and the rest holds
  double gain = -std::numeric_limits<double>::infinity();  // mean over held-out trials
  // Percentile bootstrap over the groups of `together`, each effect's coverage raised by Bonferroni
  // so that all hold at once.
  Interval interval;
  Interval behind_best;  // same, of the best effect's gain less this one's
  bool above_none = false;
  bool alike = false;                       // above none, and the data cannot tell it from the best
  EndErrors errors;                         // of held-out trials
  std::vector<RankedParameter> parameters;  // the base's genes, then the effect's
};

struct EffectRanking {
  bool nats = false;  // gains are log densities (fitness log_score), else the fall of end_error()
  std::size_t groups = 0;
  EndErrors own;                            // at the problem's own values, nothing fitted
  EndErrors base;                           // base alone, of held-out trials
  EndErrors stay;                           // as if nothing moved
  std::vector<RankedParameter> parameters;  // of the base
  std::vector<EffectGain> effects;          // best first
  // The best effect, if the interval of its gain lies above 0; else empty.
  std::string best;
};

// REQUIRES: a problem with base genes and a log.  An effect whose parameter the problem's genes
// already hold belongs to the base and is not tried.
// Errors: an unknown effect, none to try, fewer groups than parts, two parts at least; of tune();
// a simulation of the base that fails.
Result<EffectRanking> rank_effects(const Problem& problem, const EffectRankingPlan& plan,
                                   Farm& farm);

}  // namespace gapfarm
