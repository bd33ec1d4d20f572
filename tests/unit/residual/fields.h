// Corrections and drives of the tests.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

#include "common/random/stream.h"
#include "master/diagnose/correction/fit.h"

namespace gapfarm::tests {

inline std::size_t covariate(std::string_view name) {
  const auto known = residual_covariates();
  return static_cast<std::size_t>(
      std::find_if(known.begin(), known.end(),
                   [&](const ResidualCovariate& c) { return c.name == name; }) -
      known.begin());
}

inline ResidualTerm heading_term() {
  ResidualTerm term;
  term.by_drive = true;
  term.covariates = {covariate("heading")};
  term.lengths = {0.7};
  term.centres = Eigen::MatrixXd(3, 1);
  term.centres << -2, 0, 2;
  Eigen::MatrixXd shifts(3, 3);
  shifts << 0.01, -0.002, 0.03, 0, 0.004, 0, -0.005, 0, 0.02;
  term.weights = {{"forward", shifts}, {"turn_cw", 2 * shifts}};
  return term;
}

inline ResidualTerm place_term(ResidualFrame frame) {
  ResidualTerm term;
  term.frame = frame;
  term.covariates = {covariate("x"), covariate("y")};
  term.lengths = {0.5, 0.4};
  term.centres = Eigen::MatrixXd(2, 2);
  term.centres << 0.2, 0.3, 0.9, 0.5;
  Eigen::MatrixXd shifts(2, 3);
  shifts << 0.02, -0.01, 0, -0.004, 0.015, 0;
  term.weights = {{"", shifts}};
  return term;
}

inline const Eigen::Vector3d kNoise{0.004, 0.004, 0.02};

// What drives of a log miss: a field of whatever they are given, and noise.
struct DrawnLog {
  ResidualData data;
  Residuals residuals, truth;
};

// Five sessions of drives ahead and turns, over 2 m by 2 m.  `field`: a shift in the axes of the
// predicted end.
template <class Field>
DrawnLog draw_log(std::uint64_t seed, std::size_t trials, const Field& field) {
  Stream stream({.run_seed = seed, .purpose = Purpose::kTest});
  DrawnLog log;
  for (std::size_t i = 0; i < trials; ++i) {
    const bool turns = i % 3 == 2;
    LoggedMotion f;
    f.command = turns ? "turn_cw" : "forward";
    f.left = turns ? 0.3 : 1;
    f.right = turns ? -0.3 : 1;
    f.duration_s = 0.5 * static_cast<double>(1 + stream.below(3));
    f.X_WS = {stream.uniform(0, 2), stream.uniform(0, 2),
              stream.uniform(-std::numbers::pi, std::numbers::pi)};
    f.session_time_s = 10 * static_cast<double>(i % (trials / 5 + 1));
    f.moved = stream.bernoulli(0.2);
    const Pose motion = turns ? Pose{0, 0, -1.2 * f.duration_s} : Pose{0.25 * f.duration_s, 0, 0};
    log.data.facts.push_back(f);
    log.data.ends.push_back(f.X_WS * motion);
    log.data.whiteners.push_back(kNoise.cwiseInverse().asDiagonal());
    log.data.fold.push_back(5 * i / trials);
    log.data.learn.push_back(true);
    log.truth.push_back(field(f, log.data.ends.back()));
    const Eigen::Vector3d noise(stream.normal(), stream.normal(), stream.normal());
    log.residuals.push_back(log.truth.back() + kNoise.cwiseProduct(noise));
  }
  return log;
}

// Mean square of what a correction leaves of the truth, in units of the noise, over what is there.
inline double share_left(const DrawnLog& log, const Residuals& shifts) {
  double left = 0, all = 0;
  for (std::size_t i = 0; i < shifts.size(); ++i) {
    left += (log.data.whiteners[i] * (log.truth[i] - shifts[i])).squaredNorm();
    all += (log.data.whiteners[i] * log.truth[i]).squaredNorm();
  }
  return left / all;
}

inline ResidualFit fit_log(const DrawnLog& log) {
  return fit_residual(log.data, log.residuals, [&](std::size_t) { return log.residuals; });
}

}  // namespace gapfarm::tests
