#include "master/diagnose/places/patch_moves.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/random/stream.h"

namespace gapfarm {
namespace {

constexpr PatchStep kStep = {0.02, 0.2};
constexpr Eigen::Index kRows = 300;

// Marks that are linear in place, radius and log ratio, but for `stair`: rows that jump by one in
// every width, as the marks of single drives do where a contact comes to lie on the rim.
class Discs {
 public:
  explicit Discs(double stair) : stair_(stair), stream_({.run_seed = 3}) {
    slopes_.resize(kRows, 4);
    for (Eigen::Index i = 0; i < kRows; ++i) {
      for (Eigen::Index j = 0; j < 4; ++j) slopes_(i, j) = stream_.normal();
    }
  }

  MarkedDisc at(const Patch& patch) const {
    const Eigen::Vector4d u(patch[0] / kStep.length_m, patch[1] / kStep.length_m,
                            patch[2] / kStep.length_m, std::log(patch[3]) / kStep.log_ratio);
    Eigen::VectorXd mark = slopes_ * u;
    if (stair_ > 0) {
      for (double& m : mark) m = stair_ * std::round(m / stair_);
    }
    return {patch, mark};
  }

  std::vector<MarkedDisc> spread_about(const Patch& patch, int count) {
    std::vector<MarkedDisc> discs;
    for (int k = 0; k < count; ++k) {
      Patch to = patch;
      for (std::size_t c = 0; c < 3; ++c) to[c] += kStep.length_m * stream_.normal();
      to[3] *= std::exp(kStep.log_ratio * stream_.normal());
      discs.push_back(at(to));
    }
    return discs;
  }

 private:
  double stair_;
  Stream stream_;
  Eigen::MatrixXd slopes_;
};

constexpr Patch kFrom = {0.8, 0.9, 0.2, 0.4};
constexpr Patch kTrue = {0.78, 0.91, 0.19, 0.35};

double steps_apart(const Patch& a, const Patch& b) {
  const double place = std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) / kStep.length_m;
  return std::hypot(place, std::log(a[3] / b[3]) / kStep.log_ratio);
}

// The share of the way to the true disc that is left.
double share_left(double stair) {
  Discs discs(stair);
  const auto near = discs.spread_about(kFrom, 24);
  const auto to = linear_best(discs.at(kFrom), near, discs.at(kTrue).mark, kStep);
  return to ? steps_apart(*to, kTrue) / steps_apart(kFrom, kTrue) : 1;
}

TEST(PatchMoves, LeadToWhatExplainsMost) { EXPECT_LT(share_left(0), 0.25); }

// A difference of two near discs would be zero or a jump.
TEST(PatchMoves, SeeTheSlopeOfAStair) { EXPECT_LT(share_left(2), 0.5); }

TEST(PatchMoves, GoNoFartherThanTwoSteps) {
  Discs discs(0);
  const auto near = discs.spread_about(kFrom, 24);
  const auto to = linear_best(discs.at(kFrom), near, discs.at({0.3, 0.9, 0.2, 0.4}).mark, kStep);
  ASSERT_TRUE(to);
  EXPECT_NEAR((*to)[0], kFrom[0] - 2 * kStep.length_m, 1e-9);
}

TEST(PatchMoves, NeedEnoughDiscsNearBy) {
  Discs discs(0);
  const Eigen::VectorXd left = discs.at(kTrue).mark;
  EXPECT_FALSE(linear_best(discs.at(kFrom), discs.spread_about(kFrom, 3), left, kStep));
  EXPECT_FALSE(
      linear_best(discs.at(kFrom), discs.spread_about({0.2, 0.2, 0.2, 2}, 24), left, kStep));
}

}  // namespace
}  // namespace gapfarm
