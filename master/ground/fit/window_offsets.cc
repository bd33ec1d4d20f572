// What a robot makes of commands that its kinematics have no word for, and how much less sure a
// window is for what happens in it: timing and gains err most where commands change and where the
// robot turns.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/math/algebra.h"
#include "master/ground/fit/window_fit.h"
#include "master/ground/fit/window_prior.h"
#include "master/ground/tolerances.h"

namespace gapfarm {
namespace {

constexpr double kBefore_s = 0.3;  // of commands that still act
// Times a window's residuals may grow by for what a mean window has; none: they do not.
constexpr double kGrowth[] = {0, 0.3, 1, 3, 10, 30};
constexpr double kOffsetShare = 0.1;  // that they differ by from run to run
constexpr double kOpenOffset = 1;     // share; standard deviation before the log has its say
constexpr int kOffsetRounds = 6;
constexpr int kOffsetSteps = 8;  // of weights, a round
constexpr Eigen::Index kFeatures = 3;

// Of robots commanded by v and omega, or by the wheels of two sides.
class TwistReader {
 public:
  explicit TwistReader(const GroundRobot& robot) {
    half_m_ = robot.controller.wheel_separation_m.value_or(0) / 2;
    const RobotWheel* first = driven_wheel(robot);
    const double radius_m = first == nullptr ? 0 : *first->radius_m;
    Eigen::Index lefts = 0, rights = 0;
    const auto n = static_cast<Eigen::Index>(robot.channels.size());
    ahead_ = rim_ = Eigen::VectorXd::Zero(n);
    for (Eigen::Index c = 0; c < n; ++c) {
      const std::string& name = robot.channels[c];
      const bool left = name.find("left") != std::string::npos;
      const bool right = name.find("right") != std::string::npos;
      if (robot.command == CommandKind::kTwist) {
        ahead_[c] = name == "v" ? 1 : 0;
        rim_[c] = name == "omega" ? half_m_ : 0;
      } else if (robot.command == CommandKind::kWheelSpeeds && (left || right)) {
        ahead_[c] = radius_m;
        rim_[c] = left ? -radius_m : radius_m;
        (left ? lefts : rights) += 1;
      }
    }
    if (lefts + rights > 0) {
      ahead_ /= static_cast<double>(lefts + rights);
      rim_ /= static_cast<double>(lefts + rights);
    }
    known_ = !is_steered(robot) && !is_holonomic(robot) && half_m_ > 0 && rim_.norm() > 0;
  }

  bool known() const { return known_; }
  double half_m() const { return half_m_; }
  // Ahead, and of the rims: of a turn, half the wheels' separation from the middle; m/s.
  Eigen::Vector2d read(const std::vector<double>& values) const {
    const Eigen::Map<const Eigen::VectorXd> v(values.data(), ahead_.size());
    return {ahead_.dot(v), rim_.dot(v)};
  }

 private:
  double half_m_ = 0;
  Eigen::VectorXd ahead_, rim_;
  bool known_ = false;
};

double delay_of(const WindowFit& fit) {
  const Eigen::Index delay = row_index(fit.rows, "delay");
  return delay < 0 ? 0 : fit.values[delay];
}

// The first row that acts after a time.
std::size_t row_after(const CommandedRun& run, double t_s) {
  return static_cast<std::size_t>(
      std::ranges::upper_bound(run.commands, t_s, {}, &CommandRow::t_s) - run.commands.begin());
}

// How much each channel changes from row to row of a stretch of time.
Eigen::VectorXd variation(const CommandedRun& run, double from_s, double to_s) {
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(
      static_cast<Eigen::Index>(run.commands.empty() ? 0 : run.commands[0].values.size()));
  for (std::size_t k = std::max<std::size_t>(row_after(run, from_s), 1);
       k < run.commands.size() && run.commands[k].t_s < to_s; ++k) {
    for (Eigen::Index c = 0; c < sums.size(); ++c) {
      sums[c] += std::abs(run.commands[k].values[c] - run.commands[k - 1].values[c]);
    }
  }
  return sums;
}

// Metres ahead by whether a turn is commanded and by its sign, and metres of the rims.
Eigen::Vector3d exposure(const TwistReader& reader, const CommandedRun& run, double from_s,
                         double to_s) {
  Eigen::Vector3d sums = Eigen::Vector3d::Zero();
  for (std::size_t k = std::max<std::size_t>(row_after(run, from_s), 1) - 1;
       k < run.commands.size() && run.commands[k].t_s < to_s; ++k) {
    const double end_s = k + 1 < run.commands.size() ? run.commands[k + 1].t_s : to_s;
    const double held_s = std::min(end_s, to_s) - std::max(run.commands[k].t_s, from_s);
    const Eigen::Vector2d twist = reader.read(run.commands[k].values);
    const double ahead_m_s = twist[0], rim_m_s = twist[1];
    if (rim_m_s == 0 || held_s <= 0) continue;
    const double way = held_s * ahead_m_s;
    sums += Eigen::Vector3d(way, std::copysign(way, way * rim_m_s), held_s * std::abs(rim_m_s));
  }
  return sums;
}

}  // namespace

std::vector<KinematicRow> command_offsets(const GroundRobot& robot) {
  std::vector<KinematicRow> rows;
  if (!TwistReader(robot).known()) return rows;
  for (const char* what : {"ahead", "turn"}) {
    for (const char* by : {"_by_turn", "_by_side", "_by_turn_speed"}) {
      rows.push_back({std::string(what) + by, 0, kOffsetShare, "share", "-"});
    }
  }
  return rows;
}

void WindowFitter::weigh_by_commands(const WindowFit& fit) {
  const double delay = delay_of(fit);
  const auto n = static_cast<Eigen::Index>(windows_.trials.size());
  Eigen::VectorXd changes = Eigen::VectorXd::Zero(n), turns(n);
  Eigen::MatrixXd by_channel(robot_.channels.size(), n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Trial& trial = windows_.trials[i];
    const double from = *trial.t_s - delay - kBefore_s, to = *trial.t_s + *trial.duration_s - delay;
    by_channel.col(i) = variation(windows_.runs[*trial.run], from, to);
    turns[i] = std::abs(wrap_angle(trial.X_WE.theta - trial.X_WS.theta));
  }
  for (const auto& channel : by_channel.rowwise()) {
    if (channel.mean() > 0) changes += channel.transpose() / channel.mean();
  }
  if (turns.mean() > 0) turns /= turns.mean();
  const std::vector<Eigen::Vector3d> raw = raw_residuals(fit);
  const std::vector<double> use = uses({});
  Eigen::VectorXd best = Eigen::VectorXd::Ones(n);
  double most = -INFINITY;
  for (const double by_change : kGrowth) {
    for (const double by_turn : kGrowth) {
      const Eigen::VectorXd factors =
          (1 + by_change * changes.array() + by_turn * turns.array()).inverse();
      double logs = 0;
      WindowFit weighed = fit;
      for (std::size_t i = 0; i < raw.size(); ++i) {
        const double factor = factors[i];
        logs += 3 * use[i] * std::log(factor);
        weighed.residuals[i] = factor * raw[i];
      }
      rescale(&weighed, use);
      const double objective = score(&weighed, use) + logs;
      if (objective <= most) continue;
      most = objective;
      best = factors;
    }
  }
  shapes_.clear();
  for (const double factor : best) shapes_.emplace_back(factor * Eigen::Matrix3d::Identity());
}

std::vector<Eigen::MatrixXd> WindowFitter::offset_slopes(const WindowFit& fit) const {
  const TwistReader reader(robot_);
  const double delay = delay_of(fit);
  std::vector<Eigen::MatrixXd> slopes;
  for (std::size_t i = 0; i < windows_.trials.size() && reader.known(); ++i) {
    const Trial& trial = windows_.trials[i];
    const double from = *trial.t_s - delay;
    const Eigen::RowVector3d of =
        exposure(reader, windows_.runs[*trial.run], from, from + *trial.duration_s);
    const double half = wrap_angle(trial.X_WE.theta - trial.X_WS.theta) / 2;
    const double way = std::hypot(trial.X_WE.x - trial.X_WS.x, trial.X_WE.y - trial.X_WS.y);
    Eigen::MatrixXd B(3, 2 * kFeatures);
    // Even over the window, seen from the predicted end, which moves.
    B.leftCols(kFeatures) = -Eigen::Vector3d(std::cos(half), -std::sin(half), 0) * of;
    B.rightCols(kFeatures) = -Eigen::Vector3d(0, way / 2, 1) * of / reader.half_m();
    slopes.emplace_back(shapes_.empty() ? B : Eigen::MatrixXd(shapes_[i] * B));
  }
  if (slopes.empty()) slopes.assign(windows_.trials.size(), Eigen::MatrixXd(3, 0));
  return slopes;
}

OffsetFit WindowFitter::fit_with_offsets(WindowFit fit) {
  const std::vector<double> use = uses({});
  const auto n = fit.values.size();
  const bool weighs = shapes_.empty();  // of a throttle they are shaped by speed
  Eigen::VectorXd offsets;
  Eigen::MatrixXd H;
  for (int round = 0; round < kOffsetRounds; ++round) {
    if (weighs) weigh_by_commands(fit);
    const std::vector<Eigen::MatrixXd> B = offset_slopes(fit);
    const Eigen::Index m = B[0].cols();
    if (round == 0) offsets = Eigen::VectorXd::Zero(m);
    WindowFit at = fit;  // without offsets, for slopes
    at.residuals = residuals(fit.rows, fit.values);
    const std::vector<Eigen::MatrixXd> J = slopes(at);
    Eigen::MatrixXd P = Eigen::MatrixXd::Identity(n + m, n + m) / (kOpenOffset * kOpenOffset);
    P.topLeftCorner(n, n) = prior_precision(fit.rows);
    Eigen::VectorXd step = Eigen::VectorXd::Zero(n + m), away(n + m);
    for (int k = 0; k < kOffsetSteps; ++k) {
      for (std::size_t i = 0; i < use.size(); ++i) {
        fit.residuals[i] = at.residuals[i] + J[i] * step.head(n) + B[i] * (offsets + step.tail(m));
      }
      rescale(&fit, use);
      const std::vector<Eigen::Vector3d> curvature = curvature_shares(fit);
      away << fit.values - nominals(fit.rows) + step.head(n), offsets + step.tail(m);
      H = P;
      Eigen::MatrixXd A = P;
      Eigen::VectorXd g = P * away;
      Eigen::MatrixXd slope(3, n + m);
      for (std::size_t i = 0; i < use.size(); ++i) {
        slope << J[i], B[i];
        const auto h = static_cast<std::size_t>(windows_.horizon[i]);
        for (Eigen::Index c = 0; c < 3; ++c) {
          const double w = use[i] * window_weight(fit.residuals[i][c], fit.scales[h][c]);
          A += w * slope.row(c).transpose() * slope.row(c);
          H += w * curvature[h][c] * slope.row(c).transpose() * slope.row(c);
          g += w * slope.row(c).transpose() * fit.residuals[i][c];
        }
      }
      step -= solve_symmetric(A, g);
    }
    fit.values += step.head(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      fit.values[k] = std::max(fit.values[k], least_value(fit.rows[k].row));
    }
    offsets += step.tail(m);
    fit.residuals = residuals(fit.rows, fit.values);
    for (std::size_t i = 0; i < use.size(); ++i) fit.residuals[i] += B[i] * offsets;
  }
  OffsetFit all{Eigen::VectorXd(n + offsets.size()), inverse_of_symmetric(H)};
  all.values << fit.values, offsets;
  return all;
}

WindowFit WindowFitter::within_runs(WindowFit fit) const {
  std::vector<Eigen::Vector3d> travel(fit.residuals.size(), Eigen::Vector3d::Zero());
  std::vector<Eigen::Vector2d> sums(windows_.runs.size(), Eigen::Vector2d(0, 1e-12));
  for (std::size_t i = 0; i < travel.size(); ++i) {
    if (windows_.sense_of(i) != Sense::kPose) continue;
    const Pose& X_WE = windows_.trials[i].X_WE;
    travel[i] =
        local_difference({windows_.trials[i].X_WS.x, windows_.trials[i].X_WS.y, X_WE.theta}, X_WE);
    if (!shapes_.empty()) travel[i] = shapes_[i] * travel[i];
    const Eigen::Vector3d& s = fit.scales[static_cast<std::size_t>(windows_.horizon[i])];
    for (Eigen::Index c = 0; c < 3; ++c) {
      const double w = window_weight(fit.residuals[i][c], s[c]) * travel[i][c];
      sums[windows_.run_of[i]] += w * Eigen::Vector2d(fit.residuals[i][c], travel[i][c]);
    }
  }
  for (std::size_t i = 0; i < travel.size(); ++i) {
    const Eigen::Vector2d& sum = sums[windows_.run_of[i]];
    fit.residuals[i] -= sum[0] / sum[1] * travel[i];
  }
  const std::vector<double> use = uses({});
  rescale(&fit, use);
  score(&fit, use);
  return fit;
}

}  // namespace gapfarm
