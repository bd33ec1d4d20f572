// Slopes on one side of a point and on both, of formulas.
#include <gtest/gtest.h>

#include <cmath>

#include "common/parameters/table.h"
#include "master/infer/fit.h"

namespace gapfarm::infer {
namespace {

constexpr std::size_t kPoints = 12;
constexpr double kBent_m = 0.004;  // offset at which ends are farthest back

std::size_t offset_row() { return push_table().row("com_offset.x"); }

// Ends lie on a parabola of the offset.
Result<std::vector<std::optional<std::vector<Pose>>>> bent(
    const std::vector<PredictionRequest>& points) {
  std::vector<std::optional<std::vector<Pose>>> all;
  for (const PredictionRequest& point : points) {
    const double from = (point.at.at(offset_row()) - kBent_m) / 0.003;
    std::vector<Pose>& ends = all.emplace_back().emplace();
    for (std::size_t i = 0; i < kPoints; ++i) {
      ends.push_back({from * from * std::cos(static_cast<double>(i)), 0, 0});
    }
  }
  return all;
}

double slope_at(double offset_m, Sides sides) {
  Observations o;
  for (std::size_t i = 0; i < kPoints; ++i) {
    o.measured.push_back({});
    o.whitener.push_back(Eigen::Matrix3d::Identity());
    o.fold.push_back(0);
  }
  Coordinate c;
  c.row = offset_row();
  c.size = 0.003;
  const Space space(push_table(), {c});
  const Forward forward = bent;
  const Fitter fitter(forward, o, space, nullptr, sides);
  Fit fit = fitter.start(space.from({{offset_row(), offset_m}})).value();
  EXPECT_TRUE(fitter.differentiate(&fit));
  return -fit.slopes(0, 0);  // residuals are measured less predicted
}

TEST(InferSides, OfBothABendIsNoSlope) {
  EXPECT_NEAR(slope_at(kBent_m, Sides::kBoth), 0, 1e-9);
  EXPECT_GT(std::abs(slope_at(kBent_m, Sides::kOne)), 0.1);
  EXPECT_NEAR(slope_at(kBent_m + 0.006, Sides::kBoth), 4, 1e-9);
}

TEST(InferSides, AtABoundOneSideServes) {
  const double most = push_table()[offset_row()].upper;
  EXPECT_NEAR(slope_at(most, Sides::kBoth), slope_at(most, Sides::kOne), 1e-12);
}

}  // namespace
}  // namespace gapfarm::infer
