#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/math/statistics.h"
#include "master/ground/search.h"
#include "master/ground/tolerances.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMostRuns = 9;
// Of a run's clock, either way of the common delay.
constexpr double kClockStep_s = 0.02, kFarClockStep_s = 0.05;
constexpr int kClockSteps = 15, kFarClockSteps = 24;

// Ascending: close to the common one in small steps.
std::vector<double> clocks_about(double common_s) {
  std::vector<double> all;
  const double near_s = kClockStep_s * kClockSteps;
  for (int k = -kFarClockSteps; k < 0; ++k) all.push_back(common_s - near_s + kFarClockStep_s * k);
  for (int k = -kClockSteps; k <= kClockSteps; ++k) all.push_back(common_s + kClockStep_s * k);
  for (int k = 1; k <= kFarClockSteps; ++k) all.push_back(common_s + near_s + kFarClockStep_s * k);
  return all;
}

// Where the parabola through three points about the best of some nats, ascending in x, is highest.
double highest(const std::vector<double>& x, const Eigen::RowVectorXd& y, Eigen::Index best) {
  const double left = x[best] - x[best - 1], right = x[best + 1] - x[best];
  const double falls_left = (y[best] - y[best - 1]) / left;
  const double falls_right = (y[best] - y[best + 1]) / right;
  const double bend = falls_left + falls_right;
  if (!(bend > 0)) return x[best];
  return x[best] + 0.5 * (falls_left * right - falls_right * left) / bend;
}

// How late the poses of a run are by its own windows.
struct RunClock {
  std::size_t run = 0;
  double late_s = 0;
};

// Of two to nine runs, where they are significantly apart: where each run has its own, the windows
// are by so much better explained than by one for all.  More runs than these are drawn again as
// they are, and stand for themselves.  Empty: they are not.
std::vector<RunClock> clocks_of_runs(const WindowFitter& fitter, const WindowFit& fit) {
  const WindowSet& windows = fitter.windows();
  const std::size_t runs = windows.run_blocks.size();
  const Eigen::Index delay = row_index(fit.rows, "delay");
  if (runs < 2 || runs > kMostRuns || delay < 0) return {};
  const std::vector<double> delays = clocks_about(fit.values[delay]);
  Eigen::MatrixXd nats = Eigen::MatrixXd::Zero(runs, delays.size());
  for (std::size_t k = 0; k < delays.size(); ++k) {
    Eigen::VectorXd values = fit.values;
    values[delay] = delays[k];
    const WindowFit held = fitter.hold(fit.rows, values);
    // In the fit's scales: what the other runs miss by there must not blur a run's own clock.
    for (std::size_t i = 0; i < held.residuals.size(); ++i) {
      for (Eigen::Index c = 0; c < 3; ++c) {
        nats(windows.run_of[i], k) +=
            window_nats(held.residuals[i][c], fit.scales[windows.horizon[i]][c]) / windows.lengths;
      }
    }
  }
  std::vector<RunClock> clocks;
  Eigen::RowVectorXd common = Eigen::RowVectorXd::Zero(nats.cols());
  double own = 0;
  for (std::size_t r = 0; r < runs; ++r) {
    Eigen::Index best = 0;
    const double most = nats.row(r).maxCoeff(&best);
    if (best == 0 || best + 1 == nats.cols()) continue;  // no clock within reach
    own += most;
    common += nats.row(r);
    clocks.push_back({r, highest(delays, nats.row(r), best)});
  }
  const double least = kLeastChangeGain * (static_cast<double>(clocks.size()) - 1);
  if (clocks.size() < 2 || own - common.maxCoeff() < least) clocks.clear();
  return clocks;
}

// The one that is farther off the others than scatter as theirs brings any (Dixon's Q of 99 %,
// Rorabacher, Analytical Chemistry 63, 1991) and than a file's delay may be, and that misses no
// farther than they do once it is put right; later than the middle one by `late_s`.
std::optional<RunClock> odd_clock(const WindowFitter& fitter, const WindowFit& fit) {
  static constexpr double kDixon[] = {0.994, 0.926, 0.821, 0.740, 0.680, 0.634, 0.598};  // from 3
  std::vector<RunClock> clocks = clocks_of_runs(fitter, fit);
  if (clocks.size() < 3) return {};  // of two nobody knows which
  std::ranges::sort(clocks, {}, &RunClock::late_s);
  const double first_s = clocks[1].late_s - clocks[0].late_s;
  const double last_s = clocks.back().late_s - clocks[clocks.size() - 2].late_s;
  const double share = kDixon[clocks.size() - 3];
  const RunClock odd = first_s > last_s ? clocks.front() : clocks.back();
  const double least_s = share * (clocks.back().late_s - clocks.front().late_s);
  if (std::max(first_s, last_s) < std::max(least_s, kFarTolerances * kDelay_s)) return {};
  WindowFit right = fit;
  right.values[row_index(fit.rows, "delay")] = odd.late_s;
  right.residuals = fitter.hold(fit.rows, right.values).residuals;
  const WindowSet& windows = fitter.windows();
  for (std::size_t i = 0; i < windows.run_of.size(); ++i) {
    if (windows.run_of[i] != odd.run) right.residuals[i] = fit.residuals[i];
  }
  if (times_farther(right, windows)[odd.run] > kFarRun) return {};
  return RunClock{odd.run, odd.late_s - median(mapped(clocks, &RunClock::late_s))};
}

// Flags of the blocks of all runs but one.
std::vector<char> all_but(const WindowSet& windows, std::size_t run) {
  std::vector<char> flags(static_cast<std::size_t>(windows.blocks), 1);
  std::fill_n(flags.begin() + windows.run_blocks[run], windows.blocks_of(run), 0);
  return flags;
}

// What is added to command times of a run: at their first, and a second from there on.
struct ClockShift {
  double first_s = 0, rate = 0;
};

// The clock that fits a run, whose commands begin at `first_s`, best beside values that are known,
// its rate included.
ClockShift shift_of(const WindowFitter& fitter, const GroundQuestion& question,
                    const WindowFit& fit, const RunClock& odd, double first_s) {
  std::vector<FitRow> rows = fit.rows;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    rows[k].row.nominal = fit.values[static_cast<Eigen::Index>(k)];
    rows[k].free = rows[k].row.name == "delay";
    if (!rows[k].free) rows[k].row.tolerance *= 1e-6;
  }
  Eigen::VectorXd values = fit.values;
  const Eigen::Index delay = row_index(rows, "delay");
  values[delay] += odd.late_s;
  const auto drifts = find_by(question.catalogue, "clock_drift", &GroundHypothesis::name);
  if (drifts != nullptr) rows = with_freed(std::move(rows), *drifts, &values);
  const WindowFit own = fitter.fit(rows, all_but(fitter.windows(), odd.run), values);
  const double late_s = own.values[delay] - fit.values[delay];
  if (drifts == nullptr) return {late_s};
  const double rate = own.values[row_index(own.rows, drifts->freed.front().name)];
  // The model's drift begins with the first command of all (KinematicPaths).
  const auto first = std::ranges::find_if(
      fitter.windows().runs, [](const CommandedRun& run) { return !run.commands.empty(); });
  return {late_s + rate * (first_s - first->commands.front().t_s), rate};
}

}  // namespace

Status put_on_one_clock(const GroundRobot& robot, const GroundQuestion& question,
                        const GroundWork& work, GroundSearch* search) {
  if (search->windows.simulated) return {};
  const WindowFitter fitter(robot, search->windows, question.reference, work.memo);
  const auto by_file = odd_clock(fitter, search->fit);
  if (!by_file) return {};
  // Neither must a wrong value pass for a clock in the run that shows it, nor that run have its say
  // in the values.
  std::vector<char> held_out = all_but(search->windows, by_file->run);
  for (char& flag : held_out) flag = !flag;
  const WindowFit others = fitter.fit(all_free(search->fit.rows), held_out, search->fit.values);
  const auto odd = odd_clock(fitter, others);
  if (!odd || odd->run != by_file->run) return {};
  LoggedRun& run = search->log.runs[odd->run];
  if (run.commands.empty()) return {};
  const double first_s = run.commands.front().t_s, last_s = run.commands.back().t_s;
  const ClockShift shift = shift_of(fitter, question, others, *odd, first_s);
  for (CommandRow& row : run.commands) row.t_s += shift.first_s + shift.rate * (row.t_s - first_s);
  search->clocks = fmt::format(
      "The runs' clocks are apart: commands of run {} were moved by {:+.2f} s, its last by {:+.2f} "
      "s, to where the others have theirs. Put them right in the log.",
      run.run, shift.first_s, shift.first_s + shift.rate * (last_s - first_s));
  ASSIGN_OR_RETURN(search->windows, question.windows(robot, search->log, work.windows));
  search->fit = WindowFitter(robot, search->windows, question.reference, work.memo)
                    .fit(search->fit.rows, {}, search->fit.values);
  return {};
}

std::string clocks_apart(const WindowFitter& fitter, const GroundSearch& search) {
  return joined(clocks_of_runs(fitter, search.fit), ", ", [&](const RunClock& clock) {
    return fmt::format("{:+.2f} s in run {}", clock.late_s, search.log.runs[clock.run].run);
  });
}

}  // namespace gapfarm
