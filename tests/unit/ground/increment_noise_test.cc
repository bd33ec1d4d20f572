// What a log states about its increments, and what it has beside them: covariances, a gyro,
// returns.
#include <fstream>

#include "common/recordings/run.h"
#include "tests/unit/ground/scan_matched.h"

namespace gapfarm::increment_noise_test {

using namespace scan_matched;

constexpr const char* kRatios[] = {"left", "right", "separation"};
double true_ratio(const std::string& name) {
  return name == "left" ? kLeft_m / 0.05 : name == "right" ? kRight_m / 0.05 : kSeparation_m / 0.3;
}

// The error of a heading shifts what lies a length ahead by their product to the side.
TEST(IncrementNoise, AddsUpAlongItsWay) {
  const Eigen::Matrix3d a = Eigen::Vector3d(1e-4, 4e-4, 9e-4).asDiagonal();
  const Eigen::Matrix3d b = Eigen::Vector3d(1e-6, 2e-6, 3e-6).asDiagonal();
  const Eigen::Matrix3d all = chained_noise({5, 6, std::acos(0.0)}, a, {2, 0, 0.3}, b);
  // Two metres ahead of a robot that looks along y are y's.
  EXPECT_NEAR(all(0, 0), 1e-4 + 4 * 9e-4 + 2e-6, 1e-12);
  EXPECT_NEAR(all(1, 1), 4e-4 + 1e-6, 1e-12);
  EXPECT_NEAR(all(2, 2), 9e-4 + 3e-6, 1e-12);
  EXPECT_NEAR(all(0, 2), -2 * 9e-4, 1e-12);
  EXPECT_NEAR(rotate_covariance(a, -std::acos(0.0))(0, 0), 4e-4, 1e-12);
}

// A row of a run with such columns; what a run begins with leads on from nowhere, and says nothing.
Result<RunLog> read_row(const std::string& columns, const std::string& numbers) {
  const std::string commands = testing::TempDir() + "noise_c.csv",
                    poses = testing::TempDir() + "noise_p.csv";
  std::string nothing;
  for (const char c : columns) nothing += c == ',' ? ",0" : "";
  std::ofstream(commands) << "run,t,left,right\n1,0,2,2\n";
  std::ofstream(poses) << "run,t,dx,dy,dtheta," + columns + "\n1,0,0,0,0,0" + nothing +
                              "\n1,0.5,0.1,0,0.2," + numbers + "\n";
  return read_runs(commands, poses, std::vector<std::string>{"left", "right"});
}

TEST(IncrementNoise, IsReadAsDeviationsOrAsACovariance) {
  const auto plain = read_row("sd_x,sd_y,sd_theta", "0.1,0.2,0.3");
  ASSERT_TRUE(plain) << plain.error().message;
  EXPECT_FALSE(plain->runs[0].poses[0].noise);
  EXPECT_NEAR((*plain->runs[0].poses[1].noise)(1, 1), 0.04, 1e-15);
  const auto full = read_row("cov_xx,cov_xy,cov_xt,cov_yy,cov_yt,cov_tt", "4,1,-1,9,0.5,1");
  ASSERT_TRUE(full) << full.error().message;
  const Eigen::Matrix3d C = *full->runs[0].poses[1].noise;
  EXPECT_EQ(C, C.transpose());
  EXPECT_EQ(C(0, 2), -1);
  EXPECT_EQ(C(1, 2), 0.5);
}

TEST(IncrementNoise, IsRefusedWithItsPlaceWhereItIsNone) {
  const std::string six = "cov_xx,cov_xy,cov_xt,cov_yy,cov_yt,cov_tt";
  const std::vector<std::vector<std::string>> kWrong = {
      {"sd_x,sd_y,sd_theta", "0.1,-0.2,0.3", "sd_y -0.2", "above 0 and up to 10 m"},
      {"sd_x,sd_y,sd_theta", "0.1,0.2,1e6", "sd_theta", "rad"},
      {"sd_x,sd_y,sd_theta", "0,0.2,0.3", "sd_x 0", "above 0"},
      {"sd_x,sd_theta", "0.1,0.2", "sd_y", "expected column"},
      {six, "4,7,0,9,0,1", "not positive definite", "cov_xy"},
      {six, "4,0,0,1e9,0,1", "cov_yy", "m^2"}};
  for (const auto& wrong : kWrong) {
    const auto log = read_row(wrong[0], wrong[1]);
    ASSERT_FALSE(log) << wrong[1];
    EXPECT_NE(log.error().message.find(wrong[2]), std::string::npos) << log.error().message;
    EXPECT_NE(log.error().message.find(wrong[3]), std::string::npos) << log.error().message;
    EXPECT_NE(log.error().message.find("noise_p.csv:"), std::string::npos) << log.error().message;
  }
}

// Two rows in three are ten times as unsure as the third: who knows which ones errs less, and is as
// often right about how much.  What is stated may be a factor off.
TEST(IncrementNoise, WeighsRowsByWhatTheyState) {
  const OfRows unknown{{{0.02, 0.02, 0.02}, {0.02, 0.002, 0.02}, {0.002, 0.002, 0.002}}};
  OfRows known = unknown;
  known.states = 5;
  double squares[2] = {0, 0};
  int inside = 0, all = 0;
  for (std::uint64_t seed = 40; seed < 52; ++seed) {
    const Calibration with(driven(2, seed, kSensor, true, known)),
        without(driven(2, seed, kSensor, true, unknown));
    for (const char* name : kRatios) {
      const Said said = with(name);
      squares[0] += std::pow(said.value - true_ratio(name), 2);
      squares[1] += std::pow(without(name).value - true_ratio(name), 2);
      inside += said.lo <= true_ratio(name) && true_ratio(name) <= said.hi;
      ++all;
    }
  }
  EXPECT_LT(squares[0], squares[1] / 4);
  EXPECT_GE(inside, all * 75 / 100);
  OfRows larger = known;
  larger.states = 50;
  const Calibration a(driven(2, 40, kSensor, true, known)), b(driven(2, 40, kSensor, true, larger));
  EXPECT_NEAR(a("separation").value, b("separation").value, 1e-6);
  EXPECT_NEAR(a("separation").hi, b("separation").hi, 1e-5);
}

// Headings of scans scatter by 20 mrad, a gyro's by a hundredth of that, with a bias for each run.
TEST(Gyro, MakesTurnsSurerWhateverItsBiases) {
  const OfRows alone{{{2e-3, 2e-3, 0.02}}};
  OfRows beside = alone;
  beside.gyro_rad_s = 2e-3;
  double squares[2] = {0, 0};
  int inside = 0, all = 0;
  for (std::uint64_t seed = 60; seed < 72; ++seed) {
    const Calibration with(driven(3, seed, kSensor, true, beside)),
        without(driven(3, seed, kSensor, true, alone));
    const Said said = with("separation"), scale = with(kGyroScale);
    const double truth = true_ratio("separation");
    squares[0] += std::pow(with("right").value / with("left").value - kRight_m / kLeft_m, 2);
    squares[1] += std::pow(without("right").value / without("left").value - kRight_m / kLeft_m, 2);
    inside += said.lo <= truth && truth <= said.hi;
    inside += scale.lo <= kGyroScaleTrue && kGyroScaleTrue <= scale.hi;
    all += 2;
  }
  EXPECT_LT(squares[0], squares[1] / 4);
  EXPECT_GE(inside, all * 75 / 100);
}

// A square, round to the left or to the right, by a robot that knows its true sizes.
std::vector<WheelSpeeds> square(double side) {
  std::vector<WheelSpeeds> rows;
  for (int corner = 0; corner < 4; ++corner) {
    for (int k = 0; k < 4; ++k) rows.push_back({0.2 / kLeft_m, 0.2 / kRight_m});
    const double v = side * std::acos(0.0) / (2 * kDt_s) * kSeparation_m / 2;
    for (int k = 0; k < 2; ++k) rows.push_back({-v / kLeft_m, v / kRight_m});
  }
  return rows;
}

// Scans whose headings are poor say little of the separation: loops that end where they began do.
TEST(Returns, ShowWhatPoorScansDoNot) {
  const OfRows poor{{{0.01, 0.01, 0.15}}};
  double squares[2] = {0, 0};
  int inside = 0, all = 0;
  for (std::uint64_t seed = 80; seed < 86; ++seed) {
    Stream stream({seed, Purpose::kTest, 0, 0, 0});
    std::vector<LoggedRun> runs;
    for (int r = 0; r < 2; ++r) {
      runs.push_back(
          scanned(std::to_string(r), square(r % 2 == 0 ? 1 : -1), kSensor, poor, stream));
    }
    const Calibration without(log_of(runs));
    for (LoggedRun& run : runs) run.returns.push_back({run.poses.back().t_s, {5e-3, 5e-3, 5e-3}});
    const Calibration with(log_of(runs));
    const Said said = with("separation");
    squares[0] += std::pow(said.value - true_ratio("separation"), 2);
    squares[1] += std::pow(without("separation").value - true_ratio("separation"), 2);
    inside += said.lo <= true_ratio("separation") && true_ratio("separation") <= said.hi;
    ++all;
  }
  EXPECT_LT(squares[0], squares[1] / 4);
  EXPECT_GE(inside, all - 2);
}

// Of rows that scatter alike headings add up as their number, and no surer than wheels roll.
TEST(Returns, AreAsSureAsTheirWay) {
  Stream stream({1, Purpose::kTest, 0, 0, 0});
  LoggedRun run = scanned("1", square(1), kSensor, {}, stream);
  run.returns.push_back({run.poses.back().t_s, {5e-3, 5e-3, 5e-3}});
  const auto windows = window_set(robot_by_its_maker(), log_of({run}), {{kEachRow_s, 2}, 0});
  ASSERT_TRUE(windows);
  ASSERT_EQ(windows->returns.size(), 1u);
  EXPECT_EQ(windows->sense_of(windows->trials.size() - 1), Sense::kReturn);
  EXPECT_NEAR(windows->returns[0].of_way(2, 2), 24, 1e-9);
  // The sides' ways, and the sensor's round the turns.
  const double turns = 2 * std::acos(-1.0) * (0.15 + std::hypot(kSensor.x, kSensor.y));
  EXPECT_NEAR(windows->returns[0].of_slip[2], 9e-4 * (1.6 + turns), 1e-4);
}

}  // namespace gapfarm::increment_noise_test
