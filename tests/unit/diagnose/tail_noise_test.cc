#include <gtest/gtest.h>

#include <numeric>

#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/subject.h"
#include "tests/unit/diagnose/drawn_drives.h"

namespace gapfarm::tail_noise_test {
namespace {

// The drawn drives with a scale of its own for each one's drive and readings.
Drawn drawn_with_tails(std::uint64_t seed, const NoiseTails& tails) {
  Drawn d = draw(seed);
  Stream stream({.run_seed = seed, .purpose = Purpose::kTest});
  for (std::size_t i = 0; i < d.trials.size(); ++i) {
    const double a = draw_tail_scale(tails.drive, stream);
    const double b = draw_tail_scale(tails.reading, stream);
    const Eigen::Matrix3d reading = reading_covariance(d.trials[i], kTruth.pose);
    const Eigen::Matrix3d drive = trial_covariance(d.trials[i], kTruth) - reading;
    const Eigen::Matrix3d lower = (a * drive + b * reading).llt().matrixL();
    Eigen::Vector3d z;
    for (double& value : z) value = stream.normal();
    d.residuals[i] = lower * z;
  }
  return d;
}

NoiseFit fit(const Drawn& d, bool tails) {
  return fit_predictive_noise(d.trials, d.residuals, kStart, *diagnosis_subject(Problem{}), 0.02,
                              tails);
}

TEST(PredictiveNoise, GainsFromTailsWhatIsThere) {
  for (const NoiseTails& truth : {NoiseTails{0.5, 0.1}, {0.1, 0.5}}) {
    const Drawn d = drawn_with_tails(3, truth);
    const NoiseFit tailed = fit(d, true);
    EXPECT_GT(tailed.nats, fit(d, false).nats + 15);
    NoiseEstimate known = kTruth;
    known.tails = truth;
    const std::vector<double> best =
        predictive_scores(d.trials, d.residuals, known, *diagnosis_subject(Problem{}), 0.02);
    EXPECT_GT(tailed.nats, std::accumulate(best.begin(), best.end(), 0.0) - 2)
        << "the most likely noise is at least as likely as the true one";
  }
}

TEST(PredictiveNoise, FindsNoTailsInGaussianDrives) {
  const Drawn d = draw(0);
  EXPECT_LT(fit(d, true).nats, fit(d, false).nats + 8);
}

TEST(PredictiveNoise, APerfectPredictionScoresWhatIsReported) {
  NoiseEstimate known = kTruth;
  known.tails = {0.4, 0.3};
  double mean = 0;
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    const Drawn d = drawn_with_tails(10 + seed, known.tails);
    for (double s :
         predictive_scores(d.trials, d.residuals, known, *diagnosis_subject(Problem{}), 0.02)) {
      mean += s / 2400;
    }
  }
  EXPECT_NEAR(perfect_score(draw(1).trials, known, *diagnosis_subject(Problem{}), 0.02), mean,
              0.15);
}

}  // namespace
}  // namespace gapfarm::tail_noise_test
