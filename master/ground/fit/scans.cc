#include "master/ground/fit/scans.h"

#include <cmath>
#include <limits>

#include "common/base/ranges.h"

namespace gapfarm {
namespace {

// Where to begin with another floor: changes of a grip's logarithm, and logarithms of its shape.
constexpr double kGripChanges[] = {0, -0.3, -0.7, -1.1, -1.6, -2.2, 0.5};
constexpr double kGripShapes[] = {0.7, 1.8};
constexpr double kNear_s = 1, kMiddle_s = 3, kFar_s = 10;  // either way of the file's delay

}  // namespace

Eigen::VectorXd best_held(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                          const Eigen::VectorXd& values, const std::vector<Eigen::VectorXd>& others,
                          std::optional<double> most) {
  Eigen::VectorXd best = values;
  if (!most) most = fitter.hold(rows, values).objective;
  for (const Eigen::VectorXd& other : others) {
    const double objective = fitter.hold(rows, other).objective;
    if (objective <= *most) continue;
    most = objective;
    best = other;
  }
  return best;
}

Eigen::VectorXd scan_delay(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                           const Eigen::VectorXd& values) {
  std::vector<Eigen::VectorXd> others;
  for (double size = 0.1; size <= kFar_s; size += size < kNear_s     ? 0.1
                                                  : size < kMiddle_s ? 0.25
                                                                     : 0.5) {
    for (const double shift : {size, -size}) {
      others.emplace_back(values)[row_index(rows, "delay")] += shift;
    }
  }
  return best_held(fitter, rows, values, others);
}

Eigen::VectorXd scan_grip(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                          const Eigen::VectorXd& values) {
  const Eigen::Index grip = row_index(rows, "grip"), shape = row_index(rows, "grip_shape");
  std::vector<Eigen::VectorXd> others;
  for (const double change : kGripChanges) {
    for (const double sharp : kGripShapes) {
      Eigen::VectorXd& moved = others.emplace_back(values);
      moved[grip] += change;
      moved[shape] = sharp;
    }
  }
  return best_held(fitter, rows, values, others);
}

Eigen::VectorXd scan_size(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                          const Eigen::VectorXd& values) {
  const KinematicRow& of = rows.back().row;
  std::vector<Eigen::VectorXd> others;
  for (double size = plausible_error(of); size > of.tolerance; size /= 2) {
    others.emplace_back(values)[values.size() - 1] = of.nominal + size;
  }
  return best_held(fitter, rows, values, others);
}

std::vector<Eigen::Vector2d> wheel_places(const WindowFitter& fitter, const WindowFit* far_from) {
  const Pose X_MR = inverse(fitter.robot().X_RM);
  const WindowSet& windows = fitter.windows();
  const auto misses = [&](std::size_t i) {
    const Eigen::Vector3d& scales = far_from->scales[static_cast<std::size_t>(windows.horizon[i])];
    return far_from->residuals[i].cwiseQuotient(scales).norm();
  };
  std::vector<Eigen::Vector2d> places;
  for (std::size_t i = 0; i < windows.trials.size(); ++i) {
    if (far_from != nullptr && misses(i) < kOutlierDeviations) continue;
    for (const RobotWheel& wheel : fitter.robot().wheels) {
      if (!wheel.driven) continue;
      const Pose at =
          windows.trials[i].X_WS * X_MR * Pose{wheel.x_m.value_or(0), wheel.y_m.value_or(0), 0};
      places.emplace_back(Eigen::Vector2d(at.x, at.y) - fitter.origin_m());
    }
  }
  return places;
}

double scatter_of(const std::vector<Eigen::Vector2d>& places) {
  const auto n = static_cast<double>(places.size());
  Eigen::Vector2d sum(0, 0);
  for (const Eigen::Vector2d& place : places) sum += place;
  const double squares =
      sum_of(places, [](const Eigen::Vector2d& place) { return place.squaredNorm(); });
  return std::sqrt(squares / n - (sum / n).squaredNorm());
}

namespace {

constexpr double kSteepest = 1e-6, kFlattest = 1e3;  // ramps, s^2/m

// A wheel's surface is commanded to a speed for so long.
struct Held {
  double dt_s, speed_m_s;
};

// Of each driven wheel, or of a steered robot's driven axle, of each run.
std::vector<std::vector<Held>> commanded_speeds(const GroundRobot& robot, const RunLog& log) {
  GroundRobot prompt = robot;
  prompt.motors.lag_s = prompt.motors.drive_lag_s = prompt.motors.delay_s = 0;
  prompt.motors.acceleration_limit_m_s2.reset();
  std::vector<std::vector<Held>> all;
  for (const LoggedRun& run : log.runs) {
    std::vector<std::vector<Held>> wheels(is_steered(robot) ? 1 : robot.wheels.size());
    RobotDrive drive(prompt, run.commands);
    for (std::size_t k = 0; k + 1 < run.commands.size(); ++k) {
      const double t = run.commands[k].t_s, dt = run.commands[k + 1].t_s - t;
      if (!(dt > 0)) continue;
      const auto motions = drive.advance_motors(t, dt, 0);
      for (std::size_t w = 0; w < wheels.size(); ++w) {
        const double speed = is_steered(robot) ? drive.traction_m_s() : motions[w].speed_m_s;
        wheels[w].push_back({dt, speed});
      }
    }
    append(all, std::move(wheels));
  }
  return all;
}

// How far wheels fall behind their commands, over how much these change.
double lateness_s(const std::vector<std::vector<Held>>& wheels, double ramp) {
  double behind_m = 0, changed_m_s = 0;
  for (const std::vector<Held>& wheel : wheels) {
    double speed = wheel.empty() ? 0 : wheel.front().speed_m_s, before = speed;
    for (const Held& held : wheel) {
      changed_m_s += std::abs(held.speed_m_s - before);
      before = held.speed_m_s;
      const double gap = std::abs(held.speed_m_s - speed);
      const double ramps_s = std::min(held.dt_s, gap * ramp), gained = ramps_s / ramp;
      behind_m += (gap - gained / 2) * ramps_s + (gap - gained) * (held.dt_s - ramps_s);
      speed += std::copysign(gained, held.speed_m_s - speed);
    }
  }
  return changed_m_s > 0 ? behind_m / changed_m_s : 0;
}

}  // namespace

double ramp_that_shows(const GroundRobot& robot, const RunLog& log, double ramp, double by_s) {
  const std::vector<std::vector<Held>> wheels = commanded_speeds(robot, log);
  const double late_s = lateness_s(wheels, std::max(ramp, kSteepest));
  double nearest = std::numeric_limits<double>::infinity();
  for (double end : {kSteepest, kFlattest}) {
    const auto shows = [&](double at) { return std::abs(lateness_s(wheels, at) - late_s) > by_s; };
    if (!shows(end)) continue;
    for (double same = ramp; std::abs(end - same) > 1e-3 * end;) {
      const double middle = (same + end) / 2;
      (shows(middle) ? end : same) = middle;
    }
    nearest = std::min(nearest, std::abs(end - ramp));
  }
  return nearest;
}

}  // namespace gapfarm
