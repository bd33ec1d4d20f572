#include <algorithm>
#include <cmath>

#include "common/recordings/restart.h"
#include "master/ground/fit/window_fit.h"

namespace gapfarm {
namespace {

constexpr std::size_t kLeastBlocks = 10;  // fewer runs than this are cut into stretches
// The same of increments, which know of nothing that lasts: tens of stretches say better how far
// values scatter.
constexpr std::size_t kLeastRelativeBlocks = 30;
constexpr double kMargin_s = 11;  // of commands round a window: clocks may be 10 s apart

bool alike(const std::vector<Trial>& a, std::size_t from_a, const std::vector<Trial>& b) {
  if (a.size() - from_a != b.size()) return false;
  for (std::size_t i = 0; i < b.size(); ++i) {
    const Trial& x = a[from_a + i];
    if (x.run != b[i].run || x.t_s != b[i].t_s || x.duration_s != b[i].duration_s) return false;
  }
  return true;
}

}  // namespace

Result<WindowSet> window_set(const GroundRobot& robot, const RunLog& log,
                             const WindowSettings& settings) {
  WindowSet set;
  const bool restarts = robot.command == CommandKind::kThrottleSteering;
  std::vector<std::size_t> run_of;  // of each trial, in the log
  std::size_t last = 0;
  for (const double horizon : settings.horizons_s) {
    auto cut = cut_windows(log, {{horizon}, settings.run_in_s});
    if (!cut) continue;
    if (!restarts && set.horizons > 0 && alike(set.trials, last, cut->log.trials)) continue;
    last = set.trials.size();
    for (const Trial& trial : cut->log.trials) run_of.push_back(*trial.run);
    if (restarts) {
      *cut = restart_at_measured_speed(log, std::move(*cut), settings.run_in_s, kMargin_s);
      for (Trial& trial : cut->log.trials) *trial.run += static_cast<std::uint32_t>(last);
      set.runs.insert(set.runs.end(), cut->runs.begin(), cut->runs.end());
    } else {
      set.runs = std::move(cut->runs);
    }
    for (Trial& trial : cut->log.trials) {
      set.trials.push_back(std::move(trial));
      set.horizon.push_back(set.horizons);
    }
    ++set.horizons;
  }
  if (set.trials.empty()) return Error{"no window of any horizon fits into the runs"};
  std::vector<double> begin(log.runs.size()), length(log.runs.size());
  double all = 0;
  for (std::size_t i = 0; i < log.runs.size(); ++i) {
    if (log.runs[i].poses.size() < 2) continue;
    begin[i] = log.runs[i].poses.front().t_s;
    length[i] = log.runs[i].poses.back().t_s - begin[i];
    all += length[i];
  }
  // Stretches of one length, none over two runs.
  std::vector<int>& first = set.run_blocks;
  first.resize(log.runs.size());
  const std::size_t least = log.relative ? kLeastRelativeBlocks : kLeastBlocks;
  const bool few = log.runs.size() < least;
  for (std::size_t i = 0; i < log.runs.size(); ++i) {
    first[i] = set.blocks;
    const double pieces =
        few ? std::ceil(static_cast<double>(least) * length[i] / std::max(all, 1e-9)) : 1;
    set.blocks += std::max(1, static_cast<int>(pieces));
  }
  for (std::size_t i = 0; i < set.trials.size(); ++i) {
    const Trial& trial = set.trials[i];
    const std::size_t run = run_of[i];
    const int pieces = (run + 1 < first.size() ? first[run + 1] : set.blocks) - first[run];
    const double middle = *trial.t_s + *trial.duration_s / 2 - begin[run];
    const int piece = static_cast<int>(pieces * middle / std::max(length[run], 1e-9));
    set.block.push_back(first[run] + std::clamp(piece, 0, pieces - 1));
  }
  return set;
}

}  // namespace gapfarm
