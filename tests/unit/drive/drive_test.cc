#include "master/experiments/drive/drive.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/config/config.h"
#include "common/trials/read.h"
#include "tests/unit/blind/worker_farm.h"

namespace gapfarm::drive_drive_test {

using ::testing::HasSubstr;

class Drive : public ::testing::Test {
 protected:
  const Problem problem_ = parse_config(
                               "[parameters]\nstep_rate = 120\nfull_speed = 0.25\n"
                               "drive_noise_common = 0.05\ndrive_noise_side = 0.04\n"
                               "pose_noise_position = 0.003\npose_noise_heading = 0.02\n",
                               "known.toml")
                               .value()
                               .problem;
  tests::WorkerFarm farm_;
};

// A log simulated from a known model: of paths that the band has not seen 90 % lie inside, whole.
TEST_F(Drive, HeldOutPathsLieInsideTheBand) {
  const std::vector<CommandSpec> commands = {
      problem_.command("forward"), problem_.command("turn_ccw"), problem_.command("forward")};
  const Pose start{0.4, -0.2, 2.9};
  const auto runs = drive_commands(farm_, problem_, start, commands, 400, {.seed = 1});
  ASSERT_TRUE(runs.ok()) << runs.error().message;
  const auto log = drive_commands(farm_, problem_, start, commands, 400, {.seed = 2});
  ASSERT_TRUE(log.ok()) << log.error().message;
  const auto band = path_band(*runs, 0.9);
  double inside = 0;
  for (const DrivenRun& run : *log) inside += excursion(band, run) <= 1 ? 1 : 0;
  std::cout << 100 * inside / 400 << " % of 400 held-out paths lie inside the 90 % band\n";
  EXPECT_GE(inside / 400, 0.85);
  EXPECT_LE(inside / 400, 0.95);
}

// A model made of a log far from the origin counts places from the log's own middle.
TEST_F(Drive, PlacesOfTheModelCountFromItsFrame) {
  Problem seamed = problem_;
  seamed.values[seamed.table().row("camera_seam.offset_y")] = 0.1;
  seamed.values[seamed.table().row("camera_seam.position")] = 0.15;
  const std::vector<CommandSpec> commands = {problem_.command("forward")};
  DriveSettings framed;
  framed.frame_x_m = 100;
  framed.frame_y_m = -50;
  const auto expect_moved = [](const Result<std::vector<DrivenRun>>& runs,
                               const Result<std::vector<DrivenRun>>& moved) {
    ASSERT_TRUE(runs.ok() && moved.ok());
    for (std::size_t r = 0; r < runs->size(); ++r) {
      const Pose &a = (*runs)[r].back().path.back().pose, &b = (*moved)[r].back().path.back().pose;
      EXPECT_NEAR(b.x - a.x, 100, 1e-9);
      EXPECT_NEAR(b.y - a.y, -50, 1e-9);
      EXPECT_NEAR(a.y, 0.1, 0.05) << "the end lies beyond the seam";
    }
  };
  expect_moved(drive_commands(farm_, seamed, {}, commands, 8, {}),
               drive_commands(farm_, seamed, {100, -50, 0}, commands, 8, framed));
  expect_moved(drive_commands(simulated_mover(farm_, seamed, {}), {}, commands, 8),
               drive_commands(simulated_mover(farm_, seamed, framed), {100, -50, 0}, commands, 8));
}

TEST_F(Drive, WaypointsAreReachedUnderACamera) {
  const auto nominal = nominal_velocities(farm_, problem_);
  ASSERT_TRUE(nominal.ok()) << nominal.error().message;
  const auto pilot = make_pilot(*nominal);
  ASSERT_TRUE(pilot.ok()) << pilot.error().message;
  EXPECT_EQ(pilot->forward.command.name, "forward");
  EXPECT_EQ(pilot->left.command.name, "turn_ccw");
  EXPECT_EQ(pilot->right.command.name, "turn_cw");
  const std::vector<Eigen::Vector2d> targets = {{0.5, 0}, {0.5, 0.5}, {0, 0.5}};
  const auto mover = simulated_mover(farm_, problem_, {});
  const auto runs = drive_waypoints(mover, *pilot, {}, targets, 12);
  ASSERT_TRUE(runs.ok()) << runs.error().message;
  for (const DrivenRun& run : *runs) {
    ASSERT_EQ(run.size(), 6U);
    for (std::size_t i = 0; i < targets.size(); ++i) {
      const Pose& end = run[2 * i + 1].path.back().pose;
      EXPECT_NEAR(std::hypot(end.x - targets[i].x(), end.y - targets[i].y()), 0, 0.2);
    }
  }
  EXPECT_GT(end_ellipse(*runs, 0.9).major_m, 0.005) << "the drive is noisy";
  const auto steady = constant_velocity_mover(*nominal, {});
  const auto exact = drive_waypoints(steady, *pilot, {}, targets, 2);
  ASSERT_TRUE(exact.ok());
  const Pose& end = exact->front().back().path.back().pose;
  EXPECT_NEAR(end.x, 0, 0.02);
  EXPECT_NEAR(end.y, 0.5, 0.02);
  const auto far = drive_waypoints(steady, *pilot, {}, std::vector<Eigen::Vector2d>{{5, 0}}, 2);
  ASSERT_TRUE(far.ok()) << far.error().message;
  EXPECT_NEAR(far->front().back().path.back().pose.x, 5, 0.1);
  const auto beyond =
      drive_waypoints(steady, *pilot, {}, std::vector<Eigen::Vector2d>{{500, 0}}, 2);
  EXPECT_THAT(beyond.error().message, HasSubstr("way-point 500,0 takes"));
}

TEST_F(Drive, TheMinedModelSpreadsAsItsLogDoes) {
  const std::vector<CommandSpec> forward = {problem_.command("forward")};
  const auto runs = drive_commands(farm_, problem_, {}, forward, 200, {.seed = 3}).value();
  TrialLog log;
  for (const DrivenRun& run : runs) {
    Trial trial;
    trial.session = "s";
    trial.trial = static_cast<std::int64_t>(log.trials.size()) + 1;
    trial.command = "forward";
    trial.X_WS = run[0].path.front().pose;
    trial.X_WE = run[0].path.back().pose;
    log.trials.push_back(trial);
  }
  const auto mined = MotionModel::mine(log, problem_.commands);
  ASSERT_TRUE(mined.ok());
  const auto mover = mined_mover(*mined, {.seed = 4});
  const auto drawn = drive_commands(mover, {}, forward, 400);
  ASSERT_TRUE(drawn.ok()) << drawn.error().message;
  const EndEllipse real = end_ellipse(runs, 0.9), model = end_ellipse(*drawn, 0.9);
  EXPECT_NEAR(model.mean.x, real.mean.x, 0.004);
  EXPECT_NEAR(model.major_m / real.major_m, 1, 0.25);
  const auto other = drive_commands(mover, {}, {problem_.command("turn_cw")}, 2);
  EXPECT_THAT(other.error().message, HasSubstr("turn_cw"));

  DriveReport report;
  report.drivers.push_back({"simulation", runs, path_band(runs, 0.9), real, {}});
  EXPECT_THAT(drive_page(report, "Driven"), HasSubstr("Band that holds 90 %"));
  EXPECT_THAT(band_csv(report), HasSubstr("simulation,1,0.5,"));
}

TEST(WaypointLog, ReportsTargetsFromPoses) {
  const auto log = parse_waypoint_log(
      "23:59:59:000:000 [ SENT ] CAMPOSE 7 10 20 0.5 [ TO ] robot 7\n"
      "23:59:59:500:000 [ RECIEVED ] WAYPOINTS 7 2 100 0 200 50 [ FROM ] robot 7\n"
      "00:00:00:500:000 [ SENT ] CAMPOSE 7 30 20 0.25 [ TO ] robot 7\n"
      "00:00:01:000:000 [ RECIEVED ] WAYPOINTS 7 2 100 0 250 50 [ FROM ] robot 7\n"
      "00:00:02:000:000 [ RECIEVED ] WAYPOINTS 7 1 200 50 [ FROM ] robot 7\n"
      "00:00:03:000:000 [ RECIEVED ] WAYPOINTS 7 1 0 0 [ FROM ] robot 7\n"
      "00:00:03:000:000 [ SENT ] HELLO 7\n",
      "w.log");
  ASSERT_TRUE(log.ok()) << log.error().message;
  ASSERT_EQ(log->targets.size(), 2U) << "a new plan for the same target is no new target";
  EXPECT_EQ(log->targets[1], Eigen::Vector2d(2.0, 0.5));
  ASSERT_EQ(log->path.size(), 2U);
  EXPECT_NEAR(log->path[0].pose.x, 0.1, 1e-12);
  EXPECT_NEAR(log->path[1].t_s, 1, 1e-9) << "across midnight";
  const auto broken =
      parse_waypoint_log("10:00:00:000:000 [ SENT ] CAMPOSE 7 1 x 0 [ TO ]\n", "w.log");
  EXPECT_THAT(broken.error().message, HasSubstr("w.log:1:1"));
  EXPECT_THAT(parse_waypoint_log("", "w.log").error().message, HasSubstr("WAYPOINTS"));
}

}  // namespace gapfarm::drive_drive_test
