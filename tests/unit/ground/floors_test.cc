// Floors under robots whose wheel speeds were measured: slip and the motors' loop are two things,
// two floors in one log have an edge, and directions and drift are no change.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <iostream>
#include <numbers>

#include "common/random/stream.h"
#include "common/robot/robot.h"
#include "common/score/kinematic_body.h"
#include "common/trials/files.h"
#include "master/ground/diagnose_ground.h"
#include "master/ground/fit/wheel_loop.h"
#include "master/ground/reference.h"
#include "master/io/logs/bags.h"
#include "master/io/logs/column_map.h"
#include "tests/unit/trials/shared_data.h"

namespace gapfarm {
namespace {

using std::numbers::pi;

GroundRobot robotino() {
  const auto text = read_text_file(GAPFARM_SOURCE_DIR "/configs/robots/robotino.toml");
  auto robot = parse_robot(*text, "robotino.toml");
  EXPECT_TRUE(robot.ok()) << robot.error().message;
  return *robot;
}

struct Floor {
  double traction = 0.9;
  Eigen::Vector2d load_m{0, 0};
  double loop_gain = 0.95, loop_loss_rad_s = 0.05;
  // Beyond x cos(angle) + y sin(angle) = offset the traction is `ratio` times as much.
  double edge_rad = 0, edge_m = 1e9, ratio = 1;
  double camera_m = 0;  // what the camera errs by for about a second
  double apart_deg = 30;
  double own = 0;  // what a run's own traction differs by, a standard deviation's share
};

// Twelve runs of 8 s from the origin, so far apart beginning with `first_deg`: what the robot
// does by a simulation of the test's own, with the camera's noise.
RunLog driven_on(const Floor& floor, double first_deg, std::uint64_t seed) {
  const GroundRobot robot = robotino();
  OmniWheels omni(robot);
  omni.load(floor.load_m);
  Stream stream({seed, Purpose::kTest, 0, 0, 0});
  RunLog log;
  log.channels = log.wheel_channels = robot.channels;
  for (int r = 0; r < 12; ++r) {
    LoggedRun run;
    run.run = std::to_string(r);
    const double motion = (first_deg + floor.apart_deg * r) * pi / 180;
    const double traction = floor.traction * (1 + floor.own * stream.normal());
    const double v[2] = {0.1 * std::cos(motion), 0.1 * std::sin(motion)};
    CommandRow commanded{0, {}}, measured{0, {}};
    for (const RobotWheel& wheel : robot.wheels) {
      const double rad_s =
          (v[0] * std::cos(wheel.heading_rad) + v[1] * std::sin(wheel.heading_rad)) / 0.04;
      const double loss = std::min(floor.loop_loss_rad_s, std::abs(rad_s) * floor.loop_gain);
      commanded.values.push_back(rad_s);
      measured.values.push_back(floor.loop_gain * rad_s - std::copysign(loss, rad_s));
    }
    Pose X_WR{0, 0, 2 * pi * stream.uniform()};
    constexpr double kDt_s = 0.005;
    double off_m[2] = {0, 0};
    for (int k = 0; k < 1600; ++k) {
      if (k % 10 == 0) {
        commanded.t_s = measured.t_s = k * kDt_s;
        run.commands.push_back(commanded);
        run.wheel_speeds.push_back(measured);
        Pose X_WM = X_WR * robot.X_RM;
        for (double& off : off_m) off = 0.95 * off + 0.31 * floor.camera_m * stream.normal();
        X_WM.x += off_m[0];
        X_WM.y += off_m[1];
        run.poses.push_back({k * kDt_s,
                             {X_WM.x + 3e-4 * stream.normal(), X_WM.y + 3e-4 * stream.normal(),
                              wrap_angle(X_WM.theta + 2e-3 * stream.normal())}});
      }
      Eigen::Vector3d surface, tractions;
      for (Eigen::Index i = 0; i < 3; ++i) {
        const RobotWheel& wheel = robot.wheels[static_cast<std::size_t>(i)];
        const Pose at = X_WR * Pose{*wheel.x_m, *wheel.y_m, 0};
        const bool beyond =
            at.x * std::cos(floor.edge_rad) + at.y * std::sin(floor.edge_rad) > floor.edge_m;
        surface[i] = 0.04 * measured.values[static_cast<std::size_t>(i)];
        tractions[i] = traction * (beyond ? floor.ratio : 1);
      }
      X_WR = X_WR * exp(Twist(kDt_s * omni.inverse(tractions) * surface));
    }
    log.runs.push_back(std::move(run));
  }
  return log;
}

RunLog shifted(RunLog log, const Eigen::Vector2d& by_m) {
  for (LoggedRun& run : log.runs) {
    for (PoseRow& pose : run.poses) {
      pose.X_WM.x += by_m[0];
      pose.X_WM.y += by_m[1];
    }
  }
  return log;
}

Diagnosis diagnosed(const RunLog& log, const RunLog* reference = nullptr) {
  GroundDiagnoseOptions options;
  if (reference != nullptr) options.reference = *reference;
  auto result = diagnose_ground(robotino(), log, options);
  EXPECT_TRUE(result.ok()) << result.error().message;
  return result.ok() ? std::move(result->diagnosis) : Diagnosis{};
}

void expect_holds(const Estimate& e, double truth, double near) {
  EXPECT_NEAR(e.value, truth, near) << e.key;
  EXPECT_LE(e.lo, truth + near / 2) << e.key;
  EXPECT_GE(e.hi, truth - near / 2) << e.key;
}

TEST(Floors, SlipAndTheMotorsLoopArePartedOnAnotherFloor) {
  const RunLog before = driven_on({0.9, {-0.01, 0}, 0.95}, 0, 1);
  const Diagnosis found = diagnosed(driven_on({0.65, {-0.01, 0}, 0.8}, 15, 2), &before);
  ASSERT_EQ(found.effects.size(), 1u) << found.headline;
  EXPECT_EQ(found.effects[0].name, "floor") << found.headline;
  ASSERT_EQ(found.effects[0].parameters.size(), 2u);
  expect_holds(found.effects[0].parameters[0], 0.65 - 0.9, 0.02);
  expect_holds(found.effects[0].parameters[1], 0.8 / 0.95 - 1, 0.03);
}

TEST(Floors, MotorsThatRunShortAreNoFloor) {
  const RunLog before = driven_on({0.9, {0, 0}, 0.95}, 0, 1);
  const Diagnosis found = diagnosed(driven_on({0.9, {0, 0}, 0.75}, 0, 2), &before);
  ASSERT_EQ(found.effects.size(), 1u) << found.headline;
  EXPECT_EQ(found.effects[0].name, "wheel_loop");
  EXPECT_EQ(found.verdict, Verdict::kEffect);
  expect_holds(found.effects[0].parameters.at(0), 0.75 / 0.95 - 1, 0.03);
}

// Weight behind the middle turns the robot though nobody reported it to, each direction otherwise.
TEST(Floors, DirectionsAndDriftAreNoChange) {
  const Floor floor{0.6, {-0.015, 0.003}, 0.8, 0.15};
  const RunLog even = driven_on(floor, 0, 1), odd = driven_on(floor, 10, 2);
  const double turned =
      wrap_angle(even.runs[3].poses.back().X_WM.theta - even.runs[3].poses.front().X_WM.theta);
  EXPECT_GT(std::abs(turned), 0.05);
  const Diagnosis found = diagnosed(odd, &even);
  EXPECT_TRUE(found.effects.empty()) << found.headline;
  EXPECT_EQ(found.verdict, Verdict::kNone) << found.headline;
}

// Runs that all begin at one place and last as long: the fast ones get farthest, so that far out
// the floor seems quicker.
TEST(Floors, RunsThatGetFartherAreNoEdge) {
  Floor floor{0.6, {0, 0}, 0.8, 0.05};
  floor.apart_deg = 3;
  floor.own = 0.09;
  const RunLog even = driven_on(floor, 70, 1);
  const Diagnosis found = diagnosed(driven_on(floor, 71.5, 2), &even);
  for (const NamedEffect& e : found.effects) EXPECT_NE(e.name, "floor_edge") << found.headline;
}

TEST(Floors, AnEdgeIsFoundWhereItIs) {
  const RunLog before = driven_on({}, 0, 1);
  // Without a reference on a floor whose slip is a far larger error of the file than the edge.
  for (const RunLog* reference : {&before, static_cast<const RunLog*>(nullptr)}) {
    Floor floor{0.9, {0, 0}, 0.95, 0.05, 0.6, 0.25, 0.6};
    if (reference == nullptr) floor.traction = 0.75, floor.ratio = 0.7;
    const Diagnosis found = diagnosed(driven_on(floor, 15, 2), reference);
    const auto edge = std::find_if(found.effects.begin(), found.effects.end(),
                                   [](const NamedEffect& e) { return e.name == "floor_edge"; });
    ASSERT_NE(edge, found.effects.end()) << found.headline;
    ASSERT_EQ(edge->parameters.size(), 4u);
    expect_holds(edge->parameters[0], floor.ratio - 1, 0.06);
    const double x = edge->parameters[1].value, y = edge->parameters[2].value;
    EXPECT_NEAR(x * std::cos(0.6) + y * std::sin(0.6), 0.25, 0.015);
    expect_holds(edge->parameters[3], 0.6, 0.06);
    if (reference == nullptr) {
      // The robot's own slip is that of the floor on which it drove most.
      const auto slip = std::find_if(found.effects.begin(), found.effects.end(),
                                     [](const NamedEffect& e) { return e.name == "wheel_slip"; });
      ASSERT_NE(slip, found.effects.end()) << found.headline;
      expect_holds(slip->parameters.at(0), floor.traction - 1, 0.03);
      continue;
    }
    EXPECT_EQ(found.effects.size(), 1u) << found.headline;
  }
}

// Which side of an edge is the robot's own floor no log says: values that go out to other tools are
// of all that was driven.
TEST(Floors, ValuesOfARobotAreOfBothSidesOfAnEdge) {
  const Floor floor{0.9, {0, 0}, 0.95, 0.05, 0.6, 0, 0.6};
  const auto asked = ask_what_changed(robotino(), driven_on(floor, 15, 2), {}, 1, nullptr, true);
  ASSERT_TRUE(asked.ok()) << asked.error().message;
  const double traction = asked->reference->value_or("traction", 0);
  EXPECT_NEAR(traction, (0.9 + 0.6 * 0.9) / 2, 0.05);
  EXPECT_EQ(asked->reference->value_or("known_edge_ratio", 1), 1);
}

// Edges anywhere, kilometres from the tracker's origin too, under a camera whose errors last: the
// intervals hold the line as often as they say.
TEST(Floors, AnEdgesIntervalsHoldIt) {
  const char* wanted = std::getenv("GAPFARM_EDGES");
  const int edges = wanted != nullptr ? std::atoi(wanted) : 3;
  int held = 0, asked = 0;
  for (int e = 0; e < edges; ++e) {
    const auto seed = static_cast<std::uint64_t>(100 + e);
    Stream stream({seed, Purpose::kTest, 1, 0, 0});
    Floor floor{0.85, {-0.008, 0.003}, 0.95};
    floor.edge_rad = 2 * pi * stream.uniform();
    floor.edge_m = 0.1 + 0.25 * stream.uniform();
    floor.ratio = 0.6 + 0.25 * stream.uniform();
    floor.camera_m = 2e-3;
    const Eigen::Vector2d away = e % 2 == 1 ? Eigen::Vector2d(3000, -4000) : Eigen::Vector2d(0, 0);
    const RunLog before =
        shifted(driven_on({0.85, {-0.008, 0.003}, 0.95, 0.05, 0, 1e9, 1, 2e-3}, 0, seed), away);
    const Diagnosis found = diagnosed(shifted(driven_on(floor, 15, seed + 1000), away), &before);
    const auto edge = std::find_if(found.effects.begin(), found.effects.end(),
                                   [](const NamedEffect& f) { return f.name == "floor_edge"; });
    if (edge == found.effects.end()) {
      ADD_FAILURE() << "edge " << e << ": " << found.headline;
      continue;
    }
    const Estimate& x = edge->parameters[1];
    const Estimate& y = edge->parameters[2];
    const Estimate& angle = edge->parameters[3];
    const double turned = wrap_angle(floor.edge_rad - angle.value);
    // The true line's place across the reported normal, at the reported point.
    const double off = floor.edge_m - (x.value - away[0]) * std::cos(floor.edge_rad) -
                       (y.value - away[1]) * std::sin(floor.edge_rad);
    const double wide = std::hypot(x.hi - x.lo, y.hi - y.lo) / 2;
    const bool truths[] = {
        edge->parameters[0].lo <= floor.ratio - 1 && floor.ratio - 1 <= edge->parameters[0].hi,
        std::abs(off) <= wide,
        angle.lo <= angle.value + turned && angle.value + turned <= angle.hi};
    for (const bool holds : truths) held += holds;
    asked += 3;
    std::cout << "edge " << e << " ratio " << floor.ratio - 1 << " [" << edge->parameters[0].lo
              << ", " << edge->parameters[0].hi << "], off by " << off << " of " << wide
              << " m, turned by " << turned << " [" << angle.lo - angle.value << ", "
              << angle.hi - angle.value << "]\n";
  }
  // 90 % of them; fewer than this come by chance once in a hundred times.
  EXPECT_GE(held, std::floor(0.9 * asked - 2.33 * std::sqrt(0.09 * asked)));
}

// The runs of a floor that go every 60th degree, or `step` fives of degrees.
RunLog logged_on(const std::filesystem::path& data, const std::string& floor, int first,
                 int step = 12) {
  const auto map = parse_map(
      *read_text_file(GAPFARM_SOURCE_DIR "/configs/robots/robotino_map.toml"), "robotino_map.toml");
  EXPECT_TRUE(map.ok()) << map.error().message;
  std::vector<Recording> recordings;
  for (int k = first; k < 72; k += step) {
    const std::string name = (k < 10 ? "exp0" : "exp") + std::to_string(k) + ".csv";
    if (!std::filesystem::exists(data / floor / name)) continue;
    auto recording = read_recording((data / floor / name).string());
    EXPECT_TRUE(recording.ok()) << recording.error().message;
    recordings.push_back(*std::move(recording));
  }
  auto runs = to_runs(recordings, *map);
  EXPECT_TRUE(runs.ok()) << runs.error().message;
  return std::move(runs->log);
}

TEST(Floors, ARealRobotsFloorsAreReported) {
  const auto data = shared_data("ground/robotino");
  if (!data) GTEST_SKIP() << "no shared data beside the sources";
  const RunLog table = logged_on(*data, "table", 0);
  const Diagnosis floor = diagnosed(logged_on(*data, "gray", 2), &table);
  ASSERT_EQ(floor.effects.size(), 1u) << floor.headline;
  EXPECT_EQ(floor.effects[0].name, "floor") << floor.headline;
  ASSERT_EQ(floor.effects[0].parameters.size(), 2u) << floor.headline;
  EXPECT_LT(floor.effects[0].parameters[0].hi, -0.1);
  EXPECT_LT(floor.effects[0].parameters[1].hi, -0.1);
  const Diagnosis same = diagnosed(logged_on(*data, "table", 2), &table);
  EXPECT_TRUE(same.effects.empty()) << same.headline;
}

// From the table over the edge of a mat, without a reference. By wheels and poses alone the robot
// goes 0.85 of its wheels' way where it is wholly on the table, most of the log, and 0.7 on the
// mat.
TEST(Floors, ARealRobotsOwnFloorIsTheOneItDroveMost) {
  const auto data = shared_data("ground/robotino");
  if (!data) GTEST_SKIP() << "no shared data beside the sources";
  const Diagnosis found = diagnosed(logged_on(*data, "table_gray", 0, 2));
  const auto size_of = [&](const char* name) {
    const auto at = std::ranges::find(found.effects, name, &NamedEffect::name);
    return at == found.effects.end() ? NAN : at->parameters.at(0).value;
  };
  EXPECT_NEAR(size_of("wheel_slip"), -0.15, 0.02) << found.headline;
  EXPECT_NEAR(size_of("floor_edge"), 0.7 / 0.85 - 1, 0.05) << found.headline;
}

}  // namespace
}  // namespace gapfarm
