#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "common/random/stream.h"
#include "master/experiments/plan/visibility.h"
#include "master/infer/certificate.h"

namespace gapfarm::plan::selection_test {

using infer::chance_of_exceeding, infer::noncentrality_for;
using ::testing::ElementsAre;

Rows row(std::initializer_list<double> values) {
  Rows r(1, static_cast<Eigen::Index>(values.size()));
  Eigen::Index k = 0;
  for (const double v : values) r(0, k++) = v;
  return r;
}

TEST(Select, TakesWhatReportsMostAndThenWhatIsNotKnownYet) {
  const std::vector<Rows> candidates = {row({1, 0}), row({3, 0}), row({0, 2}), row({2.9, 0})};
  // After 3 along the first unknown, 2.9 more of it says less than 2 along the other.
  EXPECT_THAT(select(candidates, 0, 3), ElementsAre(1, 2, 3));
  EXPECT_EQ(select(candidates, 0, 10).size(), 4U);
  EXPECT_TRUE(select({}, 0, 3).empty());
}

TEST(Select, DoesNotCareForWhatOnlyHasToBeAllowedFor) {
  // The last unknown is a nuisance: by itself worth nothing, beside the first one it hides it.
  const std::vector<Rows> candidates = {row({0, 9}), row({2, 9}), row({1.5, 0})};
  EXPECT_EQ(select(candidates, 1, 1).front(), 2U);
  // A pair of which one shows the nuisance alone frees the other.
  EXPECT_THAT(select({row({2, 9}), row({0, 9})}, 1, 2), ElementsAre(0, 1));
}

TEST(BestOverPlan, OfOneUnknownIsItsBestExperimentRepeated) {
  const std::vector<Rows> candidates = {row({2}), row({3}), row({1})};
  const double best = std::sqrt((1 + 3.0 * 3 + 2 * 2) / (1 + 2 * 3.0 * 3));
  EXPECT_NEAR(best_over_plan(candidates, 0, {1, 0}), best, 1e-3);
  EXPECT_NEAR(best_over_plan(candidates, 0, {1}), 1, 1e-3);
}

TEST(BestOverDrive, OfOneUnknownIsItsBestRateAllTheTime) {
  const double planned = 1 / (1 + 10 * 2.0 * 2);  // ten seconds of the worse one
  EXPECT_NEAR(best_over_drive({row({2}), row({3})}, 10, {0}, Eigen::VectorXd::Constant(1, planned)),
              std::sqrt(1 / (1 + 10 * 3.0 * 3) / planned), 1e-3);
}

TEST(BestOverDrive, SharesTheTimeBetweenUnknowns) {
  // Each shows one of two: half of the time for each is best.
  const double half = 1 / (1 + 5 * 4.0);
  EXPECT_NEAR(best_over_drive({row({2, 0}), row({0, 2})}, 10, {0, 1}, Eigen::Vector2d(half, half)),
              1, 2e-3);
}

// Every choice of so many, repeats included, and the bound lies close above the best of them.
TEST(BestOverPlan, NoChoiceIsBetter) {
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    Stream stream({.run_seed = seed});
    std::vector<Rows> candidates;
    for (int c = 0; c < 7; ++c) {
      Rows r(2, 3);
      for (Eigen::Index i = 0; i < r.size(); ++i) r.data()[i] = 2 * stream.normal();
      candidates.push_back(r);
    }
    const auto merit = [&](const std::vector<std::size_t>& of) {
      Eigen::Matrix3d m = Eigen::Matrix3d::Identity();
      for (const std::size_t c : of) m += candidates[c].transpose() * candidates[c];
      return std::log(m.determinant() / m(2, 2));
    };
    double most = 0;
    for (std::size_t code = 0; code < 7 * 7 * 7 * 7; ++code) {
      most = std::max(most, merit({code % 7, code / 7 % 7, code / 49 % 7, code / 343}));
    }
    const auto chosen = select(candidates, 1, 4);
    const double bound = best_over_plan(candidates, 1, chosen);
    const double best = std::exp((merit(chosen) - most) / 4);
    EXPECT_LE(bound, best + 1e-9) << seed;
    EXPECT_GE(bound, 0.85 * best) << seed;
  }
}

TEST(Select, IsTheGreedyChoiceByDeterminants) {
  Stream stream({.run_seed = 5});
  std::vector<Rows> candidates;
  for (int c = 0; c < 12; ++c) {
    Rows r(3, 4);
    for (Eigen::Index i = 0; i < r.size(); ++i) r.data()[i] = stream.normal();
    candidates.push_back(r);
  }
  const auto merit = [&](const std::vector<std::size_t>& chosen) {
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    for (const std::size_t c : chosen) m += candidates[c].transpose() * candidates[c];
    return std::log(m.determinant()) - std::log(m.bottomRightCorner<1, 1>().determinant());
  };
  const std::vector<std::size_t> chosen = select(candidates, 1, 5);
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    std::vector<std::size_t> partial(chosen.begin(), chosen.begin() + static_cast<long>(k));
    double best = -1;
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      if (std::count(partial.begin(), partial.end(), c) > 0) continue;
      std::vector<std::size_t> with = partial;
      with.push_back(c);
      best = std::max(best, merit(with));
    }
    partial.push_back(chosen[k]);
    EXPECT_NEAR(merit(partial), best, 1e-9) << k;
  }
}

TEST(Information, IsWhatNuisancesLeave) {
  const Eigen::Vector3d shift(3, 4, 0);
  EXPECT_DOUBLE_EQ(information(shift, Eigen::MatrixXd(3, 0)), 25);
  // A nuisance along y of prior standard deviation 2: 16 / (1 + 4) is left of y's 16.
  EXPECT_NEAR(information(shift, Eigen::Vector3d(0, 2, 0)), 9 + 16.0 / 5, 1e-12);
  // One without bounds leaves nothing of y.
  EXPECT_NEAR(information(shift, Eigen::Vector3d(0, 1e6, 0)), 9, 1e-6);
}

TEST(Likeness, IsTheAngleBeyondTheNuisances) {
  const Eigen::MatrixXd none(3, 0);
  const Eigen::Vector3d x(1, 0, 0), diagonal(1, 1, 0);
  EXPECT_NEAR(likeness(x, diagonal, none), std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(likeness(x, -2 * x, none), -1, 1e-12);
  // Where y may be anything, both say the same.
  EXPECT_NEAR(likeness(x, diagonal, Eigen::Vector3d(0, 1e6, 0)), 1, 1e-6);
  EXPECT_EQ(likeness(x, Eigen::Vector3d::Zero(), none), 0);
}

TEST(Power, RisesFromTheLevelAndInverts) {
  EXPECT_NEAR(chance_of_exceeding(3.841, 1, 0), 0.05, 1e-4);
  // One degree of freedom is a shifted normal: P(|Z + m| > t).
  const auto normal = [](double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); };
  EXPECT_NEAR(chance_of_exceeding(9, 1, 16), normal(4 - 3) + normal(-4 - 3), 1e-9);
  for (const double power : {0.5, 0.9, 0.99}) {
    EXPECT_NEAR(chance_of_exceeding(20, 2, noncentrality_for(power, 20, 2)), power, 1e-6);
  }
  EXPECT_EQ(noncentrality_for(0.01, 3.841, 1), 0);
}

}  // namespace gapfarm::plan::selection_test
