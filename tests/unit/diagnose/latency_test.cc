#include "master/diagnose/evidence/latency.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/random/stream.h"
#include "master/diagnose/subject.h"

namespace gapfarm::latency_test {
namespace {

// 400 drives of 0.25 m, each from where the one before was read to have ended; every twentieth time
// the robot was put elsewhere.  A late reading is of the robot 0.3 s before it came to rest.
struct SharedLog {
  Study study;
  std::vector<Eigen::Vector3d> velocity;
  std::vector<bool> late;
};

constexpr double kSpeed_m_s = 0.25;
constexpr double kAge_s = 0.3;

SharedLog shared_log(std::uint64_t seed, double share) {
  Stream stream({.run_seed = seed});
  SharedLog log;
  log.study.subject = diagnosis_subject(Problem{});
  const PoseNoise reading{0.004, 0.02};
  const auto read = [&](const Pose& X) {
    return X * Pose{reading.position_m * stream.normal(), reading.position_m * stream.normal(),
                    reading.heading_rad * stream.normal()};
  };
  Pose truth, logged;
  for (std::size_t i = 0; i < 400; ++i) {
    if (i % 20 == 0) {
      truth = {stream.uniform(0, 2), stream.uniform(0, 2), stream.uniform(-3, 3)};
      logged = read(truth);
    } else {
      log.study.gaps.push_back({i, i - 1, Eigen::Vector3d::Zero()});
    }
    ResidualTrial t;
    t.X_WS = logged;
    const double drive = 0.25 * (1 + 0.02 * stream.normal());
    t.left = t.right = {0.125, 0, 0};
    truth = truth * Pose{drive, 0, 0};
    log.late.push_back(stream.bernoulli(share));
    logged = read(log.late.back() ? truth * Pose{-kAge_s * kSpeed_m_s, 0, 0} : truth);
    t.X_WE = logged;
    t.X_WP = t.X_WS * Pose{0.25, 0, 0};
    t.residual = local_difference(t.X_WP, t.X_WE);
    log.study.trials.push_back(t);
    log.velocity.emplace_back(kSpeed_m_s, 0, 0);
  }
  log.study.reading_noise_known = false;
  log.study.use_noise({reading, 0.02, 0.001});
  return log;
}

double squares(const Study& study, const std::vector<Eigen::Vector3d>& residuals) {
  return study.whiten(residuals).squaredNorm();
}

TEST(FitSharedLatency, FindsTheReadingsThatCameLate) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const SharedLog log = shared_log(seed, 0.03);
    const LatencyFit fit = fit_shared_latency(log.study, log.velocity);
    EXPECT_GT(fit.gain, 40) << seed;
    EXPECT_NEAR(fit.latency_s, kAge_s, 0.05) << seed;
    EXPECT_NEAR(fit.share, 0.03, 0.03) << seed;
    for (const ReadingGap& gap : log.study.gaps) {
      EXPECT_EQ(fit.weights[gap.previous] > 0.5, log.late[gap.previous]) << seed;
    }
  }
}

TEST(FitSharedLatency, FindsNoneInNoise) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const SharedLog log = shared_log(seed, 0);
    EXPECT_LT(fit_shared_latency(log.study, log.velocity).gain, 8) << seed;
  }
}

TEST(LateMarks, TakeAwayWhatLateReadingsLeft) {
  const SharedLog log = shared_log(1, 0.03);
  const LatencyFit fit = fit_shared_latency(log.study, log.velocity);
  std::vector<Eigen::Vector3d> before, after;
  const std::vector<Eigen::Vector3d> marks = late_marks(log.study, fit, log.velocity);
  for (std::size_t i = 0; i < marks.size(); ++i) {
    before.push_back(log.study.trials[i].residual);
    after.push_back(before.back() - marks[i]);
  }
  // The last drives before the robot was moved have no next one that would show.
  EXPECT_GT(squares(log.study, before), 2.0 * 1200);
  EXPECT_LT(squares(log.study, after), 1.2 * 1200);
}

}  // namespace
}  // namespace gapfarm::latency_test
