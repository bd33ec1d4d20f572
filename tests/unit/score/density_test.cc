#include "common/score/density.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/random/stream.h"

namespace gapfarm::density_test {

Eigen::Matrix3d example_covariance() {
  Eigen::Matrix3d S;
  S << 4e-4, 1e-4, 2e-4, 1e-4, 9e-4, -3e-4, 2e-4, -3e-4, 2.5e-3;
  return S;
}

Covariance3 factorised(const Eigen::Matrix3d& S) { return Covariance3::factorise(S).value(); }

Eigen::Vector3d normal_vector(Stream& draws) {
  const double x = draws.normal(), y = draws.normal(), z = draws.normal();
  return {x, y, z};
}

TEST(Covariance3, NamesWhatIsNotPositiveDefinite) {
  Eigen::Matrix3d S = example_covariance();
  S(2, 2) = -1;
  const auto negative = Covariance3::factorise(S);
  ASSERT_FALSE(negative.ok());
  EXPECT_THAT(negative.error().message, testing::HasSubstr("not positive definite"));
  EXPECT_FALSE(Covariance3::factorise(Eigen::Matrix3d::Zero()).ok());
  S(2, 2) = std::nan("");
  EXPECT_FALSE(Covariance3::factorise(S).ok());
}

TEST(Density, NormalHasItsClosedFormAtTheCentre) {
  const Eigen::Vector3d sd(0.1, 0.2, 0.5);
  const Covariance3 S = factorised(sd.array().square().matrix().asDiagonal());
  const double expected = -1.5 * std::log(2 * std::numbers::pi) - std::log(sd.prod());
  EXPECT_NEAR(log_normal_density(Eigen::Vector3d::Zero(), S), expected, 1e-12);
  EXPECT_NEAR(log_normal_density(sd, S), expected - 1.5, 1e-12);
}

// Radially: the volume of a shell of whitened radius r is 4 pi r^2 |S|^(1/2) dr.
TEST(Density, IntegratesToOne) {
  const Eigen::Matrix3d matrix = example_covariance();
  const Covariance3 S = factorised(matrix);
  const Eigen::Vector3d direction = S.lower() * Eigen::Vector3d(1, 2, -2) / 3;  // whitened length 1
  const double volume = std::exp(0.5 * S.log_determinant());
  for (double share : {0.0, 0.02, 0.5}) {
    double integral = 0;
    // r = e^u; the t density falls like r^-6, so e^12 is far enough.
    constexpr double kStep = 0.01;
    for (double u = -12; u < 12; u += kStep) {
      const double r = std::exp(u);
      integral += std::exp(log_predictive_density(r * direction, S, share)) * 4 * std::numbers::pi *
                  r * r * r * volume * kStep;
    }
    EXPECT_NEAR(integral, 1, 1e-6) << share;
  }
}

TEST(LogSumExp, NeitherOverflowsNorUnderflows) {
  EXPECT_NEAR(log_sum_exp(std::vector<double>{std::log(0.2), std::log(0.3)}), std::log(0.5), 1e-15);
  EXPECT_NEAR(log_sum_exp(std::vector<double>{-5000, -5000}), -5000 + std::log(2), 1e-12);
  EXPECT_NEAR(log_sum_exp(std::vector<double>{5000, -INFINITY}), 5000, 1e-12);
  EXPECT_EQ(log_sum_exp({}), -INFINITY);
}

TEST(Density, IsFiniteFarOut) {
  const Covariance3 S = factorised(1e-8 * Eigen::Matrix3d::Identity());
  const double far = log_predictive_density(Eigen::Vector3d(1e6, 1e6, 3), S, 0.02);
  EXPECT_TRUE(std::isfinite(far));
  EXPECT_GT(far, -300);  // six powers of the distance, not its square
}

// A proper score prefers the truth to every changed prediction, on average over the truth.
TEST(Scores, TheTruthScoresBest) {
  const Eigen::Matrix3d truth = example_covariance();
  const Covariance3 S = factorised(truth);
  Eigen::Matrix3d uncorrelated = truth.diagonal().asDiagonal();
  struct Candidate {
    const char* name;
    Eigen::Vector3d shift;
    Eigen::Matrix3d covariance;
  };
  const Candidate candidates[] = {{"shifted", {0.008, 0, 0}, truth},
                                  {"turned", {0, 0, 0.02}, truth},
                                  {"wide", {0, 0, 0}, 1.7 * truth},
                                  {"narrow", {0, 0, 0}, 0.6 * truth},
                                  {"uncorrelated", {0, 0, 0}, uncorrelated}};
  constexpr int kDraws = 20000;
  for (const Candidate& candidate : candidates) {
    const Covariance3 R = factorised(candidate.covariance);
    Stream draws({.run_seed = 3});
    double log_advantage = 0, energy_advantage = 0;
    for (int i = 0; i < kDraws; ++i) {
      const Eigen::Vector3d r = S.lower() * normal_vector(draws);
      log_advantage +=
          log_predictive_density(r, S, 0) - log_predictive_density(r - candidate.shift, R, 0);
      if (i % 4 == 0) {
        energy_advantage += gaussian_energy_score(r - candidate.shift, candidate.covariance) -
                            gaussian_energy_score(r, truth);
      }
    }
    EXPECT_GT(log_advantage, 0) << candidate.name;
    // The energy score hardly sees correlation; it must not prefer the wrong one by much.
    if (std::string(candidate.name) != "uncorrelated") {
      EXPECT_GT(energy_advantage, 0) << candidate.name;
    }
  }
}

TEST(ExpectedNorm, MatchesClosedForms) {
  const double root = std::sqrt(2 / std::numbers::pi);
  const Eigen::VectorXd zero = Eigen::Vector3d::Zero();
  // Maxwell's mean, a line's, a plane's (Rayleigh), a point's.
  EXPECT_NEAR(expected_norm(zero, 0.04 * Eigen::Matrix3d::Identity()), 0.2 * 2 * root, 1e-8);
  EXPECT_NEAR(expected_norm(zero, Eigen::Vector3d(9, 0, 0).asDiagonal().toDenseMatrix()), 3 * root,
              1e-5);
  EXPECT_NEAR(expected_norm(zero, Eigen::Vector3d(1, 1, 0).asDiagonal().toDenseMatrix()),
              std::sqrt(std::numbers::pi / 2), 1e-6);
  EXPECT_NEAR(expected_norm(Eigen::Vector3d(3, 0, 4), Eigen::Matrix3d::Zero()), 5, 1e-6);
  EXPECT_EQ(expected_norm(zero, Eigen::Matrix3d::Zero()), 0);
  // Folded normal.
  const double m = 0.7, s = 0.4;
  const double folded =
      s * root * std::exp(-m * m / (2 * s * s)) + m * std::erf(m / (s * std::sqrt(2.0)));
  EXPECT_NEAR(
      expected_norm(Eigen::VectorXd::Constant(1, m), Eigen::MatrixXd::Constant(1, 1, s * s)),
      folded, 1e-6);
}

// Of an ensemble of predicted residuals, over all pairs.
double ensemble_energy_score(const Eigen::Vector3d& residual,
                             const std::vector<Eigen::Vector3d>& ensemble) {
  const auto in_metres = [](const Eigen::Vector3d& d) {
    return Eigen::Vector3d(d[0], d[1], kHeadingLength_m * d[2]);
  };
  const auto count = static_cast<double>(ensemble.size());
  double to_residual = 0, among = 0;
  for (std::size_t i = 0; i < ensemble.size(); ++i) {
    to_residual += in_metres(ensemble[i] - residual).norm();
    for (std::size_t j = i + 1; j < ensemble.size(); ++j) {
      among += in_metres(ensemble[i] - ensemble[j]).norm();
    }
  }
  return to_residual / count - among / (count * count);
}

TEST(EnergyScore, EnsembleApproachesTheGaussian) {
  const Eigen::Matrix3d matrix = example_covariance();
  const Covariance3 S = factorised(matrix);
  Stream draws({.run_seed = 4});
  std::vector<Eigen::Vector3d> ensemble;
  for (int i = 0; i < 2000; ++i) ensemble.push_back(S.lower() * normal_vector(draws));
  for (const Eigen::Vector3d& r :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.05, -0.02, 0.3), Eigen::Vector3d(1, 0, 0)}) {
    EXPECT_NEAR(ensemble_energy_score(r, ensemble), gaussian_energy_score(r, matrix), 1e-3);
  }
  EXPECT_NEAR(ensemble_energy_score({0, 0, 1}, {Eigen::Vector3d::Zero()}), kHeadingLength_m, 1e-15);
}

}  // namespace gapfarm::density_test
