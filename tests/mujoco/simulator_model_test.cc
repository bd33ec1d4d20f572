// The exported model against closed forms of a robot on two wheels.
#include "master/ground/report/simulator_model.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>

#include "common/robot/robot.h"

namespace gapfarm::simulator_model_test {
namespace {

constexpr const char* kRobot = R"(drive = "skid"
name = "two -- sided"
commands = ["v", "omega"]
wheel_separation = 0.4
wheel_radius = 0.1
wheel_separation_multiplier = 1.5
lag = 0.1
mass = 12
[wheels.left]
radius = 0.098
[wheels.right]
radius = 0.1
[marker]
x = -0.05
yaw = 0.1
)";

struct End {
  double x = 0, y = 0, theta = 0;
};

// The marker after a second of these wheel speeds, from rest, by scene.xml.
End drive(const GroundRobot& robot, double left_rad_s, double right_rad_s) {
  const std::filesystem::path folder(testing::TempDir() + "/simulator_model");
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "robot.xml") << mujoco_model(robot, robot, "a -- b");
  std::ofstream(folder / "scene.xml") << mujoco_scene();
  char error[500] = "";
  const std::unique_ptr<mjModel, decltype(&mj_deleteModel)> alone(
      mj_loadXML((folder / "robot.xml").c_str(), nullptr, error, sizeof error), mj_deleteModel);
  EXPECT_NE(alone, nullptr) << error;
  const std::unique_ptr<mjModel, decltype(&mj_deleteModel)> model(
      mj_loadXML((folder / "scene.xml").c_str(), nullptr, error, sizeof error), mj_deleteModel);
  if (model == nullptr) {
    ADD_FAILURE() << error;
    return {};
  }
  const std::unique_ptr<mjData, decltype(&mj_deleteData)> data(mj_makeData(model.get()),
                                                               mj_deleteData);
  EXPECT_NEAR(mj_getTotalmass(model.get()), 12, 1e-6);
  for (; data->time < 1.3; mj_step(model.get(), data.get())) {
    data->ctrl[0] = data->time < 0.3 ? 0 : left_rad_s;
    data->ctrl[1] = data->time < 0.3 ? 0 : right_rad_s;
  }
  mj_kinematics(model.get(), data.get());
  return {data->site_xpos[0], data->site_xpos[1],
          std::atan2(data->site_xmat[3], data->site_xmat[0])};
}

TEST(SimulatorModel, RollsByItsSizes) {
  const auto robot = parse_robot(kRobot, "robot.toml");
  ASSERT_TRUE(robot.ok()) << robot.error().message;
  // A lag of 0.1 s loses as much of the second's way, but for e^-10 of it.
  const double lasting = 0.9;
  const End ahead = drive(*robot, 5 / 0.98, 5);
  EXPECT_NEAR(ahead.x + 0.05, 0.5 * lasting, 0.006);
  EXPECT_NEAR(ahead.theta, 0.1, 0.003);
  const End turn = drive(*robot, -2 / 0.98, 2);
  EXPECT_NEAR(turn.theta, 0.1 + 0.4 / 0.6 * lasting, 0.01);
  EXPECT_NEAR(turn.x, -0.05 * std::cos(0.6), 0.002);
  EXPECT_NEAR(turn.y, -0.05 * std::sin(0.6), 0.002);
}

}  // namespace
}  // namespace gapfarm::simulator_model_test
