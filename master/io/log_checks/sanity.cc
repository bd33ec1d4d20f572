#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/trials/context.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {
namespace {

constexpr double kMostImpossible = 0.05;  // of the trials
constexpr std::size_t kMostRowsListed = 8;
constexpr double kTimesAsFar = 2;
// By chance some drives lead back to where the one before began: one in hundreds, of any log.
constexpr std::size_t kFewestFollowing = 8, kTimesAsMany = 5;
constexpr double kBeyond_m = 0.3;  // what a camera's seam or a late reading may add

// Nobody says how fast and how wide a program's robot may be; nothing on wheels in a user's log
// goes faster.
constexpr double kSlowestProgram_m_s = 0.005, kFastestProgram_m_s = 30;

bool has_drives(const Problem& problem) {
  return problem.scenario == "srv1" || problem.scenario == "external";
}

DriveLimits limits_of(const Problem& problem) {
  if (scenario_form(problem.scenario).program) {
    return {kSlowestProgram_m_s, kFastestProgram_m_s,
            std::sqrt(kSlowestProgram_m_s * kFastestProgram_m_s), 0};
  }
  const Parameter& speed = problem.table()[row_of(Srv1::kFullSpeed)];
  return {speed.lower, speed.upper, problem.values[row_of(Srv1::kFullSpeed)],
          problem.values[row_of(Srv1::kTrackGauge)]};
}

// Trials that would have to be too fast.
std::vector<std::size_t> too_fast_trials(const Problem& problem) {
  const std::vector<DriveSample> samples = drive_samples(problem);
  const double speed = full_speed_of(samples);
  std::vector<std::size_t> rows;
  if (speed <= 0) return rows;
  for (const DriveSample& s : samples) {
    if (s.distance_m() > kTimesAsFar * speed * s.most_s + kBeyond_m) rows.push_back(s.trial);
  }
  const auto all = static_cast<double>(samples.size());
  if (static_cast<double>(rows.size()) > kMostImpossible * all) rows.clear();
  return rows;
}

void note_rows(const Problem& problem, const std::vector<std::size_t>& rows, const char* name,
               const std::string& what, std::vector<SanityFinding>* findings) {
  if (rows.empty()) return;
  const auto listed = std::span(rows).first(std::min(rows.size(), kMostRowsListed));
  const std::string which = joined(listed, "; ", [&](std::size_t row) {
    const Trial& trial = problem.log.trials[row];
    return "session " + trial.session + ", trial " + std::to_string(trial.trial);
  });
  findings->push_back({name,
                       std::to_string(rows.size()) + " of " +
                           std::to_string(problem.log.trials.size()) + " trials " + what + " (" +
                           (listed.size() < rows.size() ? "the first: " : "") + which + ").",
                       "Look at these rows; a diagnosis leaves them out.", Severity::kNote});
}

// Of these trials, how many begin where the one before them ends.
std::size_t count_following(const TrialLog& log, const std::vector<DriveSample>& samples) {
  const std::vector<TrialContext> contexts =
      trial_contexts(log, std::vector<DrivenCommand>(log.trials.size()));
  return static_cast<std::size_t>(std::ranges::count_if(
      samples, [&](const DriveSample& s) { return !contexts[s.trial].moved; }));
}

// check_axes(), unless the trials show that it is before and after that are the wrong way round:
// exchanged, their axes are right and they follow one another, which as logged they do not.
std::optional<SanityFinding> check_ways_round(const TrialLog& log, std::vector<DriveSample> samples,
                                              const DriveLimits& limits) {
  auto axes = check_axes(samples, limits);
  if (!axes) return axes;
  const std::size_t as_logged = count_following(log, samples);
  for (DriveSample& s : samples) std::swap(s.X_WS, s.X_WE);
  if (check_axes(samples, limits)) return axes;
  TrialLog exchanged = log;
  for (Trial& t : exchanged.trials) std::swap(t.X_WS, t.X_WE);
  const std::size_t following = count_following(exchanged, samples);
  if (following < kFewestFollowing || following < kTimesAsMany * as_logged) return axes;
  axes->name = kEndsSwapped;
  axes->text = std::to_string(following) + " of " + std::to_string(samples.size()) +
               " trials end where the one before them starts, and " + std::to_string(as_logged) +
               " start where it ends. So before and after are exchanged.";
  axes->remedy = kExchangeEnds;
  axes->or_else.clear();
  return axes;
}

// One session may have been mounted or wired another way round.
void check_axes_of_sessions(const Problem& problem, const std::vector<DriveSample>& samples,
                            const DriveLimits& limits, std::vector<SanityFinding>* findings) {
  std::map<std::string, std::vector<DriveSample>> of_session;
  for (const DriveSample& s : samples) {
    of_session[problem.log.trials[s.trial].session].push_back(s);
  }
  for (const auto& [session, its] : of_session) {
    auto axes = check_ways_round(problem.log, its, limits);
    if (!axes) continue;
    axes->text = "In session " + session + " alone: " + axes->text;
    axes->remedy = "In session " + session + " alone: " + axes->remedy;
    findings->push_back(std::move(*axes));
  }
}

// Each only where the one before leaves it meaning: what does not move has no speed, and axes that
// do not fit say nothing of turns.
void check_drives(const Problem& problem, std::vector<SanityFinding>* findings) {
  const std::vector<DriveSample> samples = drive_samples(problem);
  const DriveLimits limits = limits_of(problem);
  if (check_motion(samples, limits, findings)) return;
  std::vector<TrialLength> speeds;
  for (const DriveSample& s : straight_samples(samples)) {
    if (s.distance_m() > 0) speeds.push_back({s.trial, s.distance_m() / std::abs(s.forward_s)});
  }
  if (check_mixed_units(problem.log, std::move(speeds), "straight drives", "x0, y0, x1 and y1",
                        findings))
    return;
  bool suspicious = check_speed(samples, limits, findings);
  if (check_heading_unit(samples, findings)) {
    suspicious = true;
  } else if (auto axes = check_ways_round(problem.log, samples, limits)) {
    findings->push_back(std::move(*axes));
    suspicious = true;
  } else if (check_related(samples, findings)) {
    suspicious = true;
  } else {
    check_axes_of_sessions(problem, samples, limits, findings);
    suspicious |= !findings->empty();
  }
  if (suspicious) return;
  check_turning(samples, limits, findings);
}

struct ImpossibleTrials {
  std::vector<std::size_t> fast, exchanged, contradicted;  // no trial is two of them
  TipJumps finger = {};

  std::vector<std::size_t> rows() const {
    std::set<std::size_t> all(finger.trials.begin(), finger.trials.end());
    all.insert(fast.begin(), fast.end());
    all.insert(exchanged.begin(), exchanged.end());
    all.insert(contradicted.begin(), contradicted.end());
    return {all.begin(), all.end()};
  }
};

ImpossibleTrials find_impossible(const Problem& problem) {
  ImpossibleTrials found;
  if (has_drives(problem)) found.fast = too_fast_trials(problem);
  if (problem.scenario == "push") found.finger = check_tip_jumps(problem.log);
  if (!has_drives(problem) && problem.scenario != "push") return found;
  std::ranges::set_difference(exchanged_commands(problem), found.fast,
                              std::back_inserter(found.exchanged));
  found.contradicted = filtered(false_readings(problem), [&](std::size_t row) {
    return !contains(found.fast, row) && !contains(found.exchanged, row);
  });
  return found;
}

void note_impossible(const Problem& problem, const ImpossibleTrials& found,
                     std::vector<SanityFinding>* findings) {
  append(*findings, found.finger.findings);
  note_rows(problem, found.fast, "impossible_rows",
            "end farther from their start than twice the log's own speed leads", findings);
  note_rows(problem, found.exchanged, "commands_exchanged",
            "end far from where drives of their command do, and where another command leads",
            findings);
  const std::string more =
      problem.scenario == "push" ? "no finger can have been there" : "it repeats their start";
  note_rows(problem, found.contradicted, "false_readings",
            "end where no other of their command does, and the reading before or after contradicts "
            "theirs, others repeat it to the last digit, " +
                more + ", or nothing else is as far off",
            findings);
}

}  // namespace

std::vector<SanityFinding> check_sanity(const Problem& problem,
                                        std::vector<std::size_t>* impossible) {
  std::vector<SanityFinding> findings;
  if (problem.log.trials.empty()) return findings;
  if (has_drives(problem)) check_drives(problem, &findings);
  if (problem.scenario == "push") check_pushes(problem, &findings);
  const ImpossibleTrials found = find_impossible(problem);
  const bool usable = !contains(findings, Severity::kUnusable, &SanityFinding::severity);
  if (usable) note_impossible(problem, found, &findings);
  if (impossible != nullptr) *impossible = found.rows();
  for (SanityFinding& f : findings) f.names_an_effect |= f.name == "unit_error";
  check_clock(problem.log, &findings);
  check_headings(problem.log, &findings);
  const bool still = contains(findings, "no_motion", &SanityFinding::name);
  if (!still) check_copies(problem.log, &findings);
  check_count(problem.log, &findings);
  std::ranges::stable_sort(findings, [](const SanityFinding& a, const SanityFinding& b) {
    return a.severity == Severity::kUnusable && b.severity == Severity::kNote;
  });
  return findings;
}

}  // namespace gapfarm
