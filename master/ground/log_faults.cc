#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/math/statistics.h"
#include "master/ground/fit/scans.h"
#include "master/ground/free_residual.h"
#include "master/ground/search.h"

namespace gapfarm {
namespace {

constexpr int kOwnRounds = 10;       // of Gauss and Newton, for a run alone
constexpr double kNeverSo = -1e300;  // nats
constexpr std::size_t kFewestApart = 10;
constexpr double kNoisy = 2;

bool all_alike(const std::vector<CommandedRun>& runs) {
  const auto rows = flattened(runs, &CommandedRun::commands);
  return std::ranges::all_of(
      rows, [&](const CommandRow& row) { return row.values == rows.front().values; });
}

// Frames that repeat the one before say where the robot was, not where it is: they go.
void drop_stale_frames(GroundSearch* search) {
  // An increment of nothing is a motion that was not seen: no later one shows it.
  if (search->log.relative) return;
  const std::vector<std::vector<Pose>> tracks = mapped(
      search->log.runs, [](const LoggedRun& run) { return mapped(run.poses, &PoseRow::X_WM); });
  const double step_m = grid_of(search->log).step_m;
  search->stale = count_stale(tracks, step_m);
  if (search->stale.repeats == 0) return;
  for (std::size_t r = 0; r < tracks.size(); ++r) {
    const std::vector<char> stale = stale_flags(tracks[r], step_m);
    std::vector<PoseRow> kept;
    for (std::size_t i = 0; i < stale.size(); ++i) {
      if (!stale[i]) kept.push_back(search->log.runs[r].poses[i]);
    }
    search->log.runs[r].poses = std::move(kept);
  }
}

// The best that values near the file's do with poses on a clock of their own.
double objective_with_own_clock(const WindowFitter& fitter, std::vector<FitRow> rows,
                                const Eigen::VectorXd& values) {
  const Eigen::Index delay = row_index(rows, "delay");
  if (delay < 0 || fitter.windows().simulated) return kNeverSo;
  rows[delay].free = true;
  return fitter.fit(rows, {}, scan_delay(fitter, rows, values)).objective;
}

// How much closer a run is to what its own values expect than to those of all runs: the ratio of
// its residuals, where the nats are no chance; 1: no closer.
double own_values_shrink(const WindowFitter& fitter, const GroundSearch& search, std::size_t run) {
  const WindowSet& windows = fitter.windows();
  std::vector<char> others(static_cast<std::size_t>(windows.blocks), 1);
  double count = 0;
  for (std::size_t i = 0; i < windows.run_of.size(); ++i) {
    if (windows.run_of[i] != run) continue;
    others[windows.block[i]] = 0;
    count += 1;
  }
  // Few windows are fitted by values of their own whatever they are.
  if (count < static_cast<double>(kEnoughToScatter) * windows.lengths) return 1;
  std::vector<FitRow> rows = search.free_fit.rows;
  // How a run's clock stands is a caution of its own.
  for (FitRow& row : rows) {
    if (row.row.name != "delay" && row.row.name != "lag") continue;
    row.row.nominal = search.free_fit.values[row_index(rows, row.row.name)];
    row.row.tolerance *= 1e-6;
    row.free = false;
  }
  const WindowFit all = fitter.hold(rows, search.free_fit.values, others);
  const WindowFit own = fitter.fit(rows, others, search.free_fit.values, kOwnRounds);
  const double gain = own.objective - all.objective;
  return gain < kFaultGain ? 1 : std::exp(gain * windows.lengths / (3 * count));
}

// The windows of a length in which the robot is to move: to drive or to turn half as fast as in
// the fastest tenth of them.  Where it stands nothing misses.
std::vector<std::size_t> moving(const std::vector<WindowSpeeds>& speeds, const WindowSet& windows,
                                int length) {
  const auto of_length =
      filtered(indices(speeds.size()), [&](std::size_t i) { return windows.horizon[i] == length; });
  if (of_length.empty()) return {};
  const auto ahead = [&](std::size_t i) { return std::abs(speeds[i].ahead_m_s); };
  const auto turn = [&](std::size_t i) { return std::abs(speeds[i].turn_rad_s); };
  const double fast = quantile(mapped(of_length, ahead), 0.9);
  const double turning = quantile(mapped(of_length, turn), 0.9);
  return filtered(of_length,
                  [&](std::size_t i) { return 2 * ahead(i) >= fast || 2 * turn(i) >= turning; });
}

// Of every window: how far it misses, in scales of its length.
std::vector<double> misses(const WindowFit& fit, const WindowSet& windows) {
  return mapped(indices(fit.residuals.size()), [&](std::size_t i) {
    return fit.residuals[i].cwiseQuotient(fit.scales[windows.horizon[i]]).norm();
  });
}

}  // namespace

std::vector<double> times_farther(const WindowFit& fit, const WindowSet& windows) {
  std::vector<std::vector<double>> of_runs(windows.run_blocks.size());
  const std::vector<double> missed = misses(fit, windows);
  for (std::size_t i = 0; i < missed.size(); ++i) of_runs[windows.run_of[i]].push_back(missed[i]);
  return mapped(indices(of_runs.size()), [&](std::size_t r) {
    std::vector<double> others;
    for (std::size_t other = 0; other < of_runs.size(); ++other) {
      if (other != r && !of_runs[other].empty()) others.push_back(median(of_runs[other]));
    }
    if (of_runs[r].empty() || others.size() < 2) return 0.0;
    return median(of_runs[r]) / std::max(median(others), 1e-12);
  });
}

Result<WindowSet> GroundQuestion::windows(const GroundRobot& robot, const RunLog& log,
                                          const WindowSettings& settings) const {
  auto set = window_set(robot, log, settings);
  if (set && simulation) set->simulated = simulation(*set);
  return set;
}

std::optional<GroundFault> best_fault(
    const GroundRobot& robot, const RunLog& log, const GroundQuestion& question,
    const WindowSettings& settings, double before, bool anywhere, std::span<const FoundFault> found,
    const std::function<double(const WindowFitter&, const RunLog&)>& objective_of) {
  std::optional<GroundFault> best;
  for (std::size_t i = 0; i < question.catalogue.size(); ++i) {
    const GroundHypothesis& h = question.catalogue[i];
    if (!h.put_right || (anywhere && h.of_world)) continue;
    // One column has one unit.
    const auto is_again = [&](const FoundFault& f) {
      const GroundHypothesis& other = question.catalogue[f.hypothesis];
      return other.name == h.name && other.aliases == h.aliases;
    };
    if (std::ranges::any_of(found, is_again)) continue;
    GroundFault fault{{i, 0}, 1, log, 0};
    h.put_right(&fault.log);
    const auto windows = question.windows(robot, fault.log, settings);
    if (!windows) continue;
    const double stretches = windows->stretches();
    const WindowFitter fitter(robot, *windows, question.reference);
    // Densities are of what was logged, in its own unit.
    fault.objective =
        objective_of(fitter, fault.log) + stretches * std::log(h.metres * h.metres * h.radians);
    fault.gain = fault.objective - before;
    fault.shrinks = std::exp(fault.gain / (3 * stretches));
    if (fault.gain < kFaultGain || fault.shrinks < kFaultShrinks) continue;
    if (!best || fault.gain > best->gain) best = std::move(fault);
  }
  return best;
}

std::optional<GroundFault> find_ground_fault(const GroundRobot& robot, const RunLog& log,
                                             const GroundQuestion& question,
                                             const WindowSettings& settings,
                                             std::span<const FoundFault> found) {
  const std::vector<FitRow> rows = held_rows(question.rows);
  const auto objective_of = [&](const WindowFitter& fitter, const RunLog&) {
    return fitter.hold(rows, nominals(rows)).objective;
  };
  const auto as_logged = question.windows(robot, log, settings);
  if (!as_logged) return std::nullopt;
  const double before = objective_of(WindowFitter(robot, *as_logged, question.reference), log);
  return best_fault(robot, log, question, settings, before, /*anywhere=*/false, found,
                    objective_of);
}

Status search_faults(const GroundRobot& robot, const GroundQuestion& question,
                     const GroundWork& work, GroundSearch* search) {
  drop_stale_frames(search);
  for (;;) {
    const bool settled = !question.sensor.empty() || search->faults.size() >= kMostFaults;
    auto fault =
        settled ? std::nullopt
                : find_ground_fault(robot, search->log, question, work.windows, search->faults);
    ASSIGN_OR_RETURN(auto windows, question.windows(robot, search->log, work.windows));
    search->windows = std::move(windows);
    const WindowFitter fitter(robot, search->windows, question.reference, work.memo);
    search->fit = fitter.fit(held_rows(question.rows));
    if (!fault) break;
    // Values a little off must not do as well, nor must a clock that is far off.
    if (fault->objective < search->fit.objective) break;
    const double delayed = objective_with_own_clock(fitter, search->fit.rows, search->fit.values);
    if (fault->objective < delayed) break;
    search->faults.push_back(*fault);
    search->log = std::move(fault->log);
  }
  search->jumps = check_jumps(search->log);
  if (!search->jumps.false_poses.empty()) {
    search->log = without(std::move(search->log), search->jumps);
    ASSIGN_OR_RETURN(search->windows, question.windows(robot, search->log, work.windows));
    search->fit =
        WindowFitter(robot, search->windows, question.reference, work.memo).fit(search->fit.rows);
  }
  if (!search->windows.noise.empty()) {
    const WindowFitter as_stated(robot, search->windows, question.reference, work.memo);
    search->windows.least_noise = as_stated.likeliest_least_noise(search->fit);
    const WindowFitter fitter(robot, search->windows, question.reference, work.memo);
    search->fit = fitter.fit(search->fit.rows);
  }
  RETURN_IF_ERROR(put_on_one_clock(robot, question, work, search));
  search->grid = grid_of(search->log);  // in metres by now
  return {};
}

std::string far_windows(const WindowFitter& fitter, const GroundSearch& search, double least) {
  const WindowSet& windows = search.windows;
  const std::vector<double> missed = misses(search.fit, windows);
  const std::vector<WindowSpeeds> speeds = window_speeds(fitter, search.fit);
  double most = least;
  std::string text;
  for (int length = 0; length < windows.lengths; ++length) {
    const std::vector<std::size_t> moves = moving(speeds, windows, length);
    if (moves.size() < kFewestReadings) continue;
    const double middle = median(mapped(moves, [&](std::size_t i) { return missed[i]; }));
    const auto far = filtered(moves, [&](std::size_t i) { return missed[i] > kFarRun * middle; });
    const double share = static_cast<double>(far.size()) / static_cast<double>(moves.size());
    if (share < most) continue;
    most = share;
    const std::string& run = search.log.runs[windows.run_of[far[0]]].run;
    text = fmt::format(
        "Of the windows of {} in which the robot is to move {:.0f} % miss by more than {:g} times "
        "what half of them do, the first at {:.1f} s of run {}: something comes and goes. Look at "
        "the commands and the poses there: commands that did not arrive, wheels that slipped, a "
        "robot that was held, poses that are not its own.",
        windows.length_text(length), 100 * share, kFarRun, windows.trials[far[0]].t_s.value_or(0),
        run);
  }
  return text;
}

std::string far_runs(const WindowFitter& fitter, const GroundSearch& search) {
  std::vector<std::string> far;
  bool all_own = true;
  const std::vector<double> times = times_farther(search.fit, search.windows);
  for (std::size_t r = 0; r < times.size(); ++r) {
    const bool has_own = times[r] > kFaultShrinks && !search.windows.simulated &&
                         !search.reference && own_values_shrink(fitter, search, r) > kFaultShrinks;
    if (!has_own && !(times[r] > kFarRun)) continue;
    all_own = all_own && has_own;
    far.push_back(fmt::format("Run {} misses by {:.1f} times as much as the others{}.",
                              search.log.runs[r].run, times[r],
                              has_own ? ", and other values fit it" : ""));
  }
  if (far.empty()) return "";
  return joined(far, " ") +
         (all_own ? " Something was other in these: floor, load, mark, clock or the robot itself."
                  : " Look at the commands and the poses of these: another run's, the other way "
                    "round, or something that happened there alone.");
}

std::string unconfirmed_part(const GroundSearch& search) {
  if (search.offers.empty() || search.reference) return "";
  for (const Offer& offer : search.offers.back()) {
    const GroundHypothesis& h = search.catalogue[offer.hypothesis];
    const bool named = contains(search.steps, offer.hypothesis, &GroundStep::chosen);
    if (h.price == 0 || named || offer.gain < kLeastSecondOfAKind) continue;
    return fmt::format(
        "Where all runs are fitted, {} explains {:.0f} nats, but no run that was held out bears it "
        "out: one run alone was there, or something comes and goes. Log more runs over it.",
        h.thing, offer.gain);
  }
  return "";
}

double share_unexplained(const WindowFitter& fitter, const WindowFit& fit) {
  const WindowSet& windows = fitter.windows();
  if (all_alike(windows.runs)) return 0;
  const std::vector<Eigen::Vector3d> missed = fitter.raw_residuals(fit);
  double least = INFINITY;
  for (int length = 0; length < windows.lengths; ++length) {
    std::array<std::vector<double>, 3> moved;
    Eigen::Vector3d missing = Eigen::Vector3d::Zero(), sizes = missing;
    for (std::size_t i = 0; i < missed.size(); ++i) {
      if (windows.horizon[i] != length) continue;
      const Pose X = between(windows.trials[i].X_WS, windows.trials[i].X_WE);
      missing += missed[i].cwiseAbs();
      sizes += Eigen::Vector3d(X.x, X.y, X.theta).cwiseAbs();
      for (int c = 0; c < 3; ++c) moved[c].push_back(c == 0 ? X.x : c == 1 ? X.y : X.theta);
    }
    const auto count = static_cast<double>(moved[0].size());
    // Straight drives at one speed differ by noise alone, which no command explains.
    const double way = sizes.head<2>().norm(), turns = std::max(sizes[2], count);
    // A throttle's windows begin at the speed that was measured, which says how far they go.
    for (int c = is_throttled(fitter.robot()) ? 1 : 0; c < 3 && count > 0; ++c) {
      const double middle = median(moved[c]);
      double scatter = 0;
      for (const double m : moved[c]) scatter += std::abs(m - middle);
      const double share = missing[c] / std::max(scatter, 1e-12);
      if (share < kUnexplained || scatter > kEvenMotion * (c < 2 ? way : turns)) {
        least = std::min(least, share);
      }
    }
  }
  return std::isfinite(least) ? least : 0;
}

bool hardly_moved(const RunLog& log) {
  std::vector<double> ways[2], turns[2];  // of neighbours, and half a run apart
  for (const LoggedRun& run : log.runs) {
    const std::size_t apart[] = {1, run.poses.size() / 2};
    for (std::size_t k = 0; apart[1] >= kFewestApart && k < 2; ++k) {
      for (std::size_t i = apart[k]; i < run.poses.size(); ++i) {
        const Pose X = between(run.poses[i - apart[k]].X_WM, run.poses[i].X_WM);
        ways[k].push_back(std::hypot(X.x, X.y));
        turns[k].push_back(std::abs(X.theta));
      }
    }
  }
  return !ways[0].empty() && median(ways[1]) <= kNoisy * median(ways[0]) &&
         median(turns[1]) <= kNoisy * median(turns[0]);
}

std::string unexplained_text(double share, bool stood) {
  if (stood) {
    return "The robot hardly moved: its poses differ by no more than their own noise, though it "
           "was commanded to drive. Was it switched on, and did the tracker follow it?";
  }
  return fmt::format(
      "What is commanded does not explain how the robot moved: the best of what was tried leaves "
      "{:.0f} % of what its motions differ by. Are these the commands and the poses of the same "
      "runs, row by row, and do both columns mean what the robot's file says?",
      100 * share);
}

}  // namespace gapfarm
