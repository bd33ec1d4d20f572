#include "master/ground/reference.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include "common/math/laws.h"
#include "common/math/statistics.h"
#include "common/random/stream.h"
#include "common/score/kinematic_body.h"
#include "master/ground/fit/held_out.h"
#include "master/ground/fit/scans.h"
#include "master/ground/report/ground_text.h"
#include "master/ground/tolerances.h"
#include "master/infer/settings.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {
namespace {

// How little a value may be off that no log shows: of its tolerance.
constexpr double kHeld = 1e-6;
// Headings of the tracked point that a fit begins at, how many of them are followed, for how many
// rounds, and for how many more where faults are compared.
constexpr int kTurns = 8;
constexpr int kScanRounds = 3;
constexpr int kRounds = 40, kFaultRounds = 8;
constexpr double kShift_s = 0.05, kMostShift_s = 1;  // between clocks that rows make one
constexpr double kLeastShift_s = 1e-3;
// A grip that was never reached has no upper end that shows, and none below that does not: half of
// how far it may fall, in its logarithm, before another one is distinguished.
constexpr double kMostUnsureGrip = 2, kGripStep = 0.1;
constexpr double kSharpGrip = 1.8;  // of its shape

double unsure_grip(const WindowFitter& fitter, const WindowFit& fit, Eigen::Index grip) {
  for (double fall = kGripStep; fall < kMostUnsureGrip; fall += kGripStep) {
    Eigen::VectorXd values = fit.values;
    values[grip] -= fall;
    double best = fitter.hold(fit.rows, values).objective;
    if (const Eigen::Index shape = row_index(fit.rows, "grip_shape"); shape >= 0) {
      values[shape] = kSharpGrip;
    }
    best = std::max(best, fitter.hold(fit.rows, values).objective);
    if (fit.objective - best > kNotDistinguished) return fall / 2;
  }
  return kMostUnsureGrip / 2;
}

// What the robot's rows have no word for and the reference shows all the same (a battery that sags,
// steering that is weaker to one side) is the robot's own: no change, where the other log has it
// too. The best of the catalogue is taken into the fit as long as it is worth a name, which
// stretches that were not fitted bear out; what is of the world may be gone in the other log, and
// is taken along where it is more than is tolerated.
WindowFit with_traits(const WindowFitter& fitter, const std::vector<GroundHypothesis>& catalogue,
                      std::uint64_t seed, WindowFit fit) {
  for (int found = 0; found < kMostTraits; ++found) {
    const std::vector<Eigen::MatrixXd> slopes = fitter.slopes(fit);
    std::vector<std::pair<double, WindowFit>> traits;  // and what they gain
    for (const GroundHypothesis& h : catalogue) {
      Eigen::VectorXd values = fit.values;
      std::vector<FitRow> rows = with_freed(fit.rows, h, &values);
      if (rows.size() == fit.rows.size()) continue;
      if (h.propose) values = h.propose(fitter, fit, rows, values);
      for (std::size_t k = 0; k < rows.size(); ++k) {
        const bool fresh = k >= fit.rows.size();
        rows[k].free = fresh ? h.propose != nullptr : fit.rows[k].free;  // may be anywhere
        if (fresh) rows[k].row.tolerance *= kFarOff;
      }
      if (fitter.promise(fit, slopes, rows, values) < kLeastGroundPromise) continue;
      WindowFit with = fitter.fit(rows, {}, values);
      const double gain = gain_of(fitter, h, with, fit);
      if (gain < kLeastChangeGain) continue;
      traits.emplace_back(gain, std::move(with));
    }
    std::ranges::stable_sort(traits, std::greater(), &std::pair<double, WindowFit>::first);
    const WindowFit before = fit_held_out(fitter, fit.rows, fit.values);
    const auto shown = std::ranges::find_if(traits, [&](const auto& trait) {
      const WindowFit after = fit_held_out(fitter, trait.second.rows, trait.second.values);
      return may_be_named(held_out_gain(fitter.windows(), after, before, seed));
    });
    if (shown == traits.end()) break;
    fit = std::move(shown->second);
  }
  return fit;
}

// Far wider than what a file is off by; of increments all that may plausibly be wrong, but for when
// wheels turned, where they were measured with them.
std::vector<FitRow> open_rows(const GroundRobot& robot, const std::vector<KinematicRow>& rows,
                              const RunLog& log) {
  const bool together = log.relative && robot.measured && shares_a_clock(log);
  std::vector<FitRow> open;
  for (const KinematicRow& row : rows) {
    const bool held = together && (row.name == "lag" || row.name == "delay");
    open.push_back({row, log.relative && !held});
    open.back().row.tolerance *= held ? kHeld : kFarOff;
  }
  return open;
}

std::vector<FitRow> begun_at(std::vector<FitRow> rows, const Eigen::VectorXd& values) {
  for (std::size_t k = 0; k < rows.size(); ++k) rows[k].row.nominal = values[k];
  return rows;
}

// Values from where slopes lead on, whichever way the tracked point heads: of a sensor that was put
// in sideways or backward none leads there from the file's.
Eigen::VectorXd scan_marker(const WindowFitter& fitter, const std::vector<FitRow>& rows) {
  const auto turned_by = [&](int turn) {
    std::vector<FitRow> turned = rows;
    for (FitRow& row : turned) {
      if (row.row.name == "marker_yaw") row.row.nominal += 2 * std::numbers::pi * turn / kTurns;
    }
    return turned;
  };
  std::vector<std::pair<double, int>> turns;  // of the objective, best first
  for (int turn = 0; turn < kTurns; ++turn) {
    const std::vector<FitRow> turned = turned_by(turn);
    turns.emplace_back(-fitter.hold(turned, nominals(turned)).objective, turn);
  }
  std::sort(turns.begin(), turns.end());
  std::optional<WindowFit> best;
  for (std::size_t k = 0; k < kFinalists; ++k) {
    WindowFit fit = fitter.fit(turned_by(turns[k].second), {}, {}, kScanRounds);
    if (!best || fit.objective > best->objective) best = std::move(fit);
  }
  for (std::size_t k = 0; k < rows.size(); ++k) {
    // Of all turns the one that is least off.
    const double begun = rows[k].row.nominal, off = wrap_angle(best->values[k] - begun);
    best->values[k] = begun + (rows[k].row.name == "marker_yaw" ? off : 0);
  }
  return best->values;
}

// Rows that hold both wheels and increments may have read them from clocks that are apart: where a
// delay explains more than two halves of a log differ by, it is fitted after all.
WindowFit with_delay(const WindowFitter& fitter, const WindowFit& fit) {
  const Eigen::Index at = row_index(fit.rows, "delay");
  if (at < 0 || fit.rows[at].free) return fit;
  std::vector<FitRow> rows = fit.rows;
  rows[at].free = true;
  rows[at].row.tolerance = kDelay_s;
  std::vector<Eigen::VectorXd> others;
  for (double size = kShift_s; size <= kMostShift_s; size *= 1.5) {
    for (const double shift : {size, -size}) others.emplace_back(fit.values)[at] += shift;
  }
  const Eigen::VectorXd best = best_held(fitter, rows, fit.values, others, fit.objective);
  if (best == fit.values) return fit;
  WindowFit moved = fitter.fit(rows, {}, best);
  return moved.objective > fit.objective + kLeastChangeGain ? moved : fit;
}

WindowFit open_fit(const WindowFitter& fitter, const GroundRobot& robot,
                   const std::vector<KinematicRow>& of, const RunLog& log, int rounds = kRounds) {
  std::vector<FitRow> rows = open_rows(robot, of, log);
  rows = begun_at(rows, scan_delay(fitter, rows, nominals(rows)));
  if (log.relative) rows = begun_at(rows, scan_marker(fitter, rows));
  const WindowFit fit = fitter.fit(rows, {}, nominals(rows), rounds);
  return log.relative ? with_delay(fitter, fit) : fit;
}

// A size that is half or twice the file's, or more; -1: none is.
Eigen::Index another_robots(const WindowFit& fit) {
  for (Eigen::Index k = 0; k < fit.values.size(); ++k) {
    const double ratio = fit.values[k];
    const bool far = ratio < 1 / kMostRatio || ratio > kMostRatio;
    if (far && fit.rows[k].row.key == "ratio") return k;
  }
  return -1;
}

// Whether values account for where windows end: what is left is small beside the motion, and no
// wheel has half or twice its size or turns the other way.
bool explains(const WindowFitter& fitter, const WindowFit& fit) {
  const std::vector<Trial>& trials = fitter.windows().trials;
  const auto ways = mapped(
      trials, [](const Trial& t) { return std::hypot(t.X_WE.x - t.X_WS.x, t.X_WE.y - t.X_WS.y); });
  const auto turns = mapped(
      trials, [](const Trial& t) { return std::abs(wrap_angle(t.X_WE.theta - t.X_WS.theta)); });
  if (another_robots(fit) >= 0) return false;
  const Eigen::Vector3d& left = fit.scales.front();
  return left.head<2>().maxCoeff() < kExplained * median(ways) &&
         left[2] < kExplained * median(turns);
}

// What is wrong with increments that no values explain, whichever way the sensor looks: each fault
// is put right, and all values are fitted anew.
std::optional<GroundFault> fault_of_increments(const GroundRobot& robot, const RunLog& log,
                                               const WindowSettings& settings,
                                               const GroundQuestion& question,
                                               const WindowFit& fit) {
  return best_fault(robot, log, question, settings, fit.objective, /*anywhere=*/true,
                    question.faults, [&](const WindowFitter& fitter, const RunLog& right) {
                      return open_fit(fitter, robot, question.rows, right, kFaultRounds).objective;
                    });
}

// Whether the log is the wrong way round: put right, it fits better than with all values free.
const GroundHypothesis* fault_of(const GroundRobot& robot, const RunLog& log,
                                 const WindowSettings& settings, const GroundQuestion& question,
                                 const WindowFitter& as_logged, const WindowFit& fit) {
  std::optional<GroundFault> fault;
  if (!log.relative) {
    fault = find_ground_fault(robot, log, question, settings);
    if (fault && fault->objective <= fit.objective) fault.reset();
  } else if (!explains(as_logged, fit)) {
    fault = fault_of_increments(robot, log, settings, question, fit);
  }
  return fault ? &question.catalogue[fault->hypothesis] : nullptr;
}

// Whether a log shows a row, by how sure it makes it.  The place of a sensor on the robot turns
// with the way it looks: where nothing shows the one, nothing shows the other.
std::vector<char> shown_rows(const WindowFit& fit, const Eigen::VectorXd& deviations) {
  std::vector<char> shown;
  for (std::size_t k = 0; k < fit.rows.size(); ++k) {
    shown.push_back(deviations[k] < kUnshown * prior_deviation(fit.rows[k]));
  }
  const Eigen::Index yaw = row_index(fit.rows, "marker_yaw");
  if (yaw < 0 || !fit.rows[yaw].free || shown[yaw]) return shown;
  for (const char* place : {"marker_x", "marker_y"}) {
    if (const Eigen::Index k = row_index(fit.rows, place); k >= 0) shown[k] = false;
  }
  return shown;
}

GroundReference reference_of(const WindowFitter& fitter, const WindowFit& fit, std::uint64_t seed,
                             bool alone) {
  GroundReference reference;
  for (const FitRow& row : fit.rows) {
    // The other log may have an edge of its own beside this one.
    const bool known = FloorParts::has(row.row.name);
    reference.names.push_back((known ? std::string(FloorParts::kKnown) : "") + row.row.name);
    reference.units.push_back(row.row.unit);
  }
  reference.values = fit.values;
  reference.origin_m = fitter.origin_m();
  reference.windows = fitter.ended_windows(fit);
  const Eigen::MatrixXd all = fitter.draws(fit, seed, /*all=*/true).colwise() - fit.values;
  reference.shown =
      shown_rows(fit, all.rowwise().norm() / std::sqrt(static_cast<double>(all.cols())));
  reference.draws = alone ? all : fitter.draws(fit, seed).colwise() - fit.values;
  if (const Eigen::Index grip = row_index(fit.rows, "grip"); grip >= 0) {
    const double unsure = unsure_grip(fitter, fit, grip);
    Stream stream({seed, Purpose::kStatistics, 2, 0, 0});
    for (double& off : reference.draws.row(grip)) off += unsure * stream.normal();
  }
  reference.covariance =
      reference.draws * reference.draws.transpose() / static_cast<double>(reference.draws.cols());
  return reference;
}

}  // namespace

bool shares_a_clock(const RunLog& log) {
  return std::ranges::all_of(log.runs, [](const LoggedRun& run) {
    const std::vector<double> at = mapped(run.commands, &CommandRow::t_s);
    const std::set<double> times(at.begin(), at.end());
    return !run.poses.empty() && std::all_of(run.poses.begin(), run.poses.end() - 1,
                                             [&](const PoseRow& p) { return times.count(p.t_s); });
  });
}

Result<OffsetFit> fit_run_values(const GroundRobot& robot, const RunLog& log,
                                 const WindowSettings& settings) {
  if (const RunChecks checks = check_runs(log); checks.none_is_left(log)) {
    return Error{checks.findings.front().text};
  }
  GroundQuestion question;
  question.rows = change_rows(robot);
  question.catalogue = change_hypotheses(robot, question.rows);
  WindowSettings kept = settings;
  std::erase_if(kept.horizons_s, [&](double horizon) {
    const auto set = window_set(robot, log, {{horizon}, settings.run_in_s});
    return !set || set->trials.size() < kEnoughToScatter;
  });
  if (kept.horizons_s.empty()) {
    return Error{"it is too short: fewer than " + std::to_string(kEnoughToScatter) +
                 " windows of every length"};
  }
  ASSIGN_OR_RETURN(const auto windows, window_set(robot, log, kept));
  WindowFitter fitter(robot, windows);
  const WindowFit fit = open_fit(fitter, robot, question.rows, log);
  if (const GroundHypothesis* h = fault_of(robot, log, settings, question, fitter, fit)) {
    return Error{"its log is wrong in " + h->thing + ". " + h->remedy};
  }
  if (const RunChecks jumps = check_jumps(log); !jumps.false_poses.empty()) {
    return fit_run_values(robot, without(log, jumps), settings);
  }
  return fitter.fit_with_offsets(fit);
}

Result<GroundQuestion> ask_what_changed(const GroundRobot& robot, const RunLog& reference,
                                        const WindowSettings& settings, std::uint64_t seed,
                                        FitMemo* memo, bool alone) {
  GroundQuestion question;
  question.rows = change_rows(robot);
  add_gyro_scale(reference, &question.rows);
  question.catalogue = that_can_show(reference, change_hypotheses(robot, question.rows));
  auto windows = window_set(robot, reference, settings);
  if (!windows) return Error{"the reference: " + windows.error().message};
  const WindowFitter as_stated(robot, *windows, kNoReference, memo);
  WindowFit fit = open_fit(as_stated, robot, question.rows, reference);
  windows->least_noise = as_stated.likeliest_least_noise(fit);
  const WindowFitter fitter(robot, *windows, kNoReference, memo);
  if (!windows->noise.empty()) fit = fitter.fit(fit.rows, {}, fit.values);
  if (const GroundHypothesis* h = fault_of(robot, reference, settings, question, fitter, fit)) {
    return Error{"the log that values are fitted to is wrong in " + h->thing + ". " + h->remedy};
  }
  if (const double left = share_unexplained(fitter, fit); left >= kUnexplained) {
    return Error{unexplained_text(left, hardly_moved(reference))};
  }
  if (const Eigen::Index far = another_robots(fit); reference.relative && far >= 0) {
    const KinematicRow& row = fit.rows[far].row;
    return Error{fmt::format(
        "By this log {} is {:.2g} times what the robot's file says, or more off than that. Do "
        "columns of wheels hold speeds? Of what they turned by in a row the import's map says "
        "increment = true, of counts rate = true, of ticks and degrees a scale or a unit. Of true "
        "speeds correct the robot's file",
        row.name, fit.values[far])};
  }
  std::vector<GroundHypothesis> traits = that_can_show(reference, ground_hypotheses(robot));
  if (alone) {
    std::erase_if(traits, [](const GroundHypothesis& h) {
      return std::ranges::any_of(h.freed,
                                 [](const KinematicRow& row) { return FloorParts::has(row.name); });
    });
  }
  fit = with_traits(fitter, traits, seed, std::move(fit));
  question.reference = reference_of(fitter, fit, seed, alone);
  for (std::size_t k = 0; k < question.rows.size(); ++k) {
    question.rows[k].nominal = fit.values[k];
  }
  question.catalogue = change_hypotheses(robot, question.rows);
  for (GroundHypothesis& h : question.catalogue) {
    for (KinematicRow& row : h.freed) {
      row.nominal = question.reference->value_or(row.name, row.nominal);
    }
  }
  return question;
}

WindowSettings windows_of_rows(const RunLog& log, const WindowSettings& usual) {
  const bool together = log.relative && shares_a_clock(log);
  return together ? WindowSettings{{kEachRow_s}, usual.run_in_s} : usual;
}

bool reads_apart(const GroundRobot& robot, double delay_s) {
  return std::abs(delay_s - robot.motors.delay_s) > kLeastShift_s;
}

Status settle_sensor(const GroundRobot& robot, WindowSettings* settings, std::uint64_t seed,
                     RunLog* log, GroundQuestion* question) {
  const WindowSettings usual = *settings;
  *settings = windows_of_rows(*log, usual);
  for (;;) {
    ASSIGN_OR_RETURN(const auto windows, window_set(robot, *log, *settings));
    const WindowFitter fitter(robot, windows);
    const WindowFit fit = open_fit(fitter, robot, question->rows, *log);
    const Eigen::Index delay = row_index(fit.rows, "delay");
    if (settings->horizons_s != usual.horizons_s && delay >= 0 &&
        reads_apart(robot, fit.values[delay])) {
      *settings = usual;
      continue;
    }
    auto fault = question->faults.size() < kMostFaults && !explains(fitter, fit)
                     ? fault_of_increments(robot, *log, *settings, *question, fit)
                     : std::nullopt;
    if (fault) {
      question->faults.push_back(*fault);
      *log = std::move(fault->log);
      continue;
    }
    const Eigen::MatrixX2d bounds = fitter.intervals(fit, seed);
    const std::vector<char> shown =
        shown_rows(fit, (bounds.col(1) - bounds.col(0)) / (2 * kNormal90));
    for (std::size_t k = 0; k < fit.rows.size(); ++k) {
      const KinematicRow& row = question->rows[k];
      if (!row.name.starts_with("marker_")) continue;
      const double had = value_in_file(robot, row.name);
      question->sensor.push_back(
          {row, had, fit.values[k], {bounds(k, 0), bounds(k, 1)}, shown[k] != 0});
    }
    return {};
  }
}

}  // namespace gapfarm
