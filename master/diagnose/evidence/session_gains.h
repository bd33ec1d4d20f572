// Sessions that each drive at a speed of their own: a battery was charged, a surface cleaned.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "master/diagnose/result/diagnosis.h"
#include "master/diagnose/study.h"

namespace gapfarm {

// An effect that widens the distribution of trials rather than moves its mean, as a row: how it is
// looked for.  Effects on the mean do without what it does to trials, and it is named when trials
// that no fit saw are clearly predicted better with it.

struct SpreadFit {
  double gain = 0;  // nats over all trials
  std::vector<Estimate>
      estimates;  // of the effect's parameters, the first the one that is reported
  std::vector<SessionGain> sessions = {};   // of all sessions, of an effect that has one in each
  std::optional<NoiseEstimate> noise = {};  // beside it, where that was fitted, too
  std::string odd = {};  // why there is something, but not this; empty: it may be this
};

struct SpreadRow {
  const char* effect;
  double least_gain;  // nats; below it the search finds nothing
  SpreadFit (*fit)(const Study& study, const std::vector<Eigen::Vector3d>& residuals,
                   double outlier_share);
  // Log scores (nats) of every trial that misses its prediction so far, the effect foreseen.
  std::vector<double> (*scores)(const Study& study, const std::vector<Eigen::Vector3d>& residuals,
                                const SpreadFit& fit, double outlier_share);
  // Whether it may be one that the effect strikes; null: it strikes no single ones.
  bool (*contaminates)(const ResidualTrial& trial) = nullptr;
  // Any miss of the mean would pass for it: it is looked for when the mean is explained.
  bool after_means = false;
  // What the base and the noise of a model are beside it; null: as without.
  void (*write)(const Study& study, const SpreadFit& fit, NoiseEstimate* noise,
                Overrides* base) = nullptr;
  // Each session has a gain of its own, which no statement about means may use, rather
  // than trials that show nothing of means.
  bool by_session = false;
  // Residuals with the effect foreseen, by which others are judged beside it; null: as they are.
  std::vector<Eigen::Vector3d> (*rest)(const Study& study,
                                       const std::vector<Eigen::Vector3d>& residuals,
                                       const SpreadFit& fit) = nullptr;
  // Screened::detectable_from; null: not known.
  std::vector<std::pair<std::string, double>> (*detectable)(const Study& study) = nullptr;
};

// What was found in readings, single trials or sessions rather than in the mean of all drives.
struct FoundSpread {
  std::string effect;
  SpreadFit fit;
  const SpreadRow* row = nullptr;  // how it is looked for; null: by a step of its own
  // Held out, one a trial: of the last fit, what was found before and the effect; of that by it.
  std::vector<double> scores = {}, gained = {};
};

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

// What of the residuals these other trials do not foresee.
std::vector<Eigen::Vector3d> beside_session_gains(const Study& study,
                                                  const std::vector<Eigen::Vector3d>& residuals,
                                                  const SpreadFit& fit);

// Whitened columns of prior standard deviation 1, one a session: what gains of that spread do.
Eigen::MatrixXd session_columns(const Study& study, double spread);

}  // namespace gapfarm
