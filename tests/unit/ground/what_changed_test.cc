#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "master/ground/diagnose_ground.h"
#include "master/ground/tolerances.h"
#include "tests/unit/ground/driven_log.h"

namespace gapfarm {
namespace {

constexpr const char* kSkid = R"(drive = "skid"
commands = ["left", "right"]
wheel_separation = 0.5
wheel_separation_multiplier = 1.6
[wheels.left]
radius = 0.1
[wheels.right]
radius = 0.1
)";

GroundDiagnosis changed(const GroundRobot& robot, const RunLog& before, const RunLog& after) {
  GroundDiagnoseOptions options;
  options.reference = before;
  auto result = diagnose_ground(robot, after, options);
  EXPECT_TRUE(result.ok()) << result.error().message;
  return *std::move(result);
}

// Poses of a worse tracker.
RunLog shaken(RunLog log, double noise_m) {
  Stream stream({11, Purpose::kTest, 0, 0, 0});
  for (LoggedRun& run : log.runs) {
    for (PoseRow& pose : run.poses) {
      pose.X_WM.x += noise_m * stream.normal();
      pose.X_WM.y += noise_m * stream.normal();
    }
  }
  return log;
}

// A file that is off in several things: of what changed it says nothing.
Kinematics cars_own(double grip_m_s2, double steering_offset_rad = 0.02) {
  return off_by({"grip", "slip_angle", "steering_gain", "steering_offset", "delay"},
                {std::log(grip_m_s2), 0.17, 1.1, steering_offset_rad, 0.1});
}

TEST(WhatChanged, ReportsNothingOfAFileThatIsWrongWhereNothingChanged) {
  const GroundRobot car = robot_of(kCar);
  const GroundDiagnosis same = changed(car, driven(car, cars_own(7)), driven(car, cars_own(7), 5));
  EXPECT_TRUE(same.diagnosis.effects.empty()) << same.diagnosis.headline;
  EXPECT_EQ(same.diagnosis.verdict, Verdict::kNone);
  EXPECT_NE(same.diagnosis.headline.find("Nothing changed"), std::string::npos);
  const GroundRobot skid = robot_of(kSkid);
  const Kinematics off = off_by({"left", "separation"}, {0.9, 1.15});
  const GroundDiagnosis again = changed(skid, driven(skid, off), driven(skid, off, 5));
  EXPECT_TRUE(again.diagnosis.effects.empty()) << again.diagnosis.headline;
}

// Three of its tolerances for the whole log are hardly more than a clock loses; in every window
// they are most of what it misses by.
TEST(WhatChanged, NamesADelayThatClosesTheGap) {
  const GroundRobot robot = robot_of(kDifferential);
  const GroundDiagnosis later =
      changed(robot, driven(robot, off_by({"delay"}, {0.05})),
              driven(robot, off_by({"delay"}, {0.05 + 3.2 * kDelay_s}), 5));
  ASSERT_EQ(later.diagnosis.effects.size(), 1u) << later.diagnosis.headline;
  EXPECT_EQ(later.diagnosis.effects.front().name, "command_delay");
  EXPECT_NEAR(later.diagnosis.effects.front().parameters.at(0).value, 3.2 * kDelay_s, 2e-3);
}

TEST(WhatChanged, ReportsAnotherFloorFromOtherSteering) {
  const GroundRobot car = robot_of(kCar);
  const RunLog before = driven(car, cars_own(7));
  const GroundDiagnosis floor = changed(car, before, driven(car, cars_own(7 * 0.6), 5, 1, {}, 20));
  ASSERT_EQ(floor.diagnosis.effects.size(), 1u) << floor.diagnosis.headline;
  const NamedEffect& friction = floor.diagnosis.effects.front();
  EXPECT_EQ(friction.name, "friction");
  ASSERT_FALSE(friction.parameters.empty());
  EXPECT_NEAR(friction.parameters[0].value, -0.4, 0.03);
  EXPECT_LT(friction.parameters[0].lo, -0.38);
  EXPECT_GT(friction.parameters[0].hi, -0.42);
  EXPECT_NE(floor.diagnosis.headline.find("fell by"), std::string::npos);
  EXPECT_NE(floor.diagnosis.headline.find("nothing else"), std::string::npos)
      << floor.diagnosis.headline << floor.diagnosis.findings.front();
  EXPECT_NEAR(floor.corrected.friction, 7 * 0.6 / 9.81, 0.05);
  const GroundDiagnosis bent = changed(car, before, driven(car, cars_own(7, 0.05), 5));
  ASSERT_EQ(bent.diagnosis.effects.size(), 1u) << bent.diagnosis.headline;
  EXPECT_EQ(bent.diagnosis.effects.front().name, "steering_offset");
  EXPECT_NEAR(bent.diagnosis.effects.front().parameters.at(0).value, 0.03, 0.003);
}

// Tyres that hold up to their limit and then let go at once: on a floor where they never slipped
// nobody knows that, and on the next one it is not to be taken for steering.
TEST(WhatChanged, LeavesHowTyresLetGoToTheTyres) {
  const GroundRobot car = robot_of(kCar);
  const auto sharp = [](double grip_m_s2) {
    return off_by({"grip", "slip_angle", "grip_shape", "steering_gain"},
                  {std::log(grip_m_s2), 0.1, std::log(8.0), 1.1});
  };
  const GroundDiagnosis floor = changed(car, driven(car, sharp(12)), driven(car, sharp(4), 5));
  ASSERT_EQ(floor.diagnosis.effects.size(), 1u) << floor.diagnosis.headline;
  EXPECT_EQ(floor.diagnosis.effects.front().name, "friction");
  EXPECT_NEAR(floor.corrected.friction, 4 / 9.81, 0.03);
}

// Understeer that grows with speed whatever the curvature: a log of slow driving shows it, and a
// fast one on the same floor is neither another floor nor other steering.
TEST(WhatChanged, ReportsNothingWhereOnlyTheSpeedIsAnother) {
  const GroundRobot car = robot_of(kCar);
  const Kinematics own = off_by({"understeer", "grip", "slip_angle"}, {0.1, std::log(60.0), 0.17});
  const GroundDiagnosis same = changed(car, driven(car, own, 0, 0.7), driven(car, own, 5, 1.4));
  EXPECT_TRUE(same.diagnosis.effects.empty()) << same.diagnosis.headline;
  EXPECT_EQ(same.diagnosis.verdict, Verdict::kNone) << same.diagnosis.findings.back();
}

// What no row of the file says and both logs show is the robot's own.
// A car that is weaker to the left by so much.
Kinematics weaker(double to_the_left) {
  return off_by({"grip", "slip_angle", "steering_left"}, {std::log(7.0), 0.17, to_the_left});
}

TEST(WhatChanged, IsNamedBesideWhatBothLogsShow) {
  const GroundRobot car = robot_of(kCar);
  const GroundDiagnosis bent = changed(car, driven(car, weaker(0.8)), driven(car, weaker(0.6), 5));
  ASSERT_FALSE(bent.diagnosis.effects.empty());
  EXPECT_EQ(bent.diagnosis.effects.front().name, "steering_asymmetry") << bent.diagnosis.headline;
  EXPECT_NEAR(bent.diagnosis.effects.front().parameters.at(0).value, -0.2, 0.03);
}

TEST(WhatChanged, ReportsNothingOfWhatBothLogsShow) {
  const GroundRobot car = robot_of(kCar);
  const GroundDiagnosis same = changed(car, driven(car, weaker(0.8)), driven(car, weaker(0.8), 5));
  EXPECT_TRUE(same.diagnosis.effects.empty()) << same.diagnosis.headline;
  const GroundRobot differential = robot_of(kDifferential);
  const Kinematics sagging = off_by({"sag"}, {0.05});
  const GroundDiagnosis tired =
      changed(differential, driven(differential, sagging), driven(differential, sagging, 5));
  EXPECT_TRUE(tired.diagnosis.effects.empty()) << tired.diagnosis.headline;
}

// A long log is sure of a difference that next to nothing depends on.
TEST(WhatChanged, ReportsNothingOfWhatMovesNoEnd) {
  const GroundRobot skid = robot_of(kSkid);
  const auto with_lag = [](double lag_s) { return off_by({"lag"}, {lag_s}); };
  const RunLog noisy = shaken(driven(skid, with_lag(0.1)), 0.03);
  const GroundDiagnosis same = changed(skid, noisy, shaken(driven(skid, with_lag(0.16), 5), 0.03));
  EXPECT_TRUE(same.diagnosis.effects.empty()) << same.diagnosis.headline;
}

// A value that moves by more than it does from log to log is no nothing, named or not.
TEST(WhatChanged, ReportsNotNothingWhereAFarMoveClosesTheGap) {
  const GroundRobot robot = robot_of(kDifferential);
  const auto with_lag = [](double lag_s) { return off_by({"lag"}, {lag_s}); };
  const Diagnosis found =
      changed(robot, driven(robot, with_lag(0.1)), driven(robot, with_lag(0.2), 5)).diagnosis;
  EXPECT_GT(found.gap.tuned, kToleratedGap);
  EXPECT_NE(found.verdict, Verdict::kNone) << found.headline;
}

TEST(WhatChanged, GivesASkidSteersMultiplierBeforeAndAfter) {
  const GroundRobot skid = robot_of(kSkid);
  const GroundDiagnosis found =
      changed(skid, driven(skid, off_by({"left", "separation"}, {0.9, 1.0})),
              driven(skid, off_by({"left", "separation"}, {0.9, 1.1}), 5));
  ASSERT_EQ(found.diagnosis.effects.size(), 1u) << found.diagnosis.headline;
  const NamedEffect& effect = found.diagnosis.effects.front();
  EXPECT_EQ(effect.name, "friction_across");
  EXPECT_NEAR(effect.parameters.at(0).value, 0.1, 0.01);
  EXPECT_NE(effect.text.find("from 1.6 to 1.7"), std::string::npos) << effect.text;
  EXPECT_NEAR(found.corrected.controller.wheel_separation_multiplier, 1.76, 0.02);
}

// One side's wheels and the distance between the sides: neither stands for the other.
TEST(WhatChanged, NamesTwoChanges) {
  const GroundRobot robot = robot_of(kDifferential);
  const Diagnosis found = changed(robot, driven(robot, off_by({"separation"}, {1.1})),
                                  driven(robot, off_by({"left"}, {1.05}), 5))
                              .diagnosis;
  ASSERT_EQ(found.effects.size(), 2u) << found.headline;
  EXPECT_EQ(found.verdict, Verdict::kEffect);
  const bool first = found.effects.front().name == "wheel_radius";
  EXPECT_NEAR(found.effects[first ? 0 : 1].parameters.at(0).value, 0.05, 0.01);
  EXPECT_NEAR(found.effects[first ? 1 : 0].parameters.at(0).value, -0.1, 0.01);
}

// Straight drives know nothing of the distance between the sides: that the file has another one is
// no change.
TEST(WhatChanged, SaysWhatTheReferenceDoesNotShow) {
  const GroundRobot robot = robot_of(kDifferential);
  const Kinematics truly = off_by({"separation"}, {1.1});
  RunLog straight = driven(robot, truly, 0, 1, [](double) { return 5; });
  for (LoggedRun& run : straight.runs) {
    for (CommandRow& row : run.commands) row.values = {5, 5};
  }
  const Diagnosis found = changed(robot, straight, driven(robot, truly, 5)).diagnosis;
  ASSERT_EQ(found.effects.size(), 1u) << found.headline;
  EXPECT_EQ(found.headline.find("rose"), std::string::npos) << found.headline;
  EXPECT_NE(found.headline.find("The reference does not show it"), std::string::npos)
      << found.headline;
}

TEST(WhatChanged, RefusesAReferenceThatIsTheWrongWayRound) {
  const GroundRobot skid = robot_of(kSkid);
  RunLog before = driven(skid, {});
  for (LoggedRun& run : before.runs) {
    for (CommandRow& row : run.commands) std::swap(row.values[0], row.values[1]);
  }
  GroundDiagnoseOptions options;
  options.reference = before;
  const auto result = diagnose_ground(skid, driven(skid, {}, 5), options);
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().message.find("left and right"), std::string::npos);
}

// Remembers fits, and counts those that were made.
class Memo : public FitMemo {
 public:
  std::optional<KeptFit> find(const std::string& key) override {
    const auto found = kept.find(key);
    return found == kept.end() ? std::nullopt : std::optional(found->second);
  }
  void keep(const std::string& key, const KeptFit& fit) override { kept[key] = fit; }
  std::map<std::string, KeptFit> kept;
};

TEST(WhatChanged, GoesOnFromTheFitsOfADiagnosisThatWasStopped) {
  const GroundRobot robot = robot_of(kDifferential);
  const RunLog log = driven(robot, off_by({"right"}, {0.96}));
  Memo memo;
  GroundDiagnoseOptions options;
  options.memo = &memo;
  int asked = 0;
  options.stopped = [&] { return ++asked > 30; };
  const auto stopped = diagnose_ground(robot, log, options);
  ASSERT_FALSE(stopped.ok());
  const std::size_t before = memo.kept.size();
  EXPECT_GT(before, 1u);
  options.stopped = {};
  const auto on = diagnose_ground(robot, log, options);
  ASSERT_TRUE(on.ok());
  EXPECT_GT(memo.kept.size(), before);
  options.memo = nullptr;
  const auto fresh = diagnose_ground(robot, log, options);
  ASSERT_TRUE(fresh.ok());
  EXPECT_EQ(on->diagnosis.headline, fresh->diagnosis.headline);
  EXPECT_EQ(on->diagnosis.gap.tuned, fresh->diagnosis.gap.tuned);
  EXPECT_EQ(on->diagnosis.effects.front().parameters[0].lo,
            fresh->diagnosis.effects.front().parameters[0].lo);
}

}  // namespace
}  // namespace gapfarm
