#include "common/score/kinematic.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <span>

#include "common/robot/robot_drive.h"

namespace gapfarm {
namespace {

constexpr double kStep_s = 0.02;
constexpr double kScan_s = 1;  // of the delay, either way
constexpr double kScanStep_s = 0.05;
constexpr double kHuber = 2;     // robust standard deviations
constexpr int kRounds = 3;       // of weights
constexpr int kIterations = 12;  // of least squares a round

bool steered(const GroundRobot& robot) {
  return robot.drive == DriveKind::kAckermann || robot.drive == DriveKind::kTricycle;
}
bool holonomic(const GroundRobot& robot) {
  return robot.drive == DriveKind::kOmni || robot.drive == DriveKind::kMecanum;
}

// One number of the fit: where it is in a robot, or which gain of the motion.
struct Row {
  const char* name;
  double nominal;
};

std::vector<Row> rows_of(const GroundRobot& robot) {
  std::vector<Row> rows;
  if (holonomic(robot)) {
    rows = {{"ahead", 1}, {"aside", 1}, {"turn", 1}};
  } else if (!steered(robot)) {
    rows = {{"left", 1}, {"right", 1}, {"separation", 1}};
  } else {
    rows = {{"steering_gain", 1},
            {"steering_offset", 0},
            {"understeer", robot.steering.understeer_s2_m2}};
    if (robot.command == CommandKind::kThrottleSteering) {
      const RobotThrottle& t = robot.throttle;
      rows.insert(rows.end(), {{"gain", t.gain},
                               {"zero", t.zero},
                               {"back_emf", t.back_emf},
                               {"drag", t.drag},
                               {"coulomb", t.coulomb},
                               {"cornering", t.cornering}});
    } else {
      rows.push_back({"ahead", 1});
    }
  }
  rows.insert(rows.end(), {{"lag", robot.motors.lag_s},
                           {"delay", robot.motors.delay_s},
                           {"marker_x", robot.X_RM.x},
                           {"marker_y", robot.X_RM.y},
                           {"marker_yaw", robot.X_RM.theta}});
  return rows;
}

// The robot and the gains of its motion at some values.
class Body {
 public:
  Body(const GroundRobot& robot, const Kinematics& at) : robot_(robot) {
    for (std::size_t i = 0; i < at.names.size(); ++i) {
      put(at.names[i], at.values[static_cast<Eigen::Index>(i)]);
    }
    if (holonomic(robot_)) invert_wheels();
    const auto& k = robot_.controller;
    separation_ *= k.wheel_separation_m.value_or(1) * k.wheel_separation_multiplier;
  }

  const GroundRobot& robot() const { return robot_; }

  Twist velocity(std::span<const WheelMotion> wheels, const RobotDrive& drive) const {
    if (steered(robot_)) {
      const double v = ahead_ * drive.traction_m_s();
      return {v, 0, v * drive.curvature()};
    }
    if (holonomic(robot_)) {
      Eigen::VectorXd speeds(inverse_.cols());
      Eigen::Index n = 0;
      for (std::size_t i = 0; i < wheels.size(); ++i) {
        const RobotWheel& w = robot_.wheels[i];
        if (w.driven) speeds[n++] = wheels[i].speed_m_s * std::cos(w.roller_angle_rad);
      }
      const Eigen::Vector3d twist = inverse_ * speeds;
      return {ahead_ * twist[0], aside_ * twist[1], turn_ * twist[2]};
    }
    double sum[2] = {0, 0};
    double count[2] = {0, 0};
    for (std::size_t i = 0; i < wheels.size(); ++i) {
      if (!robot_.wheels[i].driven) continue;
      const int side = robot_.wheels[i].side == WheelSide::kLeft ? 0 : 1;
      sum[side] += wheels[i].speed_m_s;
      count[side] += 1;
    }
    const double l = left_ * sum[0] / std::max(count[0], 1.0);
    const double r = right_ * sum[1] / std::max(count[1], 1.0);
    return {(l + r) / 2, 0, (r - l) / separation_};
  }

 private:
  void put(const std::string& name, double value) {
    RobotThrottle& t = robot_.throttle;
    if (name == "left") left_ = value;
    if (name == "right") right_ = value;
    if (name == "separation") separation_ = value;
    if (name == "ahead") ahead_ = value;
    if (name == "aside") aside_ = value;
    if (name == "turn") turn_ = value;
    if (name == "steering_gain") robot_.steering.gain *= value;
    if (name == "steering_offset") robot_.steering.offset_rad += value;
    if (name == "understeer") robot_.steering.understeer_s2_m2 = value;
    if (name == "gain") t.gain = value;
    if (name == "zero") t.zero = value;
    if (name == "back_emf") t.back_emf = std::abs(value);
    if (name == "drag") t.drag = std::abs(value);
    if (name == "coulomb") t.coulomb = std::abs(value);
    if (name == "cornering") t.cornering = std::abs(value);
    if (name == "lag") robot_.motors.lag_s = std::abs(value);
    if (name == "delay") robot_.motors.delay_s = value;
    if (name == "marker_x") robot_.X_RM.x = value;
    if (name == "marker_y") robot_.X_RM.y = value;
    if (name == "marker_yaw") robot_.X_RM.theta = value;
  }

  // e1 (v + w x p) = s of every driven wheel, in the least-squares sense.
  void invert_wheels() {
    std::vector<Eigen::RowVector3d> rows;
    for (const RobotWheel& w : robot_.wheels) {
      if (!w.driven) continue;
      const double e1 = w.heading_rad + w.roller_angle_rad;
      const double c = std::cos(e1), s = std::sin(e1);
      rows.emplace_back(c, s, *w.x_m * s - *w.y_m * c);
    }
    Eigen::MatrixXd A(static_cast<Eigen::Index>(rows.size()), 3);
    for (std::size_t i = 0; i < rows.size(); ++i) A.row(static_cast<Eigen::Index>(i)) = rows[i];
    inverse_ = A.completeOrthogonalDecomposition().pseudoInverse();
  }

  GroundRobot robot_;
  double left_ = 1, right_ = 1, separation_ = 1, ahead_ = 1, aside_ = 1, turn_ = 1;
  Eigen::MatrixXd inverse_;
};

// The robot's way through one run, at the times that are asked for.
std::map<double, Pose> way(const Body& body, const CommandedRun& run,
                           const std::vector<double>& times) {
  std::map<double, Pose> poses;
  RobotDrive drive(body.robot(), run.commands, run.speed_m_s);
  Pose X;
  double omega = run.turn_rad_s;
  std::size_t next = 0;
  for (long step = 0; next < times.size(); ++step) {
    const double t = run.start_s + static_cast<double>(step) * kStep_s;
    const auto wheels = drive.advance(t, kStep_s, omega);
    const Twist v = body.velocity(wheels, drive);
    omega = v[2];
    for (; next < times.size() && times[next] < t + kStep_s; ++next) {
      poses[times[next]] = X * exp(Twist((times[next] - t) * v));
    }
    X = X * exp(Twist(kStep_s * v));
  }
  return poses;
}

// Residuals of every trial in the predicted end's axes.
std::vector<Eigen::Vector3d> residuals(const Problem& problem, const Kinematics& at) {
  const std::vector<Pose> ends = kinematic_ends(problem, at);
  std::vector<Eigen::Vector3d> r;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    r.push_back(local_difference(ends[i], problem.log.trials[i].X_WE));
  }
  return r;
}

double robust_scale(const std::vector<Eigen::Vector3d>& r, int from, int to) {
  std::vector<double> sizes;
  for (const Eigen::Vector3d& d : r) {
    for (int c = from; c < to; ++c) sizes.push_back(std::abs(d[c]));
  }
  const auto middle = sizes.begin() + static_cast<long>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return std::max(1.4826 * *middle, 1e-6);
}

Eigen::VectorXd weighted(const std::vector<Eigen::Vector3d>& r, const Eigen::VectorXd& weights) {
  Eigen::VectorXd all(weights.size());
  for (std::size_t i = 0; i < r.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(3 * i);
    all.segment<3>(row) = weights.segment<3>(row).cwiseProduct(r[i]);
  }
  return all;
}

// 1 / s.d. of each residual, less beyond kHuber of them.
Eigen::VectorXd weights_of(const std::vector<Eigen::Vector3d>& r) {
  const double m = robust_scale(r, 0, 2);
  const double rad = robust_scale(r, 2, 3);
  Eigen::VectorXd weights(static_cast<Eigen::Index>(3 * r.size()));
  for (std::size_t i = 0; i < r.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const double scale = c < 2 ? m : rad;
      const double size = std::abs(r[i][c]) / scale;
      weights[static_cast<Eigen::Index>(3 * i) + c] =
          std::sqrt(std::min(1.0, kHuber / std::max(size, 1e-9))) / scale;
    }
  }
  return weights;
}

void descend(const Problem& problem, const Eigen::VectorXd& weights, Kinematics* at) {
  const auto cost_at = [&](const Kinematics& k) {
    return weighted(residuals(problem, k), weights);
  };
  Eigen::VectorXd r = cost_at(*at);
  double damping = 1e-3;
  const Eigen::Index n = at->values.size();
  for (int it = 0; it < kIterations; ++it) {
    Eigen::MatrixXd J(r.size(), n);
    for (Eigen::Index i = 0; i < n; ++i) {
      Kinematics moved = *at;
      const double step = 1e-4 * std::max(1.0, std::abs(at->values[i]));
      moved.values[i] += step;
      J.col(i) = (cost_at(moved) - r) / step;
    }
    const Eigen::MatrixXd H = J.transpose() * J;
    const Eigen::VectorXd g = J.transpose() * r;
    bool better = false;
    for (int attempt = 0; attempt < 6 && !better; ++attempt) {
      Eigen::MatrixXd damped = H;
      damped.diagonal() += damping * H.diagonal() + Eigen::VectorXd::Constant(n, 1e-9);
      Kinematics moved = *at;
      moved.values -= damped.ldlt().solve(g);
      const Eigen::VectorXd next = cost_at(moved);
      better = next.squaredNorm() < r.squaredNorm();
      if (better) {
        const double gained = 1 - next.squaredNorm() / r.squaredNorm();
        *at = moved;
        r = next;
        damping = std::max(damping / 5, 1e-9);
        if (gained < 1e-5) return;
      } else {
        damping *= 10;
      }
    }
    if (!better) return;
  }
}

}  // namespace

Kinematics nominal_kinematics(const GroundRobot& robot) {
  Kinematics k;
  const std::vector<Row> rows = rows_of(robot);
  k.values.resize(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    k.names.emplace_back(rows[i].name);
    k.values[static_cast<Eigen::Index>(i)] = rows[i].nominal;
  }
  return k;
}

std::vector<Pose> kinematic_ends(const Problem& problem, const Kinematics& kinematics) {
  const Body body(problem.ground->robot(), kinematics);
  std::vector<std::vector<double>> times(problem.runs.size());
  for (const Trial& trial : problem.log.trials) {
    times[*trial.run].push_back(*trial.t_s);
    times[*trial.run].push_back(*trial.t_s + *trial.duration_s);
  }
  std::vector<std::map<double, Pose>> ways(problem.runs.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    std::sort(times[i].begin(), times[i].end());
    if (!times[i].empty()) ways[i] = way(body, problem.runs[i], times[i]);
  }
  const Pose& X_RM = body.robot().X_RM;
  std::vector<Pose> ends;
  for (const Trial& trial : problem.log.trials) {
    const auto& poses = ways[*trial.run];
    const Pose X_SE = between(poses.at(*trial.t_s), poses.at(*trial.t_s + *trial.duration_s));
    ends.push_back(trial.X_WS * inverse(X_RM) * X_SE * X_RM);
  }
  return ends;
}

Result<Kinematics> fit_kinematics(const Problem& problem) {
  if (problem.log.trials.empty() || !problem.ground) {
    return Error{"kinematics need windows of logged runs, but there are none"};
  }
  Kinematics best = nominal_kinematics(problem.ground->robot());
  const auto delay = std::find(best.names.begin(), best.names.end(), "delay") - best.names.begin();
  const double own = best.values[delay];
  double least = 0;
  for (double shift = -kScan_s; shift <= kScan_s + 1e-9; shift += kScanStep_s) {
    Kinematics moved = best;
    moved.values[delay] = own + shift;
    const double scale = robust_scale(residuals(problem, moved), 0, 3);
    if (least == 0 || scale < least) {
      least = scale;
      best.values[delay] = own + shift;
    }
  }
  for (int round = 0; round < kRounds; ++round) {
    descend(problem, weights_of(residuals(problem, best)), &best);
  }
  const std::vector<Eigen::Vector3d> r = residuals(problem, best);
  for (const Eigen::Vector3d& d : r) {
    best.rms_m += d.head<2>().squaredNorm() / static_cast<double>(r.size());
    best.rms_rad += d[2] * d[2] / static_cast<double>(r.size());
  }
  best.rms_m = std::sqrt(best.rms_m);
  best.rms_rad = std::sqrt(best.rms_rad);
  return best;
}

}  // namespace gapfarm
