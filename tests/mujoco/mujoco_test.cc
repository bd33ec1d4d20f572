// The robot in MuJoCo against closed forms, and a log of its by the program's own check.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <string>

#include "common/trials/files.h"
#include "tests/integration/run_program.h"
#include "tests/mujoco/mujoco_engine.h"

namespace gapfarm::truths {
namespace {

Drive drive_of(double left_m_s, double right_m_s, double on_s = 1) {
  return {{left_m_s, 0}, {right_m_s, 0}, on_s, 0.012};
}

Pose end_of(const Scene& scene, const Drive& drive, const Pose& X_WS = {}) {
  return mujoco_engine().make(scene)->drive(X_WS, drive).back().X_WR;
}

TEST(MujocoEngine, GoesStraightAsFarAsItsWheelsDo) {
  for (const double speed : {0.1, 0.28, -0.2}) {
    const Pose end = end_of({}, drive_of(speed, speed));
    EXPECT_NEAR(end.x, speed, 2e-3) << speed;
    EXPECT_NEAR(end.y, 0, 1e-4);
    EXPECT_NEAR(end.theta, 0, 1e-3);
  }
}

TEST(MujocoEngine, TurnsInPlaceAboutItsMiddleAndSlowerThanTwoWheelsWould) {
  const Pose end = end_of({}, drive_of(-0.06, 0.06));
  EXPECT_NEAR(end.x, 0, 1e-3);
  EXPECT_NEAR(end.y, 0, 1e-3);
  EXPECT_LT(end.theta, 2 * 0.06 / Scene().robot.gauge_m);
  EXPECT_GT(end.theta, 0.4);
}

TEST(MujocoEngine, IsItsOwnMirrorImage) {
  Scene scene, other;
  scene.com_y_m = 0.006;
  other.com_y_m = -0.006;
  const Pose end = end_of(scene, drive_of(0.11, 0.28));
  const Pose seen = mirrored(end_of(other, drive_of(0.28, 0.11)));
  EXPECT_NEAR(end.x, seen.x, 1e-4);
  EXPECT_NEAR(end.y, seen.y, 1e-4);
  EXPECT_NEAR(end.theta, seen.theta, 1e-3);
}

TEST(MujocoEngine, ADriveAgainIsTheSameDrive) {
  const auto engine = mujoco_engine().make({});
  const Pose once = engine->drive({}, drive_of(0.11, 0.28)).back().X_WR;
  engine->drive({}, drive_of(-0.28, -0.28));
  EXPECT_EQ(engine->drive({}, drive_of(0.11, 0.28)).back().X_WR, once);
}

// A robot that hops from wheel to wheel does not.
TEST(MujocoEngine, TurnsAlmostAlikeWhenDrivenAlmostAlike) {
  for (const double friction : {0.46, 0.6, 0.78}) {
    Scene scene;
    scene.robot.friction = friction;
    const double turn = end_of(scene, drive_of(0.084, 0.21)).theta;
    for (const double factor : {0.997, 0.999, 1.001, 1.003}) {
      const double other = end_of(scene, drive_of(0.084 * factor, 0.21 * factor)).theta;
      EXPECT_NEAR(other, factor * turn, 0.008 * turn) << friction << " " << factor;
    }
  }
}

TEST(MujocoEngine, SlidesDownhillInTurnsAndStaysOtherwise) {
  Scene scene;
  scene.floor.tilt_rad = 0.1;
  scene.floor.tilt_direction_rad = std::numbers::pi / 2;
  EXPECT_GT(end_of(scene, drive_of(-0.06, 0.06)).y, 0.003);
  const Pose still = end_of(scene, drive_of(0, 0));
  EXPECT_LT(std::hypot(still.x, still.y), 2e-3);
  // Downhill is a direction of the world.
  const Pose turned = end_of(scene, drive_of(-0.06, 0.06), {0, 0, 2});
  EXPECT_GT(turned.y, 0.003);
}

TEST(MujocoCases, ANullsLogPassesTheCheck) {
  const TemporaryFolder folder;
  const Finished made = run_program(
      "mujoco_cases", {folder / "out", "--nulls", "1", "--trials", "16", "--seed", "5"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const Finished checked =
      gapfarm_command({"check", std::string(GAPFARM_SOURCE_DIR) + "/configs/srv1.toml", "--trials",
                       folder / "out/cases/case001/trials.csv"});
  EXPECT_EQ(checked.exit_code, 0) << checked.err;
  EXPECT_THAT(checked.out + checked.err, testing::HasSubstr("48 in 3 sessions"));
}

// What a diagnosis names as `effect` of a log whose robot shares neither motors nor contacts with
// what the diagnosis knows, and what was so.
struct Answer {
  nlohmann::json named;
  std::map<std::string, double> truth;
  std::string text;
};

Answer floor_answer(const std::string& effect, const char* kind, const char* floor,
                    const char* size) {
  const TemporaryFolder folder;
  const Finished made =
      run_program("mujoco_ground_robot", {kind, floor, size, "0.5", "7", folder / "log"});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  const Finished found =
      gapfarm_command({"diagnose", folder / "log/config.toml", "--out", folder / "out"});
  EXPECT_EQ(found.exit_code, 0) << found.err;
  Answer answer{{}, {}, found.out};
  std::istringstream truth(*read_text_file(folder / "log/truth.txt"));
  for (std::string key; truth >> key;) truth >> answer.truth[key];
  const auto diagnosis = nlohmann::json::parse(*read_text_file(folder / "out/diagnosis.json"));
  for (const auto& e : diagnosis["effects"]) {
    if (e["name"] == effect) answer.named = e["parameters"];
  }
  EXPECT_FALSE(answer.named.is_null()) << kind << ": " << found.out;
  return answer;
}

double value_of(const Answer& answer, const char* key) {
  return answer.named.is_null() ? NAN : answer.named[key]["value"].get<double>();
}

TEST(MujocoGroundRobot, ASlopeIsNamedWithTheWayDown) {
  for (const char* kind : {"differential", "skid"}) {
    const Answer slope = floor_answer("floor_tilt", kind, "tilt", "0.06");
    const double off = value_of(slope, "direction") - slope.truth.at("direction");
    EXPECT_NEAR(std::remainder(off, 2 * std::numbers::pi), 0, 0.15) << slope.text;
  }
}

TEST(MujocoGroundRobot, AnEdgeIsNamedWhereItIs) {
  const Answer edge = floor_answer("floor_edge", "differential", "edge", "0.004");
  const double way = edge.truth.at("direction");
  EXPECT_NEAR(std::remainder(value_of(edge, "angle") - way, 2 * std::numbers::pi), 0, 0.1);
  const double across = (value_of(edge, "x") - edge.truth.at("x")) * std::cos(way) +
                        (value_of(edge, "y") - edge.truth.at("y")) * std::sin(way);
  EXPECT_NEAR(across, 0, 0.03) << edge.text;
}

TEST(MujocoGroundRobot, APatchIsNamedWhereItIs) {
  const Answer patch = floor_answer("friction_patch", "skid", "patch", "0.008");
  for (const char* key : {"x", "y", "radius"}) {
    EXPECT_NEAR(value_of(patch, key), patch.truth.at(key), 0.1) << key << ": " << patch.text;
  }
}

}  // namespace
}  // namespace gapfarm::truths
