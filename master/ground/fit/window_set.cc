#include "master/ground/fit/window_set.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "common/base/ranges.h"
#include "common/recordings/run.h"
#include "master/ground/tolerances.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr double kUsualWindow_s = 2.5;  // the mean of GroundWork's

bool alike(const std::vector<Trial>& a, std::size_t from_a, const std::vector<Trial>& b) {
  if (a.size() - from_a != b.size()) return false;
  for (std::size_t i = 0; i < b.size(); ++i) {
    const Trial& x = a[from_a + i];
    if (x.run != b[i].run || x.t_s != b[i].t_s || x.duration_s != b[i].duration_s) return false;
  }
  return true;
}

std::size_t pose_at(const LoggedRun& run, double t_s) {
  const auto found = std::ranges::lower_bound(run.poses, t_s - 1e-9, {}, &PoseRow::t_s);
  const auto at = static_cast<std::size_t>(found - run.poses.begin());
  return std::min(at, run.poses.size() - 1);
}

// Of a window's end in its axes, by the increments in it; none where one of them does not say.
std::optional<Eigen::Matrix3d> noise_of_window(const LoggedRun& run, const Trial& trial) {
  const std::size_t from = pose_at(run, *trial.t_s);
  const std::size_t end = pose_at(run, *trial.t_s + *trial.duration_s);
  Pose X;
  Eigen::Matrix3d noise = Eigen::Matrix3d::Zero();
  for (std::size_t k = from + 1; k <= end; ++k) {
    if (!run.poses[k].noise) return {};
    const Pose step = between(run.poses[k - 1].X_WM, run.poses[k].X_WM);
    noise = chained_noise(X, noise, step, *run.poses[k].noise);
    X = X * step;
  }
  return rotate_covariance(noise, -X.theta);
}

void add_gyro(const RunLog& log, WindowSet* set) {
  const std::size_t count = set->trials.size();
  bool any = false;
  for (std::size_t i = 0; i < count; ++i) {
    const Trial trial = set->trials[i];
    const auto turned = turned_between(log.runs[set->run_of[i]].yaw_rates, *trial.t_s,
                                       *trial.t_s + *trial.duration_s);
    if (!turned) continue;
    set->turned_rad.resize(set->trials.size());
    set->turned_rad.push_back(*turned);
    set->add(trial, set->horizon[i] + set->lengths, set->run_of[i]);
    any = true;
  }
  if (any) set->horizons += set->lengths;
}

// How errors of a window's end, in its axes, shift the end of the way: squares of the shares.
Eigen::Matrix3d squared_shares(const Pose& X_EF) {
  const Pose back = inverse(X_EF);
  const double c = std::cos(back.theta), s = std::sin(back.theta);
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  J.row(0) = Eigen::RowVector3d(c, -s, back.y);
  J.row(1) = Eigen::RowVector3d(s, c, -back.x);
  return J.cwiseAbs2();
}

void add_returns(const GroundRobot& robot, const RunLog& log, WindowSet* set) {
  const double arm_m = robot.controller.wheel_separation_m.value_or(0) / 2;
  const std::size_t count = set->trials.size();
  for (std::size_t r = 0; r < log.runs.size(); ++r) {
    const LoggedRun& run = log.runs[r];
    for (const CommandRow& row : run.returns) {
      const std::size_t end = run.poses.empty() ? 0 : pose_at(run, row.t_s);
      if (end == 0 || set->runs.size() != log.runs.size()) continue;
      const Trial trial = window_between(log, r, 0, end, set->trials.size());
      Return back;
      for (Eigen::Index k = 0; k < 3; ++k) {
        back.variance[k] = std::pow(row.values[static_cast<std::size_t>(k)], 2);
      }
      for (std::size_t i = 0; i < count; ++i) {
        const Trial& part = set->trials[i];
        const double end_s = *part.t_s + *part.duration_s;
        if (set->horizon[i] != 0 || set->run_of[i] != r || end_s > run.poses[end].t_s) continue;
        const Eigen::Matrix3d shares = squared_shares(between(part.X_WE, trial.X_WE));
        const Pose moved = between(part.X_WS, part.X_WE);
        const double way_m = std::hypot(moved.x, moved.y) + arm_m * std::abs(moved.theta);
        back.of_way += shares;
        back.of_slip += kSlip * kSlip * way_m * shares.rowwise().sum();
      }
      if (skids(robot)) back.of_slip.setConstant(std::numeric_limits<double>::infinity());
      set->add(trial, set->horizons++, r);
      set->returns.push_back(back);
    }
  }
  if (!set->turned_rad.empty()) set->turned_rad.resize(set->trials.size());
}

void add_noise(const RunLog& log, WindowSet* set) {
  if (!log.relative) return;
  for (std::size_t i = 0; i < set->trials.size(); ++i) {
    const auto noise = noise_of_window(log.runs[set->run_of[i]], set->trials[i]);
    if (!noise) {
      set->noise.clear();
      return;
    }
    set->noise.push_back(*noise);
  }
}

void add_blocks(const RunLog& log, WindowSet* set) {
  std::vector<double> begin(log.runs.size()), length(log.runs.size());
  double all = 0;
  for (std::size_t i = 0; i < log.runs.size(); ++i) {
    if (log.runs[i].poses.size() < 2) continue;
    begin[i] = log.runs[i].poses.front().t_s;
    length[i] = log.runs[i].poses.back().t_s - begin[i];
    all += length[i];
  }
  // Stretches of one length, none over two runs.
  std::vector<int>& first = set->run_blocks;
  first.resize(log.runs.size());
  const std::size_t least = log.relative ? kLeastRelativeBlocks : kEnoughToScatter;
  const bool few = log.runs.size() < least;
  for (std::size_t i = 0; i < log.runs.size(); ++i) {
    first[i] = set->blocks;
    const double pieces =
        few ? std::ceil(static_cast<double>(least) * length[i] / std::max(all, 1e-9)) : 1;
    set->blocks += std::max(1, static_cast<int>(pieces));
  }
  for (std::size_t i = 0; i < set->trials.size(); ++i) {
    const Trial& trial = set->trials[i];
    const std::size_t run = set->run_of[i];
    const int pieces = set->blocks_of(run);
    const double middle = *trial.t_s + *trial.duration_s / 2 - begin[run];
    const int piece = static_cast<int>(pieces * middle / std::max(length[run], 1e-9));
    set->block.push_back(first[run] + std::clamp(piece, 0, pieces - 1));
  }
}

}  // namespace

std::string WindowSet::length_text(int of_horizon) const {
  const double length_s = lengths_s[static_cast<std::size_t>(of_horizon % lengths)];
  return length_s == kEachRow_s ? "a row" : fmt::format("{:g} s", length_s);
}

double WindowSet::stretches() const {
  const auto of_poses = std::ranges::count_if(horizon, [this](int h) { return h < lengths; });
  return static_cast<double>(of_poses) / lengths;
}

Result<WindowSet> pose_windows(const RunLog& log, const WindowSettings& settings, bool restarts,
                               bool once) {
  WindowSet set;
  std::size_t last = 0;
  for (const double horizon : settings.horizons_s) {
    auto cut = cut_windows(log, {{horizon}, settings.run_in_s});
    if (!cut) continue;
    if (once && !restarts && set.horizons > 0 && alike(set.trials, last, cut->log.trials)) continue;
    last = set.trials.size();
    const std::vector<std::size_t> run_of =
        mapped(cut->log.trials, [](const Trial& t) { return std::size_t{*t.run}; });
    if (restarts) {
      *cut = restart_at_measured_speed(log, std::move(*cut), settings.run_in_s, kClocksApart_s);
      for (Trial& trial : cut->log.trials) *trial.run += static_cast<std::uint32_t>(last);
      set.runs.insert(set.runs.end(), cut->runs.begin(), cut->runs.end());
    } else {
      set.runs = std::move(cut->runs);
    }
    for (std::size_t i = 0; i < run_of.size(); ++i) {
      set.add(std::move(cut->log.trials[i]), set.horizons, run_of[i]);
    }
    ++set.horizons;
    set.lengths_s.push_back(horizon);
  }
  if (set.trials.empty()) return Error{"no window of any horizon fits into the runs"};
  set.lengths = set.horizons;
  return set;
}

Result<WindowSet> window_set(const GroundRobot& robot, const RunLog& log,
                             const WindowSettings& settings) {
  ASSIGN_OR_RETURN(auto set, pose_windows(log, settings, is_throttled(robot), true));
  for (const Trial& trial : set.trials) set.origin_m += Eigen::Vector2d(trial.X_WS.x, trial.X_WS.y);
  set.origin_m /= static_cast<double>(set.trials.size());
  if (set.lengths_s.back() == kEachRow_s) {
    const double row_s = mean(mapped(set.trials, [](const Trial& t) { return *t.duration_s; }));
    set.counts = std::min(1.0, row_s / kUsualWindow_s);
  }
  add_noise(log, &set);
  add_gyro(log, &set);
  add_returns(robot, log, &set);
  if (!set.noise.empty()) set.noise.resize(set.trials.size(), Eigen::Matrix3d::Identity());
  add_blocks(log, &set);
  return set;
}

}  // namespace gapfarm
