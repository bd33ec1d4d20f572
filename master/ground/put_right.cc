#include "master/ground/put_right.h"

#include <algorithm>
#include <utility>

namespace gapfarm {
namespace {

constexpr double kMostTimes = 10'000;  // a run's clock may have been set in between

}  // namespace

std::function<void(RunLog*)> change_commands(std::function<void(std::vector<double>&)> change) {
  return [change = std::move(change)](RunLog* log) {
    for (LoggedRun& run : log->runs) {
      for (CommandRow& row : run.commands) change(row.values);
    }
  };
}

std::function<void(RunLog*)> change_increments(
    std::function<Pose(const Pose& before, const Pose& increment)> next) {
  return [next = std::move(next)](RunLog* log) {
    for (LoggedRun& run : log->runs) {
      Pose before, after;
      for (PoseRow& row : run.poses) {
        after = next(after, between(before, row.X_WM));
        before = std::exchange(row.X_WM, after);
      }
    }
  };
}

std::function<void(RunLog*)> change_poses(const Eigen::Matrix3d& L, double turn) {
  const auto changed = [L, turn](const Pose& X) {
    const Eigen::Vector3d v = L * Eigen::Vector3d(X.x, X.y, X.theta);
    return Pose{v[0], v[1], turn == 0 ? v[2] : wrap_angle(v[2] - turn)};
  };
  const auto chained = change_increments(
      [changed](const Pose& before, const Pose& X) { return before * changed(X); });
  return [L, changed, chained](RunLog* log) {
    if (log->relative) chained(log);
    for (LoggedRun& run : log->runs) {
      for (PoseRow& row : run.poses) {
        if (!log->relative) row.X_WM = changed(row.X_WM);
        if (row.noise) *row.noise = (L * *row.noise * L.transpose()).eval();
      }
    }
  };
}

std::function<void(RunLog*)> hold_commands(double step_s) {
  return [step_s](RunLog* log) {
    for (LoggedRun& run : log->runs) {
      std::vector<CommandRow> held;
      for (std::size_t i = 0; i < run.commands.size(); ++i) {
        const CommandRow& row = run.commands[i];
        const double last_s = run.poses.empty() ? row.t_s : run.poses.back().t_s;
        const double end_s = i + 1 < run.commands.size() ? run.commands[i + 1].t_s : last_s;
        const double times = std::clamp((end_s - row.t_s) / step_s, 0.0, kMostTimes);
        for (int k = 0; k <= times; ++k) held.push_back({row.t_s + k * step_s, row.values});
      }
      run.commands = std::move(held);
    }
  };
}

}  // namespace gapfarm
