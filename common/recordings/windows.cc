#include "common/recordings/windows.h"

#include <algorithm>
#include <utility>

namespace gapfarm {
namespace {

constexpr double kGyroGap_s = 0.25;    // a longer one between two rates shows no turn
constexpr double kSlack = 0.1;         // of a horizon: how much earlier a window may end
constexpr double kGap = 1.5;           // horizons: a longer way to the next pose is a gap
constexpr double kSpeedSpan_s = 0.25;  // over which the speed at a run's start is measured
constexpr std::size_t kLeastPoses = 2;

bool stands(const CommandRow& row) {
  return std::all_of(row.values.begin(), row.values.end(), [](double v) { return v == 0; });
}

double median_interval(const std::vector<PoseRow>& poses) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    intervals.push_back(poses[i].t_s - poses[i - 1].t_s);
  }
  std::nth_element(intervals.begin(), intervals.begin() + static_cast<long>(intervals.size() / 2),
                   intervals.end());
  return intervals[intervals.size() / 2];
}

// Of the marker, by two poses that are not too far apart in time.
void measure_speed(const PoseRow& from, const PoseRow& until, double most_s, CommandedRun* to) {
  const double dt = until.t_s - from.t_s;
  if (!(dt > 0 && dt <= most_s)) return;
  const Twist xi = log(between(from.X_WM, until.X_WM));
  to->speed_m_s = xi[0] / dt;
  to->turn_rad_s = xi[2] / dt;
}

CommandedRun commanded(const LoggedRun& run) {
  CommandedRun to;
  to.commands = run.commands;
  to.start_s = run.poses.front().t_s;
  const auto later = std::ranges::find_if(
      run.poses, [&](const PoseRow& p) { return p.t_s >= to.start_s + kSpeedSpan_s; });
  if (stands(run.commands.front()) || later == run.poses.end()) return to;
  measure_speed(run.poses.front(), *later, 2 * kSpeedSpan_s, &to);
  return to;
}

// First and last pose of each window of a horizon, from a pose on.
std::vector<std::pair<std::size_t, std::size_t>> tiles(const std::vector<PoseRow>& poses,
                                                       std::size_t from, double horizon) {
  std::vector<std::pair<std::size_t, std::size_t>> all;
  if (horizon <= 0 && from + 1 < poses.size()) all.emplace_back(from, poses.size() - 1);
  if (horizon <= 0) return all;
  // Poses so rare that every way between two is a window of its own.
  const bool rare = median_interval(poses) > horizon;
  while (from + 1 < poses.size()) {
    const double wanted = poses[from].t_s + horizon;
    std::size_t end = from + 1;
    while (end < poses.size() && poses[end].t_s < wanted) ++end;
    // The pose before may be closer, and the last one near enough.
    const bool early = end - 1 > from && poses[end - 1].t_s >= wanted - kSlack * horizon;
    if (end == poses.size() && !early) break;
    if (early && (end == poses.size() || wanted - poses[end - 1].t_s < poses[end].t_s - wanted)) {
      --end;
    }
    const bool gap = poses[end].t_s - poses[from].t_s > kGap * horizon;
    if (!gap || rare) all.emplace_back(from, end);
    from = end;
  }
  return all;
}

constexpr double kHalfSpan_s = 0.25;  // of poses, either side of a start, that show its speed

const PoseRow& pose_near(const std::vector<PoseRow>& poses, double t_s) {
  const auto after = std::ranges::lower_bound(poses, t_s, {}, &PoseRow::t_s);
  if (after == poses.begin()) return poses.front();
  if (after == poses.end()) return poses.back();
  const auto before = after - 1;
  return t_s - before->t_s < after->t_s - t_s ? *before : *after;
}

CommandedRun one_run(const LoggedRun& run, const Trial& trial, double run_in_s, double margin_s) {
  CommandedRun to;
  to.start_s = std::max(run.poses.front().t_s, *trial.t_s - run_in_s);
  measure_speed(pose_near(run.poses, to.start_s - kHalfSpan_s),
                pose_near(run.poses, to.start_s + kHalfSpan_s), 4 * kHalfSpan_s, &to);
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

Trial window_between(const RunLog& log, std::size_t run, std::size_t from, std::size_t end,
                     std::size_t number) {
  const std::vector<PoseRow>& poses = log.runs[run].poses;
  Trial trial;
  trial.session = session_of(log.runs[run]);
  trial.trial = static_cast<std::int64_t>(number);
  trial.command = kWindowCommand;
  trial.run = static_cast<std::uint32_t>(run);
  trial.t_s = poses[from].t_s;
  trial.duration_s = poses[end].t_s - poses[from].t_s;
  trial.X_WS = poses[from].X_WM;
  trial.X_WE = poses[end].X_WM;
  for (Pose* X : {&trial.X_WS, &trial.X_WE}) X->theta = wrap_angle(X->theta);
  return trial;
}

Result<WindowedRuns> cut_windows(const RunLog& log, const WindowSettings& settings) {
  if (log.runs.empty()) return Error{"the log has no runs"};
  WindowedRuns windows;
  windows.log.notes = log.notes;
  double longest_s = 0;
  for (std::size_t i = 0; i < log.runs.size(); ++i) {
    const LoggedRun& run = log.runs[i];
    if (run.commands.empty() || run.poses.size() < kLeastPoses) {
      windows.runs.emplace_back();
      windows.log.notes.push_back("run " + run.run + " has fewer than two poses; omitted");
      continue;
    }
    longest_s = std::max(longest_s, run.poses.back().t_s - run.poses.front().t_s);
    windows.runs.push_back(commanded(run));
    const double run_in_s = stands(run.commands.front()) ? 0 : settings.run_in_s;
    const auto first =
        std::ranges::lower_bound(run.poses, run.poses.front().t_s + run_in_s, {}, &PoseRow::t_s);
    for (const double horizon : settings.horizons_s) {
      const auto begin = static_cast<std::size_t>(first - run.poses.begin());
      for (const auto& [from, end] : tiles(run.poses, begin, horizon)) {
        windows.log.trials.push_back(window_between(log, i, from, end, windows.log.trials.size()));
      }
    }
  }
  if (windows.log.trials.empty()) {
    return Error{"no window fits into the runs, of which the longest has poses over " +
                 std::to_string(longest_s) + " s; choose shorter horizons"};
  }
  return windows;
}

WindowedRuns restart_at_measured_speed(const RunLog& log, WindowedRuns windows, double run_in_s,
                                       double margin_s) {
  windows.runs.clear();
  for (Trial& trial : windows.log.trials) {
    windows.runs.push_back(one_run(log.runs[*trial.run], trial, run_in_s, margin_s));
    trial.run = static_cast<std::uint32_t>(windows.runs.size() - 1);
  }
  return windows;
}

std::optional<double> turned_between(const std::vector<CommandRow>& rates, double from_s,
                                     double end_s) {
  const auto first = std::ranges::upper_bound(rates, from_s, {}, &CommandRow::t_s);
  if (first == rates.begin() || rates.empty() || rates.back().t_s < end_s) return {};
  double turned = 0;
  for (auto row = first - 1; row + 1 != rates.end() && row->t_s < end_s; ++row) {
    const double begin = row->t_s, dt = (row + 1)->t_s - begin;
    if (dt > kGyroGap_s) return {};
    if (dt <= 0) continue;
    const double a = std::max(from_s, begin), b = std::min(end_s, begin + dt);
    const double middle = ((a + b) / 2 - begin) / dt;
    turned += (b - a) * (row->values[0] + middle * ((row + 1)->values[0] - row->values[0]));
  }
  return turned;
}

}  // namespace gapfarm
