#include "common/score/scale_mixture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/score/density.h"

namespace gapfarm::scale_mixture_test {

Eigen::Matrix3d drive_covariance() {
  Eigen::Matrix3d S;
  S << 4e-4, 0, 0, 0, 1e-4, 3e-4, 0, 3e-4, 1.2e-3;
  return S;
}

Eigen::Matrix3d reading_covariance() {
  Eigen::Matrix3d S;
  S << 9e-5, 0, 0, 0, 2e-4, 1e-4, 0, 1e-4, 5e-4;
  return S;
}

// Multivariate t with scale matrix S.
double log_t(const Eigen::Vector3d& r, const Eigen::Matrix3d& S, double freedom) {
  const Covariance3 factor = Covariance3::factorise(S).value();
  return std::lgamma((freedom + 3) / 2) - std::lgamma(freedom / 2) -
         1.5 * std::log(freedom * std::numbers::pi) - 0.5 * factor.log_determinant() -
         0.5 * (freedom + 3) * std::log1p(factor.squared_distance(r) / freedom);
}

TEST(TailScales, SumToOneAndAreOneOfAGaussian) {
  ASSERT_EQ(tail_scales(0).size(), 1u);
  EXPECT_EQ(tail_scales(0)[0].scale, 1);
  for (double tail : {1e-4, 0.05, 0.3, 0.7, 1.0}) {
    double sum = 0;
    for (const TailScale& s : tail_scales(tail)) sum += s.weight;
    EXPECT_NEAR(sum, 1, 1e-12) << tail;
  }
}

TEST(TailedDensity, IsStudentsTWhereOneSourceIsAllThereIs) {
  const Eigen::Matrix3d S = drive_covariance() + reading_covariance();
  const Eigen::Vector3d direction =
      Covariance3::factorise(S)->lower() * Eigen::Vector3d(1, 2, -2) / 3;  // whitened length 1
  for (double freedom : {1.0, 1.5, 2.0, 3.0}) {
    const TailedDensity density({0, 1 / freedom});
    for (double r : {0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 14.0, 20.0}) {
      EXPECT_NEAR(*density.log_density(r * direction, S, S, 0), log_t(r * direction, S, freedom),
                  0.035)
          << freedom << " at " << r;
    }
  }
}

TEST(TailedDensity, WithoutTailsIsTheOldDensityToTheBit) {
  const Eigen::Matrix3d S = drive_covariance() + reading_covariance();
  const Eigen::Vector3d r(0.03, -0.01, 0.08);
  const Covariance3 factor = Covariance3::factorise(S).value();
  for (double share : {0.0, 0.02}) {
    EXPECT_EQ(*TailedDensity({}).log_density(r, S, Eigen::Matrix3d::Zero(), share),
              log_predictive_density(r, factor, share));
  }
}

TEST(TailedDensity, GoesOverIntoTheGaussian) {
  const Eigen::Matrix3d S = drive_covariance() + reading_covariance();
  const TailedDensity nearly({1e-4, 1e-4});
  for (double r : {0.0, 0.01, 0.05}) {
    const Eigen::Vector3d residual(r, -r, 2 * r);
    EXPECT_NEAR(*nearly.log_density(residual, S, reading_covariance(), 0),
                *TailedDensity({}).log_density(residual, S, reading_covariance(), 0), 0.02);
  }
}

// Over a box in the whitened residual by importance sampling from a wide t.
TEST(TailedDensity, IntegratesToOne) {
  const Eigen::Matrix3d R = reading_covariance(), S = drive_covariance() + R;
  const Covariance3 factor = Covariance3::factorise(S).value();
  Stream stream({.purpose = Purpose::kTest, .birth_id = 3});
  const TailedDensity density({0.5, 0.3}), wide({0.0, 0.9});
  double sum = 0;
  constexpr int kDraws = 20000;
  for (int i = 0; i < kDraws; ++i) {
    const double scale = std::sqrt(draw_tail_scale(0.9, stream));
    Eigen::Vector3d z;
    for (double& value : z) value = stream.normal();
    const Eigen::Vector3d r = scale * (factor.lower() * z);
    sum += std::exp(*density.log_density(r, S, R, 0.02) - *wide.log_density(r, S, S, 0));
  }
  EXPECT_NEAR(sum / kDraws, 1, 0.03);
}

// Which source a tail belongs to is not a matter of names.
TEST(TailedDensity, SourcesAreAlike) {
  const Eigen::Matrix3d D = drive_covariance() + 1e-6 * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d R = reading_covariance();
  const Eigen::Vector3d r(0.1, 0.02, -0.2);
  EXPECT_NEAR(*TailedDensity({0.5, 0.2}).log_density(r, D + R, R, 0.02),
              *TailedDensity({0.2, 0.5}).log_density(r, D + R, D, 0.02), 1e-9);
}

// A proper score: on average over the truth no other tails do better, and a perfect prediction
// scores what is reported that it does.
TEST(TailedDensity, TheTruthScoresBest) {
  const Eigen::Matrix3d R = reading_covariance(), S = drive_covariance() + R;
  const NoiseTails truth{0.5, 0.1};
  const TailedDensity density(truth);
  constexpr int kDraws = 4000;
  Stream stream({.purpose = Purpose::kTest, .birth_id = 7});
  const auto best = expected_log_density(density, truth, S, R, 0.02, kDraws, stream);
  ASSERT_TRUE(best.ok());
  for (const NoiseTails& other : {NoiseTails{0, 0}, {0.1, 0.5}, {0, 0.1}, {0.9, 0.1}}) {
    Stream same({.purpose = Purpose::kTest, .birth_id = 7});
    const auto worse = expected_log_density(TailedDensity(other), truth, S, R, 0.02, kDraws, same);
    ASSERT_TRUE(worse.ok());
    EXPECT_GT(*best, *worse) << other.drive << " " << other.reading;
  }
}

TEST(TailedDensity, NamesWhatIsNotPositiveDefinite) {
  const auto none =
      TailedDensity({0.5, 0.5})
          .log_density(Eigen::Vector3d::Zero(), drive_covariance() + reading_covariance(),
                       Eigen::Matrix3d::Zero(), 0.02);
  ASSERT_FALSE(none.ok());
  EXPECT_THAT(none.error().message, testing::HasSubstr("of the readings"));
}

TEST(TailScale, IsDrawnByItsWeight) {
  Stream stream({.purpose = Purpose::kTest, .birth_id = 5});
  const std::vector<TailScale> scales = tail_scales(0.5);
  std::vector<double> counts(scales.size());
  constexpr int kDraws = 20000;
  for (int i = 0; i < kDraws; ++i) {
    const double drawn = draw_tail_scale(0.5, stream);
    for (std::size_t k = 0; k < scales.size(); ++k) counts[k] += drawn == scales[k].scale ? 1 : 0;
  }
  for (std::size_t k = 0; k < scales.size(); ++k) {
    const double w = scales[k].weight;
    EXPECT_NEAR(counts[k] / kDraws, w, 5 * std::sqrt(w / kDraws) + 1e-4) << k;
  }
  Stream a({.purpose = Purpose::kTest}), b({.purpose = Purpose::kTest});
  EXPECT_EQ(draw_tail_scale(0, a), 1);
  EXPECT_EQ(a.bits(), b.bits()) << "a Gaussian draws nothing";
}

TEST(TailedDensity, MarginalsAreWhatIsLeftWhenTheRestIsIntegratedOut) {
  const Eigen::Matrix3d R = reading_covariance(), S = drive_covariance() + R;
  const Eigen::Vector3d r(0.03, -0.01, 0.08);
  for (const NoiseTails& tails : {NoiseTails{}, NoiseTails{0.3, 0.2}}) {
    const TailedDensity density(tails);
    const auto at = [&](double x, double y, double theta) {
      return std::exp(*density.log_density({x, y, theta}, S, R, 0.02));
    };
    double position = 0;
    constexpr double kStep_rad = 0.004;
    for (double theta = -8; theta < 8; theta += kStep_rad) {
      position += kStep_rad * at(r[0], r[1], theta);
    }
    EXPECT_NEAR(*density.log_position_density(r, S, R, 0.02), std::log(position), 1e-3);
    double heading = 0;
    constexpr double kStep_m = 0.008;
    for (double x = -1; x < 1; x += kStep_m) {
      for (double y = -1; y < 1; y += kStep_m) heading += kStep_m * kStep_m * at(x, y, r[2]);
    }
    EXPECT_NEAR(*density.log_heading_density(r, S, R, 0.02), std::log(heading), 5e-3);
  }
}

}  // namespace gapfarm::scale_mixture_test
