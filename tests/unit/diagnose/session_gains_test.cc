#include "master/diagnose/evidence/session_gains.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "master/diagnose/fit/estimate.h"
#include "master/diagnose/subject.h"
#include "tests/unit/diagnose/drawn_drives.h"

namespace gapfarm::session_gains_test {
namespace {

constexpr double kOutliers = 0.005;

// 600 drives ahead and turning in sessions of as many, each with a gain of its own.
struct SessionLog {
  SessionLog(std::uint64_t seed, const std::vector<double>& gains, double probability = 0) {
    Drawn drawn = draw(seed, probability, 0.5);
    residuals = drawn.residuals;
    study.subject = diagnosis_subject(Problem{});
    study.sessions = gains.size();
    const std::size_t each = drawn.trials.size() / gains.size();
    for (std::size_t i = 0; i < drawn.trials.size(); ++i) {
      ResidualTrial& t = drawn.trials[i];
      t.session = std::min(i / each, gains.size() - 1);
      t.command = i % 2;
      t.cell = i % 2;
      t.context.session_time_s = 10.0 * static_cast<double>(i % each);
      residuals[i] += gains[t.session] * (t.left + t.right);
    }
    study.cells.resize(2);
    study.trials = std::move(drawn.trials);
    study.use_noise(kTruth);
  }

  // A battery that loses so much of its speed a minute, charged before every session.
  void sag(double rate) {
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      const ResidualTrial& t = study.trials[i];
      residuals[i] -= rate * t.context.session_time_s / 60 * (t.left + t.right);
    }
  }

  SpreadFit fit() const { return fit_session_gains(study, residuals, kOutliers); }

  Study study;
  std::vector<Eigen::Vector3d> residuals;
};

TEST(SessionGains, ReportEverySessionsOwn) {
  const std::vector<double> gains = {0.05, -0.02, 0.01, -0.06, 0.02};
  const SpreadFit fit = SessionLog(1, gains).fit();
  ASSERT_GT(fit.gain, 100);
  EXPECT_EQ(fit.estimates[0].key, "spread");
  EXPECT_LT(fit.estimates[0].lo, 0.04);
  EXPECT_GT(fit.estimates[0].hi, 0.05);
  ASSERT_EQ(fit.sessions.size(), gains.size());
  for (std::size_t s = 0; s < gains.size(); ++s) {
    EXPECT_NEAR(fit.sessions[s].gain, gains[s], 0.006) << s;
    EXPECT_LT(fit.sessions[s].hi - fit.sessions[s].lo, 0.02) << s;
  }
}

TEST(SessionGains, AreNoneInSessionsThatAreAlike) {
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    EXPECT_LT(SessionLog(seed, {0, 0, 0, 0, 0, 0}).fit().gain, 6) << seed;
  }
}

TEST(SessionGains, TakeTwoSessions) { EXPECT_EQ(SessionLog(2, {0.08}).fit().gain, 0); }

// Sessions of unlike lengths end at unlike charges, but what is lost is lost within each.
TEST(SessionGains, AreNoBatteryThatSags) {
  SessionLog log(3, {0, 0, 0, 0});
  log.sag(0.01);
  EXPECT_LT(log.fit().gain, 6);
  SessionLog both(3, {0.04, -0.05, 0.03, -0.02});
  both.sag(0.01);
  const SpreadFit fit = both.fit();
  EXPECT_GT(fit.gain, 50);
  EXPECT_NEAR(fit.sessions[0].gain - fit.sessions[1].gain, 0.09, 0.01);
}

TEST(SessionGains, AreNoOtherCommands) {
  SessionLog log(4, {0, 0});
  // Turns are slower than is predicted, and the second session holds nothing else.
  for (std::size_t i = 0; i < log.residuals.size(); ++i) {
    ResidualTrial& t = log.study.trials[i];
    if (t.command == 1) log.residuals[i] -= 0.05 * (t.left + t.right);
    t.session = t.command;
  }
  EXPECT_LT(log.fit().gain, 6);
}

TEST(SessionGains, ComeFromNoFewSlips) {
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    EXPECT_LT(SessionLog(seed, {0, 0, 0, 0, 0, 0, 0, 0}, 0.04).fit().gain, 12) << seed;
  }
}

TEST(SessionGains, PredictATrialByItsSession) {
  const SessionLog log(5, {0.05, -0.02, 0.01, -0.06});
  const SpreadFit fit = log.fit();
  const std::vector<double> without = scores_of(log.study, log.residuals, kOutliers);
  const std::vector<double> with =
      scores_with_session_gains(log.study, log.residuals, fit, kOutliers);
  const double gained = std::accumulate(with.begin(), with.end(), 0.0) -
                        std::accumulate(without.begin(), without.end(), 0.0);
  EXPECT_NEAR(gained, fit.gain, 0.3 * fit.gain + 10);
}

// A turn that is a quarter longer ends along its arc, not along its last direction.
TEST(SessionGains, LeaveNothingOfALongerTurn) {
  const std::vector<double> gains = {0.25, -0.2, 0.1, -0.15};
  SessionLog log(7, {0, 0, 0, 0});
  std::vector<Eigen::Vector3d> left;
  for (std::size_t i = 0; i < log.residuals.size(); ++i) {
    ResidualTrial& t = log.study.trials[i];
    if (t.command == 1) t.left = Eigen::Vector3d(0.2, 0, 2.5) - t.right;
    const Eigen::Vector3d r = log.residuals[i];
    t.X_WP = t.X_WS * exp(of_gain(t));
    t.X_WE = t.X_WP * exp(gains[t.session] * of_gain(t)) * Pose{r[0], r[1], r[2]};
    left.push_back(residual_of(t, t.X_WP));
  }
  log.study.use_noise(kTruth);
  const auto missed = [&](const SpreadFit& fit) {
    double squares = 0;
    for (std::size_t i = 0; i < left.size(); ++i) {
      const ResidualTrial& t = log.study.trials[i];
      const double y = left[i].y() - fit.sessions[t.session].gain * of_gain(t).y();
      if (t.command == 1) squares += y * y / static_cast<double>(left.size() / 2);
    }
    return std::sqrt(squares);
  };
  const SpreadFit fit = fit_session_gains(log.study, left, kOutliers);
  EXPECT_LT(missed(fit), 0.0025) << "the noise of the readings, 1.5 mm each, and of turns";
  for (std::size_t s = 0; s < gains.size(); ++s) {
    EXPECT_NEAR(fit.sessions[s].gain, gains[s], 0.0025) << s;
  }
}

// A nuisance has a prior of its own width.
TEST(SessionGains, LeaveColumnsToTheSessionsAlone) {
  const SessionLog log(6, {0, 0, 0});
  const Eigen::MatrixXd columns = session_columns(log.study, 0.1);
  ASSERT_EQ(columns.cols(), 3);
  for (std::size_t i = 0; i < log.study.size(); ++i) {
    const ResidualTrial& t = log.study.trials[i];
    const Eigen::Vector3d whole = log.study.whitener[i] * (t.left + t.right);
    for (Eigen::Index s = 0; s < 3; ++s) {
      const double share = s == static_cast<Eigen::Index>(t.session) ? 0.1 : 0;
      EXPECT_LT((columns.block<3, 1>(static_cast<Eigen::Index>(3 * i), s) - share * whole).norm(),
                1e-9);
    }
  }
}

}  // namespace
}  // namespace gapfarm::session_gains_test
