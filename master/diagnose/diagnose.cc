#include "master/diagnose/diagnose.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/base/guarded.h"
#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/math/laws.h"
#include "common/math/statistics.h"
#include "common/progress/overall_progress.h"
#include "common/trials/trial.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/conclusions/report_parts.h"
#include "master/diagnose/steps/steps.h"
#include "master/diagnose/steps/watch.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {
namespace {

// What the catalogue makes of a log.
struct Answer {
  std::optional<steps::Screening> screening;
  std::optional<steps::Judgement> judgement;
  std::optional<steps::Refit> refit;
};

Status ask(const steps::DiagnosisRequest& of, const steps::Evidence& measured, StageClock* stages,
           Answer* answer) {
  const auto begin = [&](int stage) { stages->begin(kDiagnosisStages[stage].name); };
  begin(2);
  ASSIGN_OR_RETURN(answer->screening, guarded([&] { return steps::screen(of, measured); }));
  const steps::Screening& screening = *answer->screening;
  emit_readings(of, screening.found);
  emit_choice(of, screening.found, screening.warning.has_value());
  begin(3);
  ASSIGN_OR_RETURN(answer->judgement, guarded([&] { return steps::judge(of, screening); }));
  emit_verdict(of, *answer->judgement);
  begin(4);
  ASSIGN_OR_RETURN(answer->refit, guarded([&] {
                     return steps::refit(of, measured, screening, *answer->judgement);
                   }));
  return {};
}

// The steps in the order of docs/diagnosis.md.
Result<DiagnosisResult> take_steps(const steps::DiagnosisRequest& of, StageClock* stages) {
  steps::PartialResult known;
  const auto end_with = [&](const Error& error) -> Result<DiagnosisResult> {
    // What cannot be simulated is no reason to be without a report.
    if (error.code != ErrorCode::kSimulation) return error;
    return fail_with_partial_report(of, known, stages->present, error);
  };
  stages->begin(kDiagnosisStages[0].name);
  const Result<Study> tuned = guarded([&] { return steps::tune(of); });
  if (!tuned) return end_with(tuned.error());
  known.tuned = &*tuned;
  emit_base(of, *tuned);

  stages->begin(kDiagnosisStages[1].name);
  const Result<steps::Evidence> measured = guarded([&] { return steps::measure(of, *tuned); });
  if (!measured) return end_with(measured.error());
  emit_noise(of, measured->study);

  Answer found;
  const Status answered = ask(of, *measured, stages, &found);
  if (found.screening) known.screening = &*found.screening;
  if (found.judgement) known.judged = &*found.judgement;
  if (!answered) return end_with(answered.error());
  known.judged = &found.refit->judged;

  stages->begin(kDiagnosisStages[5].name);
  auto result = guarded(
      [&] { return steps::report(of, *known.screening, steps::add_shape(of, *found.refit)); });
  return result ? std::move(result) : end_with(result.error());
}

// A test whose number is none is no evidence, neither of an effect nor of its absence.
void warn_of_undefined_tests(Diagnosis* d) {
  d->cautions.push_back(
      "Some tests met numbers that are not finite and count as no evidence (p = 1): look for "
      "trials far from all others, or bring [parameters] closer to the robot.");
  if (d->verdict == Verdict::kNone) d->verdict = Verdict::kUnknown;
}

// Places reach 10 m; a log that uses half of that is taken relative to its own middle.
constexpr double kNearWorld_m = 5;

// Of start poses, by coordinate: a few wild rows do not move it.
double middle(const TrialLog& log, double Pose::*coordinate) {
  std::vector<double> values =
      mapped(log.trials, [&](const Trial& t) { return t.X_WS.*coordinate; });
  // Whole metres keep the grid of rounded readings.
  return values.empty() ? 0 : std::round(median(values));
}

bool far_out(const TrialLog& log) {
  std::vector<double> reaches = mapped(
      log.trials, [](const Trial& t) { return std::max(std::abs(t.X_WS.x), std::abs(t.X_WS.y)); });
  return !reaches.empty() && quantile(reaches, 0.95) > kNearWorld_m;
}

}  // namespace

Result<DiagnosisResult> diagnose(Farm& farm, const Problem& problem,
                                 const DiagnoseOptions& options) {
  const std::shared_ptr<const DiagnosisSubject> subject = diagnosis_subject(problem);
  if (subject == nullptr) {
    return Error{"scenario " + problem.scenario +
                 " cannot be diagnosed: it has no catalogue of effects; `gapfarm influence` says "
                 "what its parameters do"};
  }
  if (Status s = check_excluded(problem, options.excluded); !s) return s.error();
  const PreparedLog log = prepare_log(problem, options.frame_m);
  if (any_unusable(log.sanity)) return unusable_result(log);
  Predictor predictor(farm, log.problem);
  StageClock stages(options.on_stage);
  const std::uint64_t undefined_before = undefined_laws();
  auto result = take_steps({farm, predictor, log.problem, *subject, options, log.frame_m}, &stages);
  if (!result) return result;
  stages.begin("");
  Diagnosis& d = result->diagnosis;
  if (undefined_laws() != undefined_before) warn_of_undefined_tests(&d);
  d.timing_s = stages.timing_s;
  d.sanity.insert(d.sanity.end(), log.sanity.begin(), log.sanity.end());
  fill_conclusions(*subject->effects, &d);
  return result;
}

Status check_excluded(const Problem& problem, const std::vector<std::string>& excluded) {
  std::vector<std::string> known = mapped(problem.table().effects(), &Effect::name);
  for (const std::string& name : excluded) {
    if (!contains(known, name)) {
      return Error{"there is no effect '" + name + "' to omit" + suggestion(name, known)};
    }
  }
  return {};
}

PreparedLog prepare_log(const Problem& problem, const std::optional<Eigen::Vector2d>& frame_m) {
  std::vector<std::size_t> impossible;
  PreparedLog prepared;
  prepared.problem = problem;
  prepared.sanity = check_sanity(problem, &impossible);
  if (any_unusable(prepared.sanity)) return prepared;
  TrialLog& log = prepared.problem.log;
  for (auto row = impossible.rbegin(); row != impossible.rend(); ++row) {
    log.trials.erase(log.trials.begin() + static_cast<std::ptrdiff_t>(*row));
  }
  if (frame_m) {
    prepared.frame_m = *frame_m;
  } else if (far_out(log)) {
    prepared.frame_m = {middle(log, &Pose::x), middle(log, &Pose::y)};
  }
  log = shifted(std::move(log), -prepared.frame_m.x(), -prepared.frame_m.y());
  return prepared;
}

DiagnosisResult unusable_result(const PreparedLog& log) {
  DiagnosisResult result;
  Diagnosis& d = result.diagnosis;
  d.verdict = Verdict::kUnusable;
  d.sanity = log.sanity;
  for (const SanityFinding& f : log.sanity) {
    if (!f.names_an_effect || f.severity != Severity::kUnusable) continue;
    NamedEffect effect;
    effect.name = f.name;
    effect.aliases = f.or_else;
    effect.confidence = sanity_confidence();
    effect.text = f.text + " " + f.remedy;
    d.effects.push_back(std::move(effect));
  }
  fill_conclusions(drive_effect_diagnoses(), &d);
  result.tuned = result.final_ = log.problem.values;
  result.intervals.assign(result.final_.size(), {1, 0});
  return result;
}

}  // namespace gapfarm
