// What no hypothesis is of: something is wrong, but nothing has its name.
#include <algorithm>
#include <cmath>

#include "master/ground/diagnose_ground.h"
#include "tests/unit/ground/driven_log.h"

namespace gapfarm {
namespace {

struct Outside {
  const char* what;
  double (*motor)(double command);  // rad/s, of 1 to 9
  bool names_nothing;               // else its mean may have the name of a size
};

class OutsideCatalogue : public testing::TestWithParam<Outside> {};

TEST_P(OutsideCatalogue, IsUnknownAndSaysWhatItDependsOn) {
  const GroundRobot robot = robot_of(kDifferential);
  const Kinematics as_filed = off_by({"left", "right", "separation", "lag", "marker_x", "marker_y"},
                                     {1, 1, 1, 0.1, 0.02, 0.01});
  const auto found =
      diagnose_ground(robot, driven(robot, as_filed, 0, 1, GetParam().motor, 45), {});
  ASSERT_TRUE(found) << found.error().message;
  const Diagnosis& d = found->diagnosis;
  EXPECT_EQ(d.verdict, d.effects.empty() ? Verdict::kUnknown : Verdict::kEffectAndUnknown);
  if (GetParam().names_nothing) {
    EXPECT_TRUE(d.effects.empty()) << d.headline;
  }
  ASSERT_FALSE(d.findings.empty());
  EXPECT_NE(d.findings.front().find("a correction by"), std::string::npos) << d.findings.front();
  EXPECT_NE(d.findings.front().find("speeds"), std::string::npos) << d.findings.front();
  // What the report's pictures are drawn against at first.
  ASSERT_FALSE(d.where.empty());
  EXPECT_NE(d.where.front().covariate.find("side's speed"), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(
    Motors, OutsideCatalogue,
    testing::Values(Outside{"limit", [](double c) { return std::min(c, 6.0); }, true},
                    Outside{"threshold", [](double c) { return std::abs(c) < 3 ? 0 : c; }, false}),
    [](const auto& of) { return std::string(of.param.what); });

// Nor is a correction that closes more than is tolerated kept from the verdict because the log is
// not sure that it does.
TEST(OutsideTheCatalogue, WhatACorrectionMayCloseIsLeft) {
  const GroundRobot robot = robot_of(kDifferential);
  const Kinematics as_filed = off_by({"left", "right", "separation", "lag", "marker_x", "marker_y"},
                                     {1, 1, 1, 0.1, 0.02, 0.01});
  const auto limited = [](double c) { return std::min(c, 8.6); };
  const auto found = diagnose_ground(robot, driven(robot, as_filed, 1, 1, limited, 45), {});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->diagnosis.verdict, Verdict::kEffectAndUnknown) << found->diagnosis.headline;
}

// Neither a value nor a correction foresees which commands were lost.
TEST(OutsideTheCatalogue, CommandsThatDoNotArriveAreSomething) {
  const GroundRobot robot = robot_of(kDifferential);
  const Kinematics as_filed = off_by({"left", "right", "separation", "lag", "marker_x", "marker_y"},
                                     {1, 1, 1, 0.1, 0.02, 0.01});
  int sides = 0;
  const auto lossy = [&](double c) { return (sides++ / 2) % 12 == 5 ? 0 : c; };
  const auto found = diagnose_ground(robot, driven(robot, as_filed, 0, 1, lossy, 45), {});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->diagnosis.verdict, Verdict::kUnknown) << found->diagnosis.headline;
  EXPECT_NE(found->diagnosis.headline.find("comes and goes"), std::string::npos)
      << found->diagnosis.headline;
}

// Its poses scatter, so that it is no run whose poses never change.
TEST(OutsideTheCatalogue, ARobotThatHardlyMovesKeepsItsFile) {
  const GroundRobot robot = robot_of(kDifferential);
  RunLog log = driven(robot, {}, 0, 1, [](double) { return 0.0; });
  Stream stream({3, Purpose::kTest, 0, 0, 0});
  for (LoggedRun& run : log.runs) {
    for (PoseRow& row : run.poses) row.X_WM = row.X_WM * Pose{2e-3 * stream.normal(), 0, 0};
  }
  const auto found = diagnose_ground(robot, log, {});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->diagnosis.verdict, Verdict::kUnknown);
  EXPECT_NE(found->diagnosis.headline.find("hardly moved"), std::string::npos)
      << found->diagnosis.headline;
  for (const ReportedValue& value : found->values) EXPECT_FALSE(value.named) << value.name;
  EXPECT_EQ(format_robot(found->corrected), format_robot(robot));
}

}  // namespace
}  // namespace gapfarm
