#include "master/diagnose/evidence/slip.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "common/math/statistics.h"
#include "common/score/density.h"
#include "master/diagnose/effect_diagnosis.h"
#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/subject.h"
#include "tests/unit/diagnose/drawn_drives.h"

namespace gapfarm::slip_test {
namespace {

TEST(FitSlip, FindsEvents) {
  const std::vector<bool> all(600, true);
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const Drawn d = draw(seed, 0.1, 0.3);
    const SlipFit fit = fit_slip(d.trials, d.residuals, all, kStart);
    EXPECT_GT(fit.gain, 50) << seed;
    EXPECT_NEAR(fit.probability, 0.1, 0.05) << seed;
    EXPECT_NEAR(fit.loss, 0.3, 0.06) << seed;
    EXPECT_NEAR(fit.noise.drive_side / kTruth.drive_side, 1, 0.2) << seed;
  }
}

// So frequent and small that no tail is heavy: they show in the sides' lopsidedness alone.
TEST(FitSlip, FindsFrequentSmallEvents) {
  const std::vector<bool> all(600, true);
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    const Drawn d = draw(seed, 0.46, 0.21);
    const SlipFit fit = fit_slip(d.trials, d.residuals, all, kStart);
    EXPECT_GT(fit.gain, 20) << seed;
    EXPECT_NEAR(fit.probability, 0.46, 0.15) << seed;
    EXPECT_NEAR(fit.loss, 0.21, 0.06) << seed;
  }
}

TEST(FitSlip, FindsNoneInGaussianResiduals) {
  const std::vector<bool> all(600, true);
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Drawn d = draw(seed);
    EXPECT_LT(fit_slip(d.trials, d.residuals, all, kTruth).gain, 8) << seed;
  }
}

TEST(FitSlip, StartingFarFromTheNoiseFindsNoneEither) {
  const Drawn d = draw(1);
  const SlipFit fit =
      fit_slip(d.trials, d.residuals, std::vector<bool>(600, true), {kTruth.pose, 0.002, 0.05});
  EXPECT_LT(fit.gain, 8);
}

TEST(FitSlip, StartsFromNothing) {
  const Drawn d = draw(1, 0.1, 0.3);
  const std::vector<bool> all(600, true);
  EXPECT_TRUE(std::isfinite(fit_slip(d.trials, d.residuals, all, {kTruth.pose, 0, 0}).gain));
}

TEST(FitSlip, LeavesMaskedTrialsOut) {
  Drawn d = draw(1);
  std::vector<bool> mask(600, true);
  for (std::size_t i = 0; i < 600; i += 10) {
    d.residuals[i] -= 0.4 * d.trials[i].left;
    mask[i] = false;
  }
  EXPECT_GT(fit_slip(d.trials, d.residuals, std::vector<bool>(600, true), kStart).gain, 50);
  EXPECT_LT(fit_slip(d.trials, d.residuals, mask, kStart).gain, 8);
}

// What a drive's log density is under the events themselves, by adding up many draws of them.
TEST(TrialsWithSlips, ScoreIsTheMixturesDensity) {
  const Drawn d = draw(1, 0.2, 0.4);
  const SlipFit fit{.gain = 1, .probability = 0.2, .loss = 0.4, .noise = kTruth};
  const std::vector<SlipTrial> judged =
      trials_with_slips(d.trials, d.residuals, fit, 0.04, /*outlier_share=*/0);
  Stream stream({.run_seed = 2});
  double difference = 0;
  for (std::size_t i = 0; i < 60; ++i) {
    const ResidualTrial& t = d.trials[i];
    const auto cov = Covariance3::factorise(trial_covariance(t, kTruth));
    double density = 0;
    constexpr int kDraws = 4000;
    for (int k = 0; k < kDraws; ++k) {
      const Eigen::Vector3d r = d.residuals[i] - 0.04 * (t.left + t.right);
      const double left = stream.bernoulli(0.2) ? 0.4 * stream.uniform() : 0;
      const double right = stream.bernoulli(0.2) ? 0.4 * stream.uniform() : 0;
      const Eigen::Vector3d missed = r - d.left_at(i, d.end(i, left, right));
      density += std::exp(log_normal_density(missed, *cov)) / kDraws;
    }
    difference += std::abs(std::log(density) - judged[i].score) / 60;
  }
  EXPECT_LT(difference, 0.25);  // six steps of a loss stand for all
}

TEST(TrialsWithSlips, WithoutEventsItIsTheDensityOfOutliers) {
  const Drawn d = draw(1);
  const SlipFit none{.gain = 0, .probability = 0, .loss = 0.3, .noise = kTruth};
  const std::vector<SlipTrial> judged = trials_with_slips(d.trials, d.residuals, none, 0, 0.02);
  for (std::size_t i = 0; i < d.trials.size(); ++i) {
    const auto cov = Covariance3::factorise(trial_covariance(d.trials[i], kTruth));
    EXPECT_NEAR(judged[i].score, log_predictive_density(d.residuals[i], *cov, 0.02), 1e-9);
  }
}

// A side that lost speed ends near where some event leads, a drive that was pushed aside does not.
TEST(TrialsWithSlips, ReportsSlipsFromOtherOutliers) {
  Drawn d = draw(2);
  const SlipFit fit{.gain = 1, .probability = 0.05, .loss = 0.5, .noise = kTruth};
  for (std::size_t i = 0; i < 60; ++i) {
    if (i % 4 < 2) {
      d.residuals[i] += d.left_at(i, d.end(i, 0.4, 0));
    } else {
      d.residuals[i] += Eigen::Vector3d(0, 0.2, -0.6);
    }
  }
  const std::vector<SlipTrial> judged = trials_with_slips(d.trials, d.residuals, fit, 0, 0);
  std::size_t slips = 0, others = 0;
  for (std::size_t i = 0; i < 60; ++i) {
    if (judged[i].squared < 11.5) continue;
    (i % 4 < 2 ? slips : others) += (judged[i].nearest < 11.5) == (i % 4 < 2);
  }
  EXPECT_GE(slips, 25U);
  EXPECT_GE(others, 25U);
}

// A side that loses most of its speed turns the robot by a radian and more, along an arc: to first
// order it would end 0.2 m from there.
TEST(TrialsWithSlips, FollowsGreatLosses) {
  Drawn d = draw(5);
  const SlipFit fit{.gain = 1, .probability = 0.05, .loss = 0.95, .noise = kTruth};
  for (std::size_t i = 0; i < 60; ++i) {
    const Eigen::Vector3d r = d.residuals[i];
    const Pose end = d.end(i, i % 4 < 2 ? 0.87 : 0, i % 4 < 2 ? 0 : 0.87);
    d.residuals[i] = r + d.left_at(i, end);
  }
  const std::vector<SlipTrial> judged = trials_with_slips(d.trials, d.residuals, fit, 0, 0);
  for (std::size_t i = 0; i < 60; ++i) {
    EXPECT_GT(judged[i].squared, 11.5) << i;
    EXPECT_LT(judged[i].nearest, 16) << i;
  }
}

// Both sides at once slip once in forty drives where either slips in twenty: drives that go
// straight but too short are something else.
TEST(TrialsWithSlips, BothSidesAtOnceAreNoSlip) {
  Drawn d = draw(2);
  const SlipFit fit{.gain = 1, .probability = 0.05, .loss = 0.5, .noise = kTruth};
  for (std::size_t i = 0; i < 60; ++i) {
    d.residuals[i] -= 0.3 * (d.trials[i].left + d.trials[i].right);
  }
  const std::vector<SlipTrial> judged = trials_with_slips(d.trials, d.residuals, fit, 0, 0);
  for (std::size_t i = 0; i < 60; ++i) {
    if (judged[i].squared < 20) continue;
    EXPECT_GT(judged[i].nearest, 11.5) << i;
  }
}

TEST(TrialsWithSlips, ForeseenSlipsScoreHigher) {
  const Drawn d = draw(3, 0.1, 0.3);
  const SlipFit fit = fit_slip(d.trials, d.residuals, std::vector<bool>(600, true), kStart);
  const NoiseEstimate wide = refit_drive_noise(d.trials, d.residuals, kStart, false);
  const SlipFit none{.noise = wide};
  std::vector<double> with, without;
  for (const SlipTrial& t : trials_with_slips(d.trials, d.residuals, fit, 0.015, 0.02)) {
    with.push_back(t.score);
  }
  for (const SlipTrial& t : trials_with_slips(d.trials, d.residuals, none, 0, 0.02)) {
    without.push_back(t.score);
  }
  EXPECT_GT(mean(with) - mean(without), 0.1);
}

TEST(ResidualKurtosis, ReportsTailsFromNone) {
  Stream stream({.run_seed = 1});
  Eigen::VectorXd z(1800);
  for (double& v : z) v = stream.normal();
  EXPECT_NEAR(residual_kurtosis(z), 3, 0.3);
  for (Eigen::Index i = 0; i < z.size(); i += 30) z[i] *= 5;
  EXPECT_GT(residual_kurtosis(z), 6);
  EXPECT_EQ(residual_kurtosis(Eigen::VectorXd::Zero(9)), 3);
}

// What a bump does to those that drive over it looks as a slip does.
TEST(SlipSpread, OutliersInOnePlaceAreNoSlips) {
  const Drawn drawn = draw(3, 0.02, 0.6);
  const SpreadRow& slips = *effect_diagnosis("slip_events").spread;
  Study study;
  study.subject = diagnosis_subject(Problem{});
  study.trials = drawn.trials;
  study.use_noise(kTruth);
  const SpreadFit scattered = slips.fit(study, drawn.residuals, 0.005);
  EXPECT_GT(scattered.gain, kLeastSlipGain);
  EXPECT_EQ(scattered.odd, "");
  for (std::size_t i = 0; i < study.size(); ++i) {
    ResidualTrial& t = study.trials[i];
    if ((study.whitener[i] * drawn.residuals[i]).norm() < 4) continue;
    const double dx = 0.6 + 0.05 * std::cos(double(i)) - t.X_WS.x,
                 dy = 0.5 + 0.05 * std::sin(double(i)) - t.X_WS.y;
    for (Pose* X : {&t.X_WS, &t.X_WP, &t.X_WE}) *X = {X->x + dx, X->y + dy, X->theta};
  }
  const SpreadFit here = slips.fit(study, drawn.residuals, 0.005);
  EXPECT_EQ(here.gain, scattered.gain);
  EXPECT_NE(here.odd.find("in one place"), std::string::npos) << here.odd;
}

}  // namespace
}  // namespace gapfarm::slip_test
