#include "common/residual/field.h"

#include <gtest/gtest.h>

#include "tests/unit/residual/fields.h"

namespace gapfarm {
namespace {

using tests::heading_term;
using tests::place_term;

LoggedMotion drive(const Pose& X_WS) {
  LoggedMotion facts;
  facts.command = "forward";
  facts.left = facts.right = 0.5;
  facts.duration_s = 2;
  facts.X_WS = X_WS;
  return facts;
}

TEST(ResidualField, IsASumOfBumpsTimesTheDrive) {
  const LoggedMotion facts = drive({1, 2, 0});
  ResidualTerm term = heading_term();
  const auto bump = [](double away) {
    const double d = 2 * std::sin(away / 2) / 0.7;
    return std::exp(-d * d / 2);
  };
  const double side = bump(2);
  const Eigen::Vector3d by_hand = side * Eigen::Vector3d(0.01, -0.002, 0.03) +
                                  Eigen::Vector3d(0, 0.004, 0) +
                                  side * Eigen::Vector3d(-0.005, 0, 0.02);
  EXPECT_TRUE(residual_shift({term}, facts, {1.3, 2, 0.4}).isApprox(by_hand, 1e-12));
  term.by_drive = false;  // a second at full duty: the same
  EXPECT_TRUE(residual_shift({term}, facts, {1.3, 2, 0.4}).isApprox(by_hand, 1e-12));
}

TEST(ResidualField, HeadingsGoRound) {
  const ResidualField field = {heading_term()};
  for (const double heading : {-3.0, -1.0, 0.5, 3.1}) {
    const Pose end{1, 1, 0.2};
    const Eigen::Vector3d here = residual_shift(field, drive({1, 1, heading}), end);
    const Eigen::Vector3d round =
        residual_shift(field, drive({1, 1, heading + 2 * std::numbers::pi}), end);
    EXPECT_TRUE(here.isApprox(round, 1e-9)) << heading;
  }
}

TEST(ResidualField, CommandsWithoutWeightsAreLeftAlone) {
  LoggedMotion facts = drive({0, 0, 1});
  facts.command = "backward";
  EXPECT_TRUE(residual_shift({heading_term()}, facts, {0, 0, 1}).isZero(0));
  EXPECT_EQ(corrected_end({}, facts, {1, 2, 3}), (Pose{1, 2, 3}));
}

// In the world's frame the shift does not turn with the robot; in the robot's it does.
TEST(ResidualField, FramesReportWhatTurns) {
  const LoggedMotion facts = drive({0.3, 0.3, 0});
  for (const double heading : {0.0, 1.0, -2.5}) {
    const Pose end{0.5, 0.4, heading};
    const Pose still = corrected_end({place_term(ResidualFrame::kWorld)}, facts, end);
    const Pose at_rest =
        corrected_end({place_term(ResidualFrame::kWorld)}, facts, Pose{0.5, 0.4, 0});
    EXPECT_NEAR(still.x, at_rest.x, 1e-12);
    EXPECT_NEAR(still.y, at_rest.y, 1e-12);
    const Pose own = corrected_end({place_term(ResidualFrame::kRobot)}, facts, end);
    const Eigen::Vector3d shift =
        residual_shift({place_term(ResidualFrame::kRobot)}, facts, Pose{0.5, 0.4, 0});
    EXPECT_TRUE(local_difference(end, own).isApprox(shift, 1e-9));
  }
}

// Shifted readings: a chain of drives ends where its first and last readings say, however it got
// there.
TEST(ResidualField, ShiftsOfReadingsAddUpAlongAChain) {
  const ResidualField field = {place_term(ResidualFrame::kReadings)};
  const Pose a{0.1, 0.2, 0.3}, b{0.6, 0.5, 1.2}, c{1.1, 0.4, -2};
  const auto moved = [&](const Pose& from, const Pose& to) -> Eigen::Vector2d {
    const Pose end = corrected_end(field, drive(from), to);
    return {end.x - to.x, end.y - to.y};
  };
  EXPECT_TRUE((moved(a, b) + moved(b, c)).isApprox(moved(a, c), 1e-9));
  EXPECT_TRUE(moved(a, a).isZero(1e-12));
}

}  // namespace
}  // namespace gapfarm
