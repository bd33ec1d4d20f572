// An effect that makes some trials stray rather than moves their mean, as a row: how it is
// looked for.  It is looked for before the effects on the mean, which do without the
// trials that it strikes, and named when trials that no fit saw are clearly foretold better with
// it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "master/diagnose/diagnosis.h"
#include "master/diagnose/study.h"

namespace gapfarm {

struct SpreadFit {
  double gain = 0;                  // nats over all trials
  std::vector<Estimate> estimates;  // of the effect's parameters, the first the one that is told
};

struct SpreadRow {
  const char* effect;
  double least_gain;  // nats; below it the search finds nothing
  SpreadFit (*fit)(const Study& study, const std::vector<Eigen::Vector3d>& residuals,
                   double outlier_share);
  // Log scores (nats) of every trial that misses its prediction so far, the effect foreseen.
  std::vector<double> (*scores)(const Study& study, const std::vector<Eigen::Vector3d>& residuals,
                                const SpreadFit& fit, double outlier_share);
  bool (*strays)(const ResidualTrial& trial);  // whether it may be one that the effect strikes
  const char* found;                           // how screening says that it was seen, or not
  const char* missing;
};

struct FoundSpread {
  const SpreadRow* row;
  SpreadFit fit;
  std::vector<double> scores;  // held out, one a trial, of the last fit and the effect
};

}  // namespace gapfarm
