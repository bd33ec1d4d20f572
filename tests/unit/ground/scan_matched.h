// Runs whose poses are matched scans, each against the one before, of a robot with two wheels.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "common/math/statistics.h"
#include "common/random/stream.h"
#include "common/robot/robot.h"
#include "master/ground/reference.h"

namespace gapfarm::scan_matched {

// Half a metre a second at most, a sensor 0.1 m ahead that looks a little to the left.
inline constexpr double kLeft_m = 0.0515, kRight_m = 0.0492, kSeparation_m = 0.312;
inline const Pose kSensor{0.1, 0.02, 0.05};
inline constexpr double kGyroScaleTrue = 1.008;

inline GroundRobot robot_by_its_maker() {
  return *parse_robot(
      "drive = \"differential\"\ncommands = [\"left\", \"right\"]\nmeasured = true\n"
      "wheel_separation = 0.3\nwheel_radius = 0.05\n[marker]\nx = 0.12\n",
      "r.toml");
}

// How unsure rows are: standard deviations of x, y (m) and heading (rad), one after the other, and
// how well their matcher knows that.
struct OfRows {
  std::vector<Eigen::Vector3d> deviations = {Eigen::Vector3d::Constant(2e-3)};
  double states = 0;      // these times this is stated; 0: nothing is
  double gyro_rad_s = 0;  // scatter of a gyro's rates; 0: there is none
  double gyro_bias_rad_s = 0;
};

using WheelSpeeds = std::array<double, 2>;  // left, right; rad/s
inline constexpr double kDt_s = 0.5;

// A run whose rows are half a second long, each at wheel speeds of its own.
inline LoggedRun scanned(const std::string& name, const std::vector<WheelSpeeds>& rows,
                         const Pose& X_RS, const OfRows& of_rows, Stream& stream) {
  LoggedRun run;
  run.run = name;
  run.poses.push_back({0, {}});
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto& [left, right] = rows[k];
    const double t = static_cast<double>(k) * kDt_s;
    run.commands.push_back({t, {left, right}});
    const double way = (kLeft_m * left + kRight_m * right) / 2 * kDt_s;
    const double turn = (kRight_m * right - kLeft_m * left) / kSeparation_m * kDt_s;
    Pose X_SS = inverse(X_RS) * exp(Twist(way, 0, turn)) * X_RS;
    const Eigen::Vector3d& s = of_rows.deviations[k % of_rows.deviations.size()];
    X_SS.x += s[0] * stream.normal();
    X_SS.y += s[1] * stream.normal();
    X_SS.theta += s[2] * stream.normal();
    run.poses.push_back({t + kDt_s, run.poses.back().X_WM * X_SS});
    if (of_rows.states > 0) {
      run.poses.back().noise = (of_rows.states * s).cwiseAbs2().asDiagonal();
    }
    for (int i = 0; i <= 50 && of_rows.gyro_rad_s > 0; ++i) {
      const double rate = kGyroScaleTrue * turn / kDt_s + of_rows.gyro_bias_rad_s;
      run.yaw_rates.push_back(
          {t + 0.999999 * i / 50 * kDt_s, {rate + of_rows.gyro_rad_s * stream.normal()}});
    }
  }
  return run;
}

inline RunLog log_of(std::vector<LoggedRun> runs) {
  RunLog log;
  log.channels = {"left", "right"};
  log.relative = true;
  log.runs = std::move(runs);
  return log;
}

// Runs of a minute; matched scans err by 2 mm and 2 mrad unless rows are other.
inline RunLog driven(int runs, std::uint64_t seed, const Pose& X_RS = kSensor, bool turns = true,
                     OfRows of_rows = {}) {
  Stream stream({seed, Purpose::kTest, 0, 0, 0});
  std::vector<LoggedRun> all;
  for (int r = 0; r < runs; ++r) {
    std::vector<WheelSpeeds> rows;
    for (int k = 0; k < 120; ++k) {
      const double left = 2 + 6 * stream.uniform();
      const double straight = left * kLeft_m / kRight_m * (1 + 1e-9);
      rows.push_back({left, turns ? 2 + 6 * stream.uniform() : straight});
    }
    of_rows.gyro_bias_rad_s = 0.01 * (r + 1);
    all.push_back(scanned(std::to_string(r), rows, X_RS, of_rows, stream));
  }
  return log_of(std::move(all));
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

}  // namespace gapfarm::scan_matched
