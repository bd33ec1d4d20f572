// No tracker: poses measured each against the one before, as scan matching has them, calibrate a
// robot's wheels and its sensor's pose, and nothing is said of places in the world.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "common/random/stream.h"
#include "common/recordings/read.h"
#include "common/robot/robot_file.h"
#include "master/ground/diagnose_ground.h"
#include "master/ground/reference.h"
#include "master/io/logs/to_runs.h"

namespace gapfarm::relative_poses_test {

// Half a metre a second at most, a sensor 0.1 m ahead that looks a little to the left.
constexpr double kLeft_m = 0.0515, kRight_m = 0.0492, kSeparation_m = 0.312;
const Pose X_RS{0.1, 0.02, 0.05};

GroundRobot robot_by_its_maker() {
  return *parse_robot(
      "drive = \"differential\"\ncommands = [\"left\", \"right\"]\nmeasured = true\n"
      "wheel_separation = 0.3\nwheel_radius = 0.05\n[marker]\nx = 0.12\n",
      "r.toml");
}

// Stretches of half a second each at wheel speeds of its own; matched scans err by 2 mm and 2 mrad.
RunLog driven(int runs, std::uint64_t seed) {
  Stream stream({seed, Purpose::kTest, 0, 0, 0});
  RunLog log;
  log.channels = {"left", "right"};
  log.relative = true;
  constexpr double kDt_s = 0.5;
  for (int r = 0; r < runs; ++r) {
    LoggedRun run;
    run.run = std::to_string(r);
    run.poses.push_back({0, {}});
    for (int k = 0; k < 120; ++k) {
      const double left = 2 + 6 * stream.uniform(), right = 2 + 6 * stream.uniform();
      run.commands.push_back({k * kDt_s, {left, right}});
      const double way = (kLeft_m * left + kRight_m * right) / 2 * kDt_s;
      const double turn = (kRight_m * right - kLeft_m * left) / kSeparation_m * kDt_s;
      const Pose X_RR{way * std::sin(turn) / turn, way * (1 - std::cos(turn)) / turn, turn};
      Pose X_SS = inverse(X_RS) * X_RR * X_RS;
      X_SS.x += 2e-3 * stream.normal();
      X_SS.y += 2e-3 * stream.normal();
      X_SS.theta += 2e-3 * stream.normal();
      run.poses.push_back({(k + 1) * kDt_s, run.poses.back().X_WM * X_SS});
    }
    log.runs.push_back(std::move(run));
  }
  return log;
}

TEST(RelativePoses, CalibrateWheelsAndSensor) {
  const RunLog log = driven(6, 31);
  const auto asked = ask_what_changed(robot_by_its_maker(), log, {{0.5, 2, 5}, 0.5}, 1, nullptr);
  ASSERT_TRUE(asked) << asked.error().message;
  const GroundReference& fit = *asked->reference;
  const auto value = [&](const std::string& name) {
    for (std::size_t k = 0; k < fit.names.size(); ++k) {
      if (fit.names[k] == name) return fit.values[static_cast<Eigen::Index>(k)];
    }
    ADD_FAILURE() << name;
    return 0.0;
  };
  EXPECT_NEAR(0.05 * value("left"), kLeft_m, 3e-3 * kLeft_m);
  EXPECT_NEAR(0.05 * value("right"), kRight_m, 3e-3 * kRight_m);
  // Wheel speeds change where poses were taken: each counts on its own side of them.
  EXPECT_NEAR(0.3 * value("separation"), kSeparation_m, 3e-3 * kSeparation_m);
  EXPECT_NEAR(value("marker_yaw"), X_RS.theta, 3e-3);
  EXPECT_NEAR(value("marker_x"), X_RS.x, 3e-3);
}

TEST(RelativePoses, AreKeptAsIncrementsByAFolder) {
  RunLog log = driven(2, 7);
  const RunFiles files = format_runs(log);
  EXPECT_EQ(files.poses.substr(0, 18), "run,t,dx,dy,dtheta");
  const std::string commands = testing::TempDir() + "relative_c.csv",
                    poses = testing::TempDir() + "relative_p.csv";
  std::ofstream(commands) << files.commands;
  std::ofstream(poses) << files.poses;
  const auto read = read_runs(commands, poses, log.channels);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(read->relative);
  ASSERT_EQ(read->runs.size(), 2u);
  EXPECT_NEAR(read->runs[1].poses.back().X_WM.x, log.runs[1].poses.back().X_WM.x, 1e-6);
  EXPECT_NEAR(read->runs[1].poses.back().X_WM.theta, log.runs[1].poses.back().X_WM.theta, 1e-6);
}

TEST(RelativePoses, NameNothingThatHasAPlace) {
  const auto diagnosis = diagnose_ground(robot_by_its_maker(), driven(6, 32), {});
  ASSERT_TRUE(diagnosis) << diagnosis.error().message;
  const Diagnosis& d = diagnosis->diagnosis;
  ASSERT_FALSE(d.effects.empty());
  for (const Screened& s : d.screening) {
    EXPECT_NE(s.effect, "floor_edge");
    EXPECT_NE(s.effect, "camera_aspect");
  }
  bool says_so = false;
  for (const std::string& caution : d.cautions) {
    says_so = says_so || caution.find("Poses are relative") != caution.npos;
  }
  EXPECT_TRUE(says_so);
}

}  // namespace gapfarm::relative_poses_test
