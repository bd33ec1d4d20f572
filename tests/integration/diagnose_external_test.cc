// gapfarm diagnose with a simulator of the user's: logs of it, of Bullet, and of each other.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/integration/diagnose_program.h"

namespace gapfarm::diagnose_external_test {

using Json = nlohmann::json;

constexpr const char* kDrives =
    "drive_noise_common = 0.012\ndrive_noise_side = 0.01\npose_noise_position = 0.0015\n"
    "pose_noise_heading = 0.008\n[simulate]\nsessions = 2\nlevels = [0.5, 1.0]\n"
    "durations = [0.5, 1.0]\n";

// A robot on two sides that answers where it rests, and nothing of its way.
constexpr const char* kRestOnly = R"(import json, math, sys
for line in sys.stdin:
    task = json.loads(line)
    if 'id' not in task:
        print(json.dumps({'gapfarm': 1, 'name': 'rest only', 'parameters': [
            {'key': 'speed', 'unit': 'm/s', 'lower': 0.1, 'upper': 1, 'nominal': 0.25, 'log': True},
            {'key': 'width', 'unit': 'm', 'lower': 0.05, 'upper': 0.5, 'nominal': 0.2},
            {'key': 'pull', 'unit': '-', 'lower': -0.1, 'upper': 0.1, 'nominal': 0}]}), flush=True)
        continue
    p = task['parameters']
    left, right = task['left']['speed'] - p['pull'], task['right']['speed'] + p['pull']
    turn = (right - left) * p['speed'] / p['width'] * task['duration']
    way = (left + right) / 2 * p['speed'] * task['duration']
    chord = way if abs(turn) < 1e-9 else way * math.sin(turn / 2) / (turn / 2)
    pose = [chord * math.cos(turn / 2), chord * math.sin(turn / 2), turn]
    print(json.dumps({'id': task['id'], 'pose': pose}), flush=True)
)";

// A robot on two tracks on a floor that leans, has a nap and brakes; what it is reported the floor
// is what it declares.
std::string on_a_floor(const std::string& inputs, const std::string& floor) {
  return "import json, math, sys\n"
         "INPUTS = " +
         inputs +
         "\n"
         "for line in sys.stdin:\n"
         "    task = json.loads(line)\n"
         "    floor = " +
         floor + R"(
    if 'id' not in task:
        print(json.dumps({'gapfarm': 1, 'name': 'on a floor', 'inputs': INPUTS, 'parameters': [
            {'key': 'speed', 'unit': 'm/s', 'lower': 0.1, 'upper': 1, 'nominal': 0.25, 'log': True},
            {'key': 'width', 'unit': 'm', 'lower': 0.05, 'upper': 0.5, 'nominal': 0.2}]}), flush=True)
        continue
    if ('floor' in task) != ('floor' in INPUTS) or len(task['left']) != 1 or 'speed' not in task['left']:
        sys.exit('told of what was not declared: ' + line)
    p, step, x, y, theta = task['parameters'], 0.02, 0.0, 0.0, 0.0
    left, right = (task[side]['speed'] * p['speed'] for side in ('left', 'right'))
    for _ in range(round(task['duration'] / step)):
        way, turn = (left + right) / 2 * step, (right - left) / p['width'] * step
        way *= 1 - floor['rolling_resistance']
        x += way * math.cos(theta + turn / 2)
        y += way * math.sin(theta + turn / 2)
        theta += turn
        slide = {'tilt': abs(way) * math.tan(floor['tilt']), 'nap': abs(way) * floor['nap']}
        for kind, size in slide.items():
            x += size * math.cos(floor[kind + '_direction'])
            y += size * math.sin(floor[kind + '_direction'])
    print(json.dumps({'id': task['id'], 'pose': [x, y, theta]}), flush=True)
)";
}

class DiagnoseExternal : public ::testing::Test {
 protected:
  static std::string external(const std::string& arguments, const std::string& genes,
                              const std::string& more = "") {
    return "scenario = \"external\"\n[external]\nprogram = [" + arguments + "]\n[genes]\n" + genes +
           "[parameters]\n" + more + kDrives;
  }
  static std::string two_tracks() {
    return external("\"python3\", \"" GAPFARM_SOURCE_DIR "/scripts/bridges/two_tracks.py\"",
                    "full_speed = [0.1, 0.8]\ngauge = [0.06, 0.4]\n");
  }
  static std::string srv1() {
    return "scenario = \"srv1\"\n[parameters]\nstep_rate = 60\ntread_creep = 0.05\n" +
           std::string(kDrives);
  }

  // Drives by the one simulator, diagnosed by the other.
  Json diagnose(const std::string& driven_by, const std::string& diagnosed_by, int trials,
                const std::vector<std::string>& set, const std::vector<std::string>& more = {}) {
    const std::string log = folder_ / "trials.csv";
    simulate_log(folder_.write("driven.toml", driven_by), log, trials, set);
    return diagnose_log(folder_.write("by.toml", diagnosed_by), log, folder_ / "d", more);
  }

  static void expect_named(const Json& d, const std::string& name, const std::string& parameter,
                           double value, double within) {
    ASSERT_EQ(d["effects"].size(), 1u) << d["headline"];
    EXPECT_EQ(d["effects"][0]["name"], name);
    const Json& found = d["effects"][0]["parameters"][parameter];
    EXPECT_NEAR(found["value"].get<double>(), value, within);
    EXPECT_LT(found["lo"], value + within / 2);
    EXPECT_GT(found["hi"], value - within / 2);
    EXPECT_LT(d["gap"]["final"], d["gap"]["tuned"]);
  }

  TemporaryFolder folder_;
};

TEST_F(DiagnoseExternal, NamesAnEffectOfTheMotorsAndLeavesAModelThatPredicts) {
  // The robot of the log is another one than the config's.
  const Json d = diagnose(two_tracks(), two_tracks(), 100,
                          {"motor_asymmetry.ratio=0.05", "full_speed=0.36", "gauge=0.12"});
  EXPECT_EQ(d["verdict"], "effect") << d["headline"];
  expect_named(d, "motor_asymmetry", "ratio", 0.05, 0.006);
  const Finished status = gapfarm_command({"status", folder_ / "d"});
  EXPECT_NE(status.out.find("so far: motor_asymmetry"), std::string::npos) << status.out;
  double speed = 0, gauge = 0;
  for (const Json& row : d["parameters"]) {
    if (row["key"] == "full_speed") speed = row["final"];
    if (row["key"] == "gauge") gauge = row["final"];
  }
  EXPECT_NEAR(speed, 0.36, 0.005);
  EXPECT_NEAR(gauge, 0.12, 0.003);
  EXPECT_FALSE(d["drives"].empty()) << "the program answers paths";
  const Finished predicted = gapfarm_command(
      {"predict", folder_ / "d/model.toml", "--trials", folder_ / "trials.csv", "--out", "-"});
  EXPECT_EQ(predicted.exit_code, 0) << predicted.err;
}

TEST_F(DiagnoseExternal, NamesAnEffectOfTheCameraAndNoneWhereNothingIsMissing) {
  expect_named(diagnose(two_tracks(), two_tracks(), 100, {"camera_aspect.ratio=1.08"}),
               "camera_aspect", "ratio", 1.08, 0.016);
  const Json none = diagnose(two_tracks(), two_tracks(), 100, {});
  EXPECT_EQ(none["verdict"], "none") << none["headline"];
  // What the program does not take is reported, and not looked for.
  const std::string cautions = none["cautions"].dump();
  EXPECT_NE(cautions.find("floor_tilt, floor_nap"), std::string::npos) << cautions;
  for (const Json& row : none["screening"]) EXPECT_NE(row["effect"], "floor_tilt");
}

// A program without paths, whose one parameter may be negative and does what an effect does.
TEST_F(DiagnoseExternal, WhatTheProgramExplainsItselfIsNoEffect) {
  const std::string program = external("\"python3\", \"rest_only.py\"", "speed = [0.1, 1]\n");
  folder_.write("rest_only.py", kRestOnly);
  const Json d = diagnose(program, program, 100, {"heading_offset.angle=0.06", "speed=0.3"});
  expect_named(d, "heading_offset", "angle", 0.06, 0.01);
  EXPECT_FALSE(d.contains("drives")) << "there are no paths to show";
  const Json wheels = diagnose(srv1(), program, 100, {"motor_asymmetry.ratio=0.04"});
  for (const Json& effect : wheels["effects"]) EXPECT_NE(effect["name"], "motor_asymmetry");
}

TEST_F(DiagnoseExternal, AFloorIsForProgramsThatDeclareIt) {
  folder_.write("floor.py", on_a_floor("['floor']", "task.get('floor')"));
  folder_.write("bare.py", on_a_floor("[]",
                                      "dict.fromkeys(['tilt', 'tilt_direction', 'nap', "
                                      "'nap_direction', 'rolling_resistance'], 0)"));
  const std::string genes = "speed = [0.1, 1]\nwidth = [0.1, 0.4]\n";
  const std::string floor = external("\"python3\", \"floor.py\"", genes),
                    bare = external("\"python3\", \"bare.py\"", genes);
  const std::vector<std::string> leans = {"floor_tilt.angle=0.1", "floor_tilt.direction=0.7"};
  const Json diagnosed = diagnose(floor, floor, 120, leans);
  expect_named(diagnosed, "floor_tilt", "angle", 0.1, 0.02);
  EXPECT_NEAR(diagnosed["effects"][0]["parameters"]["direction"]["value"].get<double>(), 0.7, 0.2);
  // A program without a floor is neither asked about one nor reported one.
  const Json untold = diagnose(floor, bare, 60, leans);
  for (const Json& effect : untold["effects"]) EXPECT_NE(effect["name"], "floor_tilt");
  for (const Json& row : untold["screening"]) EXPECT_NE(row["effect"], "floor_tilt");
  const std::string cautions = untold["cautions"].dump();
  EXPECT_NE(cautions.find("floor_tilt, floor_nap"), std::string::npos) << cautions;
  const Finished refused = gapfarm_command(
      {"simulate", folder_ / "by.toml", "--out", "-", "--set", "floor_tilt.angle=0.1"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("floor_tilt.angle"), std::string::npos) << refused.err;
}

TEST_F(DiagnoseExternal, ALogOfMuJoCoIsDiagnosedByBulletAndTheOtherWayRound) {
  const std::string bridge = GAPFARM_BIN_DIR "/mujoco_bridge";
  if (!std::filesystem::exists(bridge)) GTEST_SKIP() << "built without GAPFARM_MUJOCO";
  const std::string mujoco = external(
      "\"" + bridge + "\", \"" GAPFARM_SOURCE_DIR "/scripts/bridges/mujoco/two_wheeler.xml\"",
      "full_speed = [0.1, 0.6]\ntrack = [0.05, 0.3]\n");
  // Wheels of the one do not turn as tracks of the other do, so only a clear effect is named.
  expect_named(diagnose(mujoco, srv1(), 60, {"motor_asymmetry.ratio=0.12"}), "motor_asymmetry",
               "ratio", 0.12, 0.03);
  expect_named(diagnose(srv1(), mujoco, 60, {"motor_asymmetry.ratio=0.06"}), "motor_asymmetry",
               "ratio", 0.06, 0.02);
}

}  // namespace gapfarm::diagnose_external_test
