// Floors and loads under robots on plain wheels, driven by the simulation itself: what changed is
// named by the kinematics' rows, and nothing is named where nothing changed.
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "common/random/stream.h"
#include "common/robot/robot.h"
#include "master/ground/diagnose_ground.h"
#include "worker/sim/robot/ground.h"

namespace gapfarm {
namespace {

constexpr const char* kTwoWheels = R"(drive = "differential"
commands = ["left", "right"]
wheel_separation = 0.3
mass = 8.0
lag = 0.15
[wheels.left]
radius = 0.05
x = 0.0
y = 0.15
[wheels.right]
radius = 0.05
x = 0.0
y = -0.15
[wheels.caster]
kind = "caster"
radius = 0.02
x = -0.15
y = 0.0
)";
constexpr const char* kFourWheels = R"(drive = "skid"
commands = ["left", "right"]
wheel_separation = 0.4
wheelbase = 0.3
mass = 12.0
lag = 0.15
[wheels.left]
radius = 0.1
[wheels.right]
radius = 0.1
)";
constexpr const char* kThreeWheels = R"(drive = "tricycle"
commands = ["speed", "steering"]
wheelbase = 0.4
wheel_separation = 0.3
wheel_radius = 0.05
mass = 10.0
lag = 0.15
)";
struct Change {
  double friction = 0.7, ratio = 1, caster_drag = 0.02;
  double ahead_m = 0, left_m = 0;
};

GroundRobot robot_from(const char* text) {
  auto robot = parse_robot(text, "robot.toml");
  EXPECT_TRUE(robot.ok()) << robot.error().message;
  EXPECT_TRUE(complete_robot(&*robot).ok());
  return *robot;
}

RunLog simulated(GroundRobot robot, const Change& at, std::uint64_t seed, double fast) {
  Stream stream({seed, Purpose::kTest, 0, 0, 0});
  RunLog log;
  log.channels = robot.channels;
  robot.friction = at.friction;
  robot.friction_ratio = at.ratio;
  robot.caster_drag = at.caster_drag;
  *robot.com_x_m += at.ahead_m;
  *robot.com_y_m += at.left_m;
  GroundWorld world;
  world.creep = 0.02;
  for (int r = 0; r < 8; ++r) {
    LoggedRun run;
    run.run = std::to_string(r);
    for (int i = 0; i < 15; ++i) {
      CommandRow row{1.0 * i, {}};
      if (robot.channels[0] == "speed") {
        row.values = {fast * (4 + 4 * stream.uniform()), 0.8 * (stream.uniform() - 0.5)};
      } else {
        const double v = fast * (3 + 4 * stream.uniform()), w = fast * 6 * (stream.uniform() - 0.5);
        row.values = {v - w, v + w};
      }
      run.commands.push_back(row);
    }
    std::vector<double> times;
    for (int i = 0; i <= 300; ++i) times.push_back(0.05 * i);
    GroundSimulator simulator(robot, world);
    const Pose X_WS{stream.uniform(), stream.uniform(), 6 * stream.uniform()};
    for (const GroundSample& s : simulator.run(run.commands, {}, times).samples) {
      const Pose X = X_WS * s.X_SR * robot.X_RM;
      run.poses.push_back({s.t_s,
                           {X.x + 5e-4 * stream.normal(), X.y + 5e-4 * stream.normal(),
                            wrap_angle(X.theta + 1e-3 * stream.normal())}});
    }
    log.runs.push_back(std::move(run));
  }
  return log;
}

// What changed between two logs of a robot, the second with other commands.
Diagnosis changed(const char* text, double fast, const Change& change, std::uint64_t seed = 2) {
  const GroundRobot file = robot_from(text);
  GroundDiagnoseOptions options;
  options.reference = simulated(file, {}, seed + 100, fast);
  auto found = diagnose_ground(file, simulated(file, change, seed, fast), options);
  EXPECT_TRUE(found.ok()) << found.error().message;
  return found.ok() ? std::move(found->diagnosis) : Diagnosis{};
}

TEST(SimulatedFloors, NothingIsNamedWhereNothingChanged) {
  for (const auto& [text, fast] :
       {std::pair{kTwoWheels, 1.0}, std::pair{kFourWheels, 0.6}, std::pair{kThreeWheels, 3.0}}) {
    const Diagnosis same = changed(text, fast, {}, 5);
    EXPECT_TRUE(same.effects.empty()) << same.headline;
    EXPECT_EQ(same.verdict, Verdict::kNone) << same.headline;
  }
}

// Wheels that are not asked for more than the floor holds roll as before: grip that is not used up
// moves no end, and no name is given to it.
TEST(SimulatedFloors, GripThatIsNotUsedUpIsNoChange) {
  Change less;
  less.friction = 0.4;
  const Diagnosis same = changed(kTwoWheels, 1, less);
  EXPECT_TRUE(same.effects.empty()) << same.headline;
}

TEST(SimulatedFloors, AFloorThatHoldsSkiddingWheelsLessIsNamed) {
  Change smooth;
  smooth.ratio = 0.6;
  const Diagnosis found = changed(kFourWheels, 0.6, smooth);
  ASSERT_EQ(found.effects.size(), 1u) << found.headline;
  const NamedEffect& effect = found.effects.front();
  EXPECT_EQ(effect.name, "friction_across") << found.headline;
  // Four-point theory: 1 + (ratio 0.3 / 0.4)^2, from 1.5625 to 1.2025.
  EXPECT_NEAR(effect.parameters.back().value, 1.2025 - 1.5625, 0.04);
}

TEST(SimulatedFloors, ACasterThatDragsMoreIsAFloor) {
  Change rough;
  rough.caster_drag = 0.6;
  const Diagnosis found = changed(kTwoWheels, 1, rough);
  ASSERT_EQ(found.effects.size(), 1u) << found.headline;
  EXPECT_EQ(found.effects.front().name, "floor") << found.headline;
  EXPECT_LT(found.effects.front().parameters.at(0).hi, 0);
}

TEST(SimulatedFloors, ALoadToOneSideOfSkiddingWheelsIsNamedAsOne) {
  Change aside, ahead;
  aside.left_m = 0.05;
  ahead.ahead_m = 0.05;
  const Diagnosis left = changed(kFourWheels, 0.6, aside);
  ASSERT_EQ(left.effects.size(), 1u) << left.headline;
  EXPECT_EQ(left.effects.front().name, "com_offset") << left.headline;
  EXPECT_GT(left.effects.front().parameters.at(1).lo, 0.03) << left.headline;
  const Diagnosis front = changed(kFourWheels, 0.6, ahead);
  ASSERT_FALSE(front.effects.empty());
  EXPECT_EQ(front.effects.front().name, "com_offset") << front.headline;
}

}  // namespace
}  // namespace gapfarm
