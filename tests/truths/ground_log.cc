#include "tests/truths/ground_log.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

namespace gapfarm::truths {
namespace {

using std::numbers::pi;

constexpr int kRuns = 4, kStepsARun = 15000, kStepsACommand = 50, kStepsAPose = 25;
constexpr double kRest_s = 5;  // between runs, by the log's clock

void drive(GroundTruth& robot, std::mt19937& random, const std::string& folder) {
  const auto between = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  std::normal_distribution<double> normal;
  std::ofstream commands(folder + "/commands.csv"), poses(folder + "/poses.csv");
  commands << "run,t";
  for (const std::string& channel : robot.channels()) commands << "," << channel;
  commands << "\n";
  poses << "run,t,x,y,theta\n";
  double aim[] = {0, 0};
  for (double& a : aim) a = between(-1.5, 1.5);
  std::vector<double> commanded;
  int ahead = 1;
  for (int k = 0; k < kRuns * kStepsARun; ++k) {
    const int run = k / kStepsARun + 1;
    const double t = k * kGroundStep_s + (run - 1) * kRest_s;
    const Pose X = robot.pose();
    if (k % kStepsACommand == 0) {
      const bool there = std::hypot(aim[0] - X.x, aim[1] - X.y) < 0.15;
      if (there || between(0, 1) < 0.004) {
        for (double& a : aim) a = between(-1.5, 1.5);
        ahead = between(0, 1) < 0.3 ? -1 : 1;
      }
      const double bearing = std::atan2(aim[1] - X.y, aim[0] - X.x) - X.theta;
      const double off = std::remainder(bearing + (ahead < 0 ? pi : 0), 2 * pi);
      commanded = robot.commands({t, ahead * 0.35 * between(0.7, 1.1), ahead, off, bearing});
      commands << run
               << fmt::format(",{:.4f},{:.5f}\n", t,
                              fmt::join(commanded.begin(), commanded.end(), ","));
    }
    if (k % kStepsAPose == 0) {
      const Pose seen = X * Pose{kMarkerX_m, kMarkerY_m, 0};
      double errors[3];
      for (double& error : errors) error = normal(random);
      poses << run
            << fmt::format(",{:.4f},{:.5f},{:.5f},{:.5f}\n", t, seen.x + 7e-4 * errors[0],
                           seen.y + 7e-4 * errors[1], seen.theta + 2e-3 * errors[2]);
    }
    robot.step(commanded);
  }
}

}  // namespace

int ground_log_program(const char* kinds, const GroundEngine& engine, int argc, char** argv) {
  if (argc != 7) {
    std::fprintf(stderr, "usage: %s %s tilt|edge|patch SIZE STIFFNESS SEED OUT\n", argv[0], kinds);
    return 2;
  }
  std::mt19937 random(static_cast<unsigned>(std::atoi(argv[5])));
  const auto between = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  const std::string out = argv[6];
  GroundSetting s{argv[1], argv[2], std::atof(argv[3]), std::atof(argv[4])};
  s.direction_rad = between(-pi, pi);
  s.x_m = between(-0.5, 0.5);
  s.y_m = between(-0.5, 0.5);
  s.radius_m = between(0.5, 0.8);
  std::filesystem::create_directories(out + "/log");
  const auto robot = engine(s);
  drive(*robot, random, out + "/log");
  std::ofstream(out + "/robot.toml")
      << robot->robot_file() << fmt::format("[marker]\nx = {}\ny = {}\n", kMarkerX_m, kMarkerY_m);
  std::ofstream(out + "/config.toml") << "scenario = \"ground\"\n[robot]\nfile = \"robot.toml\"\n"
                                         "[runs]\nfolders = [\"log\"]\n";
  std::ofstream(out + "/truth.txt")
      << fmt::format("direction {:.4f}\nx {:.4f}\ny {:.4f}\nradius {:.4f}\n", s.direction_rad,
                     s.x_m, s.y_m, s.radius_m);
  return 0;
}

}  // namespace gapfarm::truths
