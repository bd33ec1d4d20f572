// No tracker: poses measured each against the one before, as scan matching has them, calibrate a
// robot's wheels and its sensor's pose, and nothing is said of places in the world.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "common/math/statistics.h"
#include "common/random/stream.h"
#include "common/recordings/read.h"
#include "common/robot/robot_file.h"
#include "master/ground/diagnose_ground.h"
#include "master/ground/reference.h"
#include "master/io/logs/to_runs.h"

namespace gapfarm::relative_poses_test {

// Half a metre a second at most, a sensor 0.1 m ahead that looks a little to the left.
constexpr double kLeft_m = 0.0515, kRight_m = 0.0492, kSeparation_m = 0.312;
const Pose kSensor{0.1, 0.02, 0.05};
constexpr double kEachRow_s = 1e-3;

GroundRobot robot_by_its_maker() {
  return *parse_robot(
      "drive = \"differential\"\ncommands = [\"left\", \"right\"]\nmeasured = true\n"
      "wheel_separation = 0.3\nwheel_radius = 0.05\n[marker]\nx = 0.12\n",
      "r.toml");
}

// Stretches of half a second each at wheel speeds of its own; matched scans err by 2 mm and 2 mrad.
RunLog driven(int runs, std::uint64_t seed, const Pose& X_RS = kSensor, bool turns = true) {
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
      const double left = 2 + 6 * stream.uniform();
      const double right =
          turns ? 2 + 6 * stream.uniform() : left * kLeft_m / kRight_m * (1 + 1e-9);
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

// What a fit has of a value: itself, and 90 % about it.
struct Said {
  double value = 0, lo = 0, hi = 0;
  bool shown = false;
};
class Calibration {
 public:
  explicit Calibration(const RunLog& log) {
    const auto asked = ask_what_changed(robot_by_its_maker(), log, {{kEachRow_s}, 0}, 1, nullptr);
    EXPECT_TRUE(asked) << asked.error().message;
    if (asked) fit_ = *asked->reference;
  }
  Said operator()(const std::string& name) const {
    for (std::size_t k = 0; k < fit_.names.size(); ++k) {
      if (fit_.names[k] != name) continue;
      const auto i = static_cast<Eigen::Index>(k);
      const Eigen::VectorXd row = fit_.draws.row(i).array() + fit_.values[i];
      const std::vector<double> drawn(row.begin(), row.end());
      return {fit_.values[i], quantile(drawn, 0.05), quantile(drawn, 0.95), fit_.shown[k] != 0};
    }
    ADD_FAILURE() << name;
    return {};
  }

 private:
  GroundReference fit_;
};

// Wheel speeds change where poses were taken: each counts on its own side of them.
TEST(RelativePoses, CalibrateWheelsAndASensorThatLooksAnyWay) {
  for (const double yaw : {0.05, 1.6, -1.5, 3.1}) {
    const Pose X_RS{0.1, 0.02, yaw};
    const Calibration said(driven(6, 31, X_RS));
    EXPECT_NEAR(0.05 * said("left").value, kLeft_m, 3e-3 * kLeft_m) << yaw;
    EXPECT_NEAR(0.05 * said("right").value, kRight_m, 3e-3 * kRight_m);
    EXPECT_NEAR(0.3 * said("separation").value, kSeparation_m, 3e-3 * kSeparation_m);
    EXPECT_NEAR(std::remainder(said("marker_yaw").value - yaw, 2 * std::acos(-1.0)), 0, 3e-3);
    EXPECT_NEAR(said("marker_x").value, X_RS.x, 3e-3);
  }
}

TEST(RelativePoses, CoverWhatIsTrueNineTimesInTen) {
  int inside = 0, all = 0;
  for (std::uint64_t seed = 70; seed < 86; ++seed) {
    const Calibration said(driven(2, seed));
    const std::pair<const char*, double> kTrue[] = {
        {"left", kLeft_m / 0.05}, {"right", kRight_m / 0.05}, {"separation", kSeparation_m / 0.3},
        {"marker_x", kSensor.x},  {"marker_y", kSensor.y},    {"marker_yaw", kSensor.theta}};
    for (const auto& [name, value] : kTrue) {
      const Said s = said(name);
      EXPECT_TRUE(s.shown) << name;
      inside += s.lo <= value && value <= s.hi;
      ++all;
    }
  }
  // Six of a log err together, as if there were some forty: three standard deviations.
  EXPECT_GE(inside, all * 75 / 100);
  EXPECT_LT(inside, all);
}

TEST(RelativePoses, KnowThatTheyLackWhatOnlyTurnsShow) {
  const Calibration said(driven(4, 33, kSensor, false));
  EXPECT_FALSE(said("separation").shown);
  EXPECT_FALSE(said("marker_x").shown);
  EXPECT_TRUE(said("left").shown);
}

TEST(RelativePoses, AreNotTakenInAnotherUnitWhicheverWayTheSensorLooks) {
  RunLog log = driven(6, 31, {0.1, 0.02, 1.2});
  for (LoggedRun& run : log.runs) {
    for (PoseRow& row : run.poses)
      row.X_WM = {1000 * row.X_WM.x, 1000 * row.X_WM.y, row.X_WM.theta};
  }
  const auto asked = ask_what_changed(robot_by_its_maker(), log, {{kEachRow_s}, 0}, 1, nullptr);
  ASSERT_FALSE(asked);
  EXPECT_NE(asked.error().message.find("positions in millimetres"), std::string::npos)
      << asked.error().message;
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
