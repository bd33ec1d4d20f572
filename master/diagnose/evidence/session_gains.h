// Sessions that each drive at a speed of their own: a battery was charged, a surface cleaned.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "master/diagnose/evidence/spread_row.h"
#include "master/diagnose/study.h"

namespace gapfarm {

// The sessions' gains are drawn from a Gaussian about the base's speed.  Its standard deviation is
// the one of greatest restricted likelihood (Patterson and Thompson 1971), and the gain is what
// that is likelier than none; each session's own gain is its posterior.  Beside them there are,
// free, one gain of every kind of drive, one that grows with how far a command drives and one with
// the time since the session began: sessions of other commands are no faster ones, and a battery
// that sags in each is another effect.  Outlier trials count by their distance's inverse.
//
// No gain in logs of one session, or where fewer than two sessions have ten trials.
SpreadFit fit_session_gains(const Study& study, const std::vector<Eigen::Vector3d>& residuals,
                            double outlier_share);

// Log scores (nats) of every trial, its session's gain predicted by the session's other trials.
std::vector<double> scores_with_session_gains(const Study& study,
                                              const std::vector<Eigen::Vector3d>& residuals,
                                              const SpreadFit& fit, double outlier_share);

// Whitened columns of prior standard deviation 1, one a session: what gains of that spread do.
Eigen::MatrixXd session_columns(const Study& study, double spread);

}  // namespace gapfarm
