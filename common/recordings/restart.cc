#include "common/recordings/restart.h"

#include <algorithm>

namespace gapfarm {
namespace {

constexpr double kHalfSpan_s = 0.25;  // of poses, either side of a start, that show its speed

const PoseRow& pose_near(const std::vector<PoseRow>& poses, double t_s) {
  const auto after = std::lower_bound(poses.begin(), poses.end(), t_s,
                                      [](const PoseRow& p, double t) { return p.t_s < t; });
  if (after == poses.begin()) return poses.front();
  if (after == poses.end()) return poses.back();
  const auto before = after - 1;
  return t_s - before->t_s < after->t_s - t_s ? *before : *after;
}

CommandedRun one_run(const LoggedRun& run, const Trial& trial, double run_in_s, double margin_s) {
  CommandedRun to;
  to.start_s = std::max(run.poses.front().t_s, *trial.t_s - run_in_s);
  const PoseRow& from = pose_near(run.poses, to.start_s - kHalfSpan_s);
  const PoseRow& until = pose_near(run.poses, to.start_s + kHalfSpan_s);
  const double dt = until.t_s - from.t_s;
  if (dt > 0 && dt <= 4 * kHalfSpan_s) {
    const Twist xi = log(between(from.X_WM, until.X_WM));
    to.speed_m_s = xi[0] / dt;
    to.turn_rad_s = xi[2] / dt;
  }
  const double first = to.start_s - margin_s;
  const double last = *trial.t_s + *trial.duration_s + margin_s;
  for (std::size_t i = 0; i < run.commands.size(); ++i) {
    const bool over = i + 1 < run.commands.size() && run.commands[i + 1].t_s <= first;
    if (!over && (run.commands[i].t_s <= last || to.commands.empty())) {
      to.commands.push_back(run.commands[i]);
    }
  }
  return to;
}

}  // namespace

WindowedRuns restart_at_measured_speed(const RunLog& log, WindowedRuns windows, double run_in_s,
                                       double margin_s) {
  windows.runs.clear();
  for (Trial& trial : windows.log.trials) {
    windows.runs.push_back(one_run(log.runs[*trial.run], trial, run_in_s, margin_s));
    trial.run = static_cast<std::uint32_t>(windows.runs.size() - 1);
  }
  return windows;
}

}  // namespace gapfarm
