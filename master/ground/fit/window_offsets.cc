// What a robot makes of commands that its kinematics have no word for, and how much less sure a
// window is for what happens in it: timing and gains err most where commands change and where the
// robot turns.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/math/algebra.h"
#include "master/ground/fit/window_fit.h"
#include "master/ground/tolerances.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr double kBefore_s = 0.3;  // of commands that still act
// Times a window's residuals may grow by for what a mean window has; none: they do not.
constexpr double kGrowth[] = {0, 0.3, 1, 3, 10, 30};
constexpr double kOpenOffset = 1;  // share; standard deviation before the log has its say
constexpr int kOffsetRounds = 3;

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

}  // namespace

std::vector<KinematicRow> command_offsets(const GroundRobot& robot) {
  std::vector<KinematicRow> rows;
  if (asked_by_channels(robot).cols() == 0) return rows;
  for (const char* what : {"ahead", "turn"}) {
    for (const char* by : {"_by_turn", "_by_side", "_by_turn_speed"}) {
      rows.push_back(
          {std::string(what) + by, 0, kAddedByTurnsSd, "share", "-", false, kOpenOffset});
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
  double most = -INFINITY;
  for (const double by_change : kGrowth) {
    for (const double by_turn : kGrowth) {
      std::vector<Eigen::Matrix3d> shapes;
      for (Eigen::Index i = 0; i < n; ++i) {
        const double grown = 1 + by_change * changes[i] + by_turn * turns[i];
        shapes.emplace_back(Eigen::Matrix3d::Identity() / grown);
      }
      const double nats = nats_shaped(fit, raw, shapes);
      if (nats <= most) continue;
      most = nats;
      shapes_ = std::move(shapes);
    }
  }
}

OffsetFit WindowFitter::fit_with_offsets(WindowFit fit) {
  const bool weighs = shapes_.empty();  // of a throttle they are shaped by speed
  for (const KinematicRow& row : command_offsets(robot_)) fit.rows.push_back({row, true});
  fit.values.conservativeResizeLike(Eigen::VectorXd::Zero(std::ssize(fit.rows)));
  for (int round = 0; round < kOffsetRounds; ++round) {
    if (weighs) weigh_by_commands(fit);
    fit = this->fit(fit.rows, {}, fit.values);
  }
  Eigen::MatrixXd H = prior_precision(fit.rows);
  for (const Equations& block : equations_of_blocks(fit)) H += block.H;
  return {fit.values, inverse_of_symmetric(H)};
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
