// Fitting outlier drives (common/residual/outliers.h) to what a model leaves of a log.
//
// The noise that the other drives have is fitted with them: beside a share of outliers it looks
// wider than it is.
#pragma once

#include <optional>
#include <vector>

#include "common/residual/outliers.h"
#include "master/diagnose/correction/fit.h"
#include "master/diagnose/study.h"

namespace gapfarm {

struct OutlierData {
  const Study& study;               // its trials vary by its subject's covariance
  std::vector<LoggedMotion> facts;  // one a trial
  std::vector<Pose> ends;           // predicted, world frame
  double outlier_share = 0.02;

  std::size_t size() const { return facts.size(); }
};

struct OutlierFit {
  OutlierDrives outliers;
  NoiseEstimate noise;
  double nats = 0;  // over the trials that it learned from
};

// Log score (nats) of a trial's residual (measured end minus predicted, in the latter's axes).
double outlier_score(const OutlierData& data, std::size_t trial, const Eigen::Vector3d& residual,
                     const OutlierFit& fit);

// The chance that it is an outlier, by its residual.
double outlier_chance(const OutlierData& data, std::size_t trial, const Eigen::Vector3d& residual,
                      const OutlierFit& fit);

// The kind that explains most of the residuals of the trials with learn[i]; none that explains
// `least_gain` nats over the best noise alone: nothing.
std::optional<OutlierFit> fit_outliers(const OutlierData& data, const Residuals& residuals,
                                       const std::vector<bool>& learn, const NoiseEstimate& start,
                                       double least_gain);

// The same kind, from where it stands for other trials.
OutlierFit refit_outliers(const OutlierData& data, const Residuals& residuals,
                          const std::vector<bool>& learn, const OutlierFit& from);

}  // namespace gapfarm
