#include "master/ground/diagnose_ground.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <functional>

#include "common/base/guarded.h"
#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/math/laws.h"
#include "common/progress/overall_progress.h"
#include "common/robot/robot.h"
#include "master/ground/reference.h"
#include "master/ground/tolerances.h"

namespace gapfarm {
namespace {

GroundQuestion ask_what_is_wrong(const GroundRobot& robot, const RunLog& log) {
  GroundQuestion question;
  question.rows = kinematic_rows(robot);
  question.catalogue = that_can_show(log, ground_hypotheses(robot));
  add_gyro_scale(log, &question.rows);
  return question;
}

void set_sensor(const SensorValue& v, GroundRobot* robot) {
  if (v.row.name == "marker_x") {
    robot->X_RM.x = v.value;
  } else if (v.row.name == "marker_y") {
    robot->X_RM.y = v.value;
  } else {
    robot->X_RM.theta = wrap_angle(v.value);
  }
}

// The robot with the pose that increments give their sensor, and what is asked of it then: all but
// that pose.
Result<GroundRobot> sense(const GroundRobot& robot, GroundWork* work, RunLog* log,
                          GroundQuestion* question) {
  std::erase_if(question->catalogue, [](const GroundHypothesis& h) {
    return !h.freed.empty() && h.freed[0].name.starts_with("marker_");
  });
  RETURN_IF_ERROR(settle_sensor(robot, &work->windows, work->seed, log, question));
  GroundRobot sensed = robot;
  for (const SensorValue& v : question->sensor) {
    set_sensor(v, &sensed);
    for (KinematicRow& row : question->rows) {
      if (row.name != v.row.name) continue;
      row.nominal = v.value;
      row.tolerance =
          std::max(row.tolerance, (v.interval.upper - v.interval.lower) / (2 * kNormal90));
    }
  }
  return sensed;
}

Status exclude(const std::vector<std::string>& names, std::vector<GroundHypothesis>* catalogue) {
  const std::vector<std::string> known = mapped(*catalogue, &GroundHypothesis::name);
  for (const std::string& name : names) {
    if (!contains(known, name)) {
      return Error{"--exclude: this robot's catalogue has no \"" + name + "\"" +
                   suggestion(name, known)};
    }
    std::erase_if(*catalogue, [&](const GroundHypothesis& h) { return h.name == name; });
  }
  return {};
}

// What was chosen or is known, of report_ground()'s values; what lies before measured wheel speeds
// is not the file's.
Kinematics chosen_values(const GroundSearch& search, const std::vector<ReportedValue>& values) {
  Kinematics at;
  for (std::size_t j = 0; j < search.fit.rows.size(); ++j) {
    const bool named = search.reference ? search.fit.rows[j].free : values[j].named;
    if (named) at.add(values[j].name, values[j].reported);
  }
  if (search.reference) search.reference->complete(&at);
  Kinematics kept;
  for (std::size_t k = 0; k < at.names.size(); ++k) {
    const bool before_wheels = at.names[k] == "lag" || at.names[k] == "delay";
    if (!search.loop || !before_wheels) kept.add(at.names[k], at.values[k]);
  }
  return kept;
}

// The file's robot, driven as `driven` is.
Result<GroundDiagnosis> diagnose_driven(GroundRobot file, GroundRobot robot, RunLog log,
                                        const GroundDiagnoseOptions& options,
                                        const std::optional<WheelLoop>& loop,
                                        GroundQuestion question) {
  StageClock clock(options.on_stage);
  GroundWork work = options;
  if (options.reference) {
    clock.begin(kGroundStages[0].name);
    ASSIGN_OR_RETURN(auto asked, ask_what_changed(robot, *options.reference, options.windows,
                                                  options.seed, options.memo));
    question = std::move(asked);
  }
  RETURN_IF_ERROR(exclude(options.excluded, &question.catalogue));
  tolerate_ramps(robot, log, &question.catalogue);
  const std::string as_it_was = format_robot(file);
  if (log.relative && !options.reference) {
    clock.begin(kFaultStage);
    ASSIGN_OR_RETURN(auto sensed, sense(robot, &work, &log, &question));
    robot = std::move(sensed);
  }
  work.on_stage = [&](const std::string& stage) { clock.begin(stage); };
  ASSIGN_OR_RETURN(auto search, search_ground(robot, log, question, work));
  search.loop = loop;
  for (const SensorValue& v : search.sensor) {
    if (v.shown) set_sensor(v, &file);
  }
  clock.begin(std::end(kGroundStages)[-1].name);
  GroundDiagnosis result = report_ground(robot, search, options);
  result.corrected = robot_with(file, chosen_values(search, result.values));
  if (search.faults.empty() && !search.reference && !search.windows.simulated &&
      !result.diagnosis.effects.empty() && format_robot(result.corrected) == as_it_was) {
    result.diagnosis.action = "The robot's file has no word for that, and stays as it is.";
  }
  clock.begin("");
  result.diagnosis.timing_s = std::move(clock.timing_s);
  return result;
}

std::vector<SanityFinding> wrong_way_round(const GroundRobot& robot, const RunLog& log) {
  GroundQuestion question = ask_what_is_wrong(robot, log);
  WindowSettings windows = {{2}, 0.5};
  const auto found = [&](std::size_t hypothesis, const std::string& evidence) {
    const GroundHypothesis& h = question.catalogue[hypothesis];
    return std::vector<SanityFinding>{{h.name, "With " + h.thing + " put right, " + evidence,
                                       h.remedy, Severity::kWarning, true, h.aliases}};
  };
  if (log.relative) {
    RunLog settled = log;
    if (!settle_sensor(robot, &windows, 1, &settled, &question) || question.faults.empty())
      return {};
    return found(question.faults.front().hypothesis,
                 "increments follow the robot's wheels, else they do not.");
  }
  const auto fault = find_ground_fault(robot, log, question, windows);
  if (!fault) return {};
  return found(fault->hypothesis,
               fmt::format("what the robot's file expects is {:.1f} times as near to what was "
                           "measured.",
                           fault->shrinks));
}

constexpr std::size_t kMostOffersReported = 6;

std::string things_of(const GroundSearch& search, const std::vector<std::size_t>& hypotheses) {
  return joined(hypotheses, ", ", [&](std::size_t h) { return search.catalogue[h].thing; });
}

// Faults of the log are looked for before.
std::size_t to_try(const GroundSearch& search) {
  return static_cast<std::size_t>(std::ranges::count_if(
      search.catalogue, [](const GroundHypothesis& h) { return !h.put_right; }));
}

std::string nats_text(double nats) { return fmt::format("{:.1f}", nats); }

void emit(const GroundWork& work, Finding finding) {
  if (work.on_finding) work.on_finding(std::move(finding));
}

}  // namespace

Result<GroundDiagnosis> diagnose_by(const GroundRobot& robot, const RunLog& log,
                                    const GroundDiagnoseOptions& options, GroundQuestion question) {
  return diagnose_driven(robot, robot, log, options, {}, std::move(question));
}

namespace {

// The robot as measured speeds drive it, with the log of these.
struct Driven {
  GroundRobot robot;
  RunLog log;
  double rows_late_s = 0;
};

Driven by_wheels(const GroundRobot& robot, const RunLog& log, const GroundWork& work) {
  Driven driven{driven_by_wheels(robot, log), driven_by_wheels(log)};
  driven.rows_late_s = wheel_rows_late_s(driven.robot, driven.log, work.windows);
  for (LoggedRun& run : driven.log.runs) {
    for (CommandRow& row : run.commands) row.t_s -= driven.rows_late_s;
  }
  return driven;
}

// Beside what was found behind the wheels what lies before them: how late and slowly they follow
// commands, with the robot as it was corrected.
Status add_motors(const RunLog& log, GroundDiagnoseOptions options, GroundDiagnosis* found) {
  if (log.relative) return {};
  if (found->figures.faults > 0) {
    found->diagnosis.cautions.push_back(
        "How late and slowly the wheels follow commands was not asked: put right what is named "
        "first, and diagnose again.");
    return {};
  }
  GroundQuestion question = ask_what_is_wrong(found->corrected, log);
  std::erase_if(question.catalogue, [&](const GroundHypothesis& h) {
    static const std::vector<std::string> kMotors = {
        "command_delay", "motor_lag", "acceleration_limit", "motor_deadband", "battery_sag"};
    return h.put_right || !contains(kMotors, h.name) || contains(options.excluded, h.name);
  });
  options.excluded.clear();
  ASSIGN_OR_RETURN(auto before, diagnose_by(found->corrected, log, options, std::move(question)));
  Diagnosis& d = found->diagnosis;
  // Behind the wheels there is nothing; what is left, named or not, lies before them.
  if (d.verdict == Verdict::kNone && before.diagnosis.verdict != Verdict::kNone) {
    append(before.diagnosis.cautions, std::move(d.cautions));
    *found = std::move(before);
    return {};
  }
  if (before.diagnosis.effects.empty()) return {};
  const bool first = d.effects.empty();
  d.headline = first ? before.diagnosis.headline
                     : d.headline + " Beside it: " +
                           joined(before.diagnosis.effects, ", ", &NamedEffect::name) + ".";
  if (first) d.action = before.diagnosis.action;
  d.cautions.push_back(
      "What lies between commands and wheels was judged by the commands: its share is of the gap "
      "that these leave.");
  append(d.effects, std::move(before.diagnosis.effects));
  append(found->figures.named, std::move(before.figures.named));
  d.verdict = ground_verdict(found->figures);
  found->corrected = std::move(before.corrected);
  return {};
}

Result<GroundDiagnosis> diagnose_measured(const GroundRobot& robot, const RunLog& log,
                                          const GroundDiagnoseOptions& options) {
  GroundDiagnoseOptions of_slip = options;
  const RunLog* reference = options.reference ? &*options.reference : nullptr;
  const Driven driven = by_wheels(robot, log, options);
  if (reference != nullptr) of_slip.reference = by_wheels(robot, *reference, options).log;
  ASSIGN_OR_RETURN(auto found,
                   diagnose_driven(robot, driven.robot, driven.log, of_slip,
                                   measure_wheel_loop(robot, log, reference, options.seed),
                                   ask_what_is_wrong(driven.robot, driven.log)));
  if (driven.rows_late_s > 0) {
    found.diagnosis.cautions.push_back(fmt::format(
        "Rows of wheel speeds were taken to hold from {:.3g} s before their stamps on, which "
        "explains the motions far better.",
        driven.rows_late_s));
  }
  if (reference != nullptr) {
    found.diagnosis.cautions.push_back(
        "How late and slowly the wheels follow commands was not compared: diagnose each log by "
        "itself for that.");
    return found;
  }
  const Status added = add_motors(log, options, &found);
  if (!added && options.stopped && options.stopped()) return added.error();
  if (!added) {
    found.diagnosis.cautions.push_back(
        "What lies between commands and wheels could not be asked: " + added.error().message + ".");
  }
  return found;
}

}  // namespace

Result<GroundDiagnosis> diagnose_ground(const GroundRobot& robot, const RunLog& logged,
                                        const GroundDiagnoseOptions& options) {
  const RunChecks checks = check_runs(logged, robot.motors.command_timeout_s);
  if (checks.none_is_left(logged)) {
    return Error{joined(checks.findings, " ",
                        [](const SanityFinding& f) { return f.text + " " + f.remedy; })};
  }
  const RunLog log = without(logged, checks);
  GroundDiagnoseOptions useful = options;
  if (useful.reference)
    useful.reference = without(*options.reference, check_jumps(*options.reference));
  auto result = guarded([&]() -> Result<GroundDiagnosis> {
    const RunLog* reference = useful.reference ? &*useful.reference : nullptr;
    const bool measured = has_wheel_speeds(robot, log) &&
                          (reference == nullptr || has_wheel_speeds(robot, *reference));
    return measured ? diagnose_measured(robot, log, useful)
                    : diagnose_by(robot, log, useful, ask_what_is_wrong(robot, log));
  });
  if (!result) return result;
  append(result->diagnosis.sanity, checks.findings);
  return result;
}

std::vector<SanityFinding> check_ground_log(const GroundRobot& robot, const RunLog& log) {
  RunChecks checks = check_runs(log, robot.motors.command_timeout_s);
  if (checks.none_is_left(log)) return checks.findings;
  const RunLog useful = without(log, checks);
  std::vector<SanityFinding> findings = wrong_way_round(robot, useful);
  // Headings in degrees jump wherever the robot turns.
  if (findings.empty()) findings = check_jumps(useful).findings;
  append(findings, checks.findings);
  return findings;
}

Status read_useful_runs(std::span<const std::string> folders, const WindowSettings& windows,
                        Problem* problem) {
  ASSIGN_OR_RETURN(auto log, read_run_folders(folders, problem->channels()));
  if (!problem->ground) return set_runs(log, windows, problem);
  const GroundRobot robot = problem->ground->robot_at(problem->values);
  const RunChecks checks = check_runs(log, robot.motors.command_timeout_s);
  if (checks.none_is_left(log)) return set_runs(log, windows, problem);
  if (!checks.useless.empty()) {
    log.notes.push_back(
        "omitted runs, which gapfarm check explains: " +
        joined(checks.useless, ", ", [&](std::size_t r) { return log.runs[r].run; }));
  }
  log = without(std::move(log), checks);
  // Headings in degrees jump wherever the robot turns.
  const RunChecks jumps = check_jumps(log);
  if (!jumps.false_poses.empty() && wrong_way_round(robot, log).empty()) {
    log.notes.push_back(
        fmt::format("omitted {} poses, which gapfarm check explains", jumps.false_poses.size()));
    log = without(std::move(log), jumps);
  }
  return set_runs(log, windows, problem);
}

void emit_faults(const GroundWork& work, const GroundSearch& search) {
  const std::string found =
      search.faults.empty()
          ? "Nothing of the log is the wrong way round or in another unit."
          : "With this put right, the log is far closer to what is expected: " +
                things_of(search, mapped(search.faults, &FoundFault::hypothesis)) + ".";
  emit(work, {"faults of the log",
              found + fmt::format(" {} windows of {} stretches are held against the {}.",
                                  search.windows.trials.size(), search.windows.blocks,
                                  search.windows.simulated ? "program" : "robot's kinematics"),
              {},
              {}});
}

void emit_offers(const GroundWork& work, const GroundSearch& search,
                 const std::vector<Offer>& tried) {
  std::vector<Offer> best = tried;
  std::ranges::stable_sort(best, std::greater(), &Offer::gain);
  // Most change nothing of what stands there.
  const bool more = best.size() > kMostOffersReported;
  if (more && best[kMostOffersReported - 1].gain >= tried.back().gain &&
      tried.size() < to_try(search)) {
    return;
  }
  if (more) best.resize(kMostOffersReported);
  Finding finding{
      "what the catalogue offers",
      fmt::format("{} of {} values tried{}; one is named from {:g} nats on.", tried.size(),
                  to_try(search), search.steps.empty() ? "" : " beside what is named",
                  kLeastGroundGain),
      {"value", "would gain, nats"},
      {}};
  for (const Offer& offer : best) {
    if (offer.gain <= 0) continue;
    finding.rows.emplace_back(search.catalogue[offer.hypothesis].thing, nats_text(offer.gain));
  }
  emit(work, std::move(finding));
}

void emit_steps(const GroundWork& work, const GroundSearch& search) {
  Finding finding{"what is named so far",
                  search.steps.empty() ? "Nothing of the catalogue is worth a name so far."
                                       : "Better on stretches that were held out, too:",
                  {"value", "gains, nats"},
                  {}};
  for (const GroundStep& step : search.steps) {
    const std::string& thing = search.catalogue[step.chosen].thing;
    finding.rows.emplace_back(thing, nats_text(step.gain));
    if (step.not_distinguished.empty()) continue;
    finding.text += " " + thing + " is not distinguished from " +
                    things_of(search, step.not_distinguished) + ".";
  }
  emit(work, std::move(finding));
}

void emit_rest(const GroundWork& work, const GroundSearch& search) {
  GroundFigures figures;
  figures.closable = search.closable;
  figures.best_of_all = search.best_of_all;
  emit(work, {"what is left", verdict_reason(figures), {}, {}});
}

}  // namespace gapfarm
