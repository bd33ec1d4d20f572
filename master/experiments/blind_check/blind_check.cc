#include "master/experiments/blind_check/blind_check.h"

#include <algorithm>
#include <filesystem>

#include "common/base/ranges.h"
#include "common/config/model.h"
#include "common/math/statistics.h"
#include "common/trials/files.h"
#include "common/trials/read.h"
#include "master/experiments/crossfit/crossfit.h"
#include "master/farm/planned_trials.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

// Sealed truths in hand: just made, or those of a check that was stopped.
struct InHand {
  std::vector<SealedTruth> sealed;
  std::vector<OutOfReach> out_of_reach;
};

// Whether the folder holds this very check, stopped.
bool goes_on(const BlindCheckSettings& settings, const CheckPaths& paths) {
  if (settings.asked.empty() || !fs::exists(paths.state())) return false;
  const Result<CheckState> state = read_check_state(paths.state());
  return state && state->asked == settings.asked && !fs::exists(paths.result());
}

// A folder to start in: new, empty, or one whose making was cut short.
Status check_fresh(const CheckPaths& paths) {
  if (!fs::exists(paths.state())) return {};
  return Error{paths.out + ": holds another blind check, or a finished one; choose another --out"};
}

Result<InHand> make_cases(const Config& config, const BlindCheckSettings& settings,
                          const BlindCheckHooks& hooks, const CheckPaths& paths) {
  RETURN_IF_ERROR(check_fresh(paths));
  std::error_code code;
  fs::create_directories(paths.out, code);
  if (code) return Error{paths.out + ": cannot be made: " + code.message()};
  hooks.stages.began(0);
  ASSIGN_OR_RETURN(const auto farm, hooks.start_farm());
  ASSIGN_OR_RETURN(const auto planned,
                   planned_problem(config, settings.plan, settings.design.seed, *farm));
  ASSIGN_OR_RETURN(const auto design, draw_design(planned, settings.design, *farm));
  if (design.cases.empty()) return Error{"the design holds no case; ask for effects or nulls"};
  hooks.stages.began(1);
  ASSIGN_OR_RETURN(const auto logs, simulate_cases(config, design.cases, settings.plan, 0, *farm));
  InHand hand{{}, design.out_of_reach};
  for (std::size_t i = 0; i < logs.size(); ++i) {
    const Truth& truth = design.cases[i];
    RETURN_IF_ERROR(write_trials(logs[i], paths.trials(truth.id)));
    hand.sealed.push_back({truth.id, random_salt(), format_truth(truth)});
  }
  RETURN_IF_ERROR(write_file_atomically(paths.seals(), format_seals(hand.sealed)));
  // Last: from here on the check can go on.
  const CheckState state{design.out_of_reach, settings.asked};
  RETURN_IF_ERROR(write_check_state(state, paths.state()));
  return hand;
}

// Truths of the check as it was stopped, or as it was opened: that one is judged again.
Result<InHand> take_up(const CheckPaths& paths) {
  ASSIGN_OR_RETURN(const CheckState state, read_check_state(paths.state()));
  const bool opened = fs::exists(paths.opened_truths());
  const std::string file = opened ? paths.opened_truths() : paths.stopped_truths();
  const Result<std::string> text = read_text_file(file);
  if (!text) {
    return Error{file +
                 ": the truths are not there; they are written when a check is stopped, and "
                 "gone when it was killed.  Start again, in another --out"};
  }
  ASSIGN_OR_RETURN(const auto sealed, parse_sealed(*text, file));
  ASSIGN_OR_RETURN(const auto seals, read_text_file(paths.seals()));
  RETURN_IF_ERROR(verify_seals(sealed, seals, paths.seals()));
  // They do not lie about while diagnoses run.
  std::error_code ignored;
  fs::remove(paths.stopped_truths(), ignored);
  return InHand{sealed, state.out_of_reach};
}

Result<std::vector<Truth>> truths_of(const InHand& hand) {
  std::vector<Truth> truths;
  for (const SealedTruth& sealed : hand.sealed) {
    ASSIGN_OR_RETURN(Truth truth, parse_truth(sealed.truth, sealed.id, sealed.id));
    truths.push_back(std::move(truth));
  }
  return truths;
}

Status open_truths(const InHand& hand, const CheckPaths& paths) {
  ASSIGN_OR_RETURN(const auto seals, read_text_file(paths.seals()));
  RETURN_IF_ERROR(verify_seals(hand.sealed, seals, paths.seals()));
  for (const SealedTruth& sealed : hand.sealed) {
    RETURN_IF_ERROR(write_file_atomically(paths.truth(sealed.id), sealed.truth));
  }
  return write_file_atomically(paths.opened_truths(), format_sealed(hand.sealed));
}

// A case whose diagnosis left its models.
struct DiagnosedCase {
  std::size_t place = 0;  // among all
  ParameterValues tuned;  // of the base alone
  Model final_;           // with the named effects; may have a [residual]
};

// tuned.toml and model.toml in `folder`; none when one is missing or of another scenario.
std::optional<DiagnosedCase> read_diagnosed(std::size_t place, const std::string& folder) {
  const Result<Model> tuned = read_model(folder + "/tuned.toml");
  Result<Model> final_model = read_model(folder + "/model.toml");
  if (!tuned || !final_model || tuned->scenario != final_model->scenario) return std::nullopt;
  return DiagnosedCase{place, tuned->values, *std::move(final_model)};
}

std::optional<double> mean_log_score(const PredictedEnds& predicted) {
  if (predicted.log_scores.empty()) return std::nullopt;
  return mean(predicted.log_scores);
}

// How models predict a second log of the truth, which the problem is about.  None: a prediction did
// not end well.
Result<std::optional<FreshScores>> score_fresh(Problem problem, const DiagnosedCase& of,
                                               Farm& farm) {
  const std::vector<ParameterValues> points = {of.tuned, of.final_.values, problem.values};
  ASSIGN_OR_RETURN(const auto predicted, predict_ends(problem, points, farm, true));
  const auto scores = mapped(predicted, mean_log_score);
  if (!scores[0] || !scores[1] || !scores[2]) return std::optional<FreshScores>();
  FreshScores fresh{*scores[0], *scores[1], *scores[2], std::nullopt};
  if (!of.final_.residual.empty()) {
    problem.residual = of.final_.residual;
    ASSIGN_OR_RETURN(const auto corrected, predict_ends(problem, {of.final_.values}, farm, true));
    fresh.corrected = mean_log_score(corrected.front());
  }
  return std::optional(fresh);
}

// Promised against realised, for the cases in which an effect was named; and what is closed of
// effects that could not be.  Each on a second log of its truth: other noise and, without a plan of
// the settings, another plan.
Status add_realised(const Config& config, const BlindCheckSettings& settings,
                    const BlindCheckHooks& hooks, const CheckPaths& paths,
                    std::vector<ScoredCase>& cases) {
  std::vector<DiagnosedCase> diagnosed;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    if (!cases[i].promised && cases[i].truth.excluded.empty()) continue;
    auto models = read_diagnosed(i, paths.diagnosis(cases[i].truth.id));
    if (models) diagnosed.push_back(*std::move(models));
  }
  if (diagnosed.empty()) return {};
  hooks.stages.began(3);
  ASSIGN_OR_RETURN(const auto farm, hooks.start_farm());
  const auto truths =
      mapped(diagnosed, [&](const DiagnosedCase& d) { return cases[d.place].truth; });
  ASSIGN_OR_RETURN(std::vector<TrialLog> logs,
                   simulate_cases(config, truths, settings.plan, /*seed_offset=*/1, *farm));
  for (std::size_t i = 0; i < diagnosed.size(); ++i) {
    Problem problem = without_log(config.problem);
    problem.log = std::move(logs[i]);
    for (Trial& trial : problem.log.trials) trial.path.clear();
    for (const v1::Override& o : overrides_of(problem.table(), truths[i])) {
      problem.values[o.parameter()] = o.value();
    }
    ScoredCase& scored = cases[diagnosed[i].place];
    ASSIGN_OR_RETURN(scored.fresh, score_fresh(std::move(problem), diagnosed[i], *farm));
    if (scored.fresh && scored.promised) scored.realised = realised_shrinkage(*scored.fresh);
  }
  return {};
}

ScoredCase scored(const Truth& truth, const CheckPaths& paths) {
  ChildEnd end = read_outcome(paths.outcome(truth.id));
  std::optional<Diagnosis> reported = read_reported(paths.diagnosis(truth.id), end);
  return score_case(truth, end, std::move(reported));
}

Status write_report(const BlindReport& report, const CheckPaths& paths) {
  RETURN_IF_ERROR(write_file_atomically(paths.result(), format_blind_json(report)));
  return write_file_atomically(paths.out + "/blind_check.md", format_blind_markdown(report));
}

Status diagnose_blindly(const InHand& hand, const std::vector<Truth>& truths,
                        const BlindCheckSettings& settings, const BlindCheckHooks& hooks,
                        const CheckPaths& paths) {
  const auto open = mapped(truths, [&](const Truth& truth) {
    return OpenCase{truth.id, paths.trials(truth.id), truth.excluded};
  });
  const PrivateMemory unreadable;
  Status diagnosed = diagnose_cases(open, paths, settings.diagnose, hooks);
  if (diagnosed) return {};
  // A file that only its owner can read.
  RETURN_IF_ERROR(write_file_atomically(paths.stopped_truths(), format_sealed(hand.sealed),
                                        IfThere::kReplace, 0600));
  hooks.note("the truths are in " + paths.stopped_truths() + " until the check goes on");
  return diagnosed;
}

}  // namespace

Result<Problem> planned_problem(const Config& config, const SessionPlans& plan, std::uint64_t seed,
                                Farm& farm) {
  Truth own;
  own.id = "the config's own robot";
  own.seed = seed;
  ASSIGN_OR_RETURN(auto logs, simulate_cases(config, {own}, plan, 0, farm));
  Problem problem = config.problem;
  problem.fitness.kind = FitnessKind::kLogScore;
  problem.log = std::move(logs.front());
  for (Trial& trial : problem.log.trials) trial.path.clear();
  if (problem.log.trials.empty()) return Error{"the planned experiment has no trial"};
  return problem;
}

Result<BlindReport> run_blind_check(const Config& config, const BlindCheckSettings& settings,
                                    const BlindCheckHooks& hooks) {
  const CheckPaths paths{settings.out};
  ASSIGN_OR_RETURN(const InHand hand, goes_on(settings, paths)
                                          ? take_up(paths)
                                          : make_cases(config, settings, hooks, paths));
  ASSIGN_OR_RETURN(const auto truths, truths_of(hand));
  hooks.note(std::to_string(truths.size()) + " cases sealed, see " + paths.seals());
  RETURN_IF_ERROR(hooks.on_sealed());
  RETURN_IF_ERROR(diagnose_blindly(hand, truths, settings, hooks, paths));
  RETURN_IF_ERROR(open_truths(hand, paths));
  BlindReport report{settings.provenance, {}, hand.out_of_reach};
  for (const Truth& truth : truths) report.cases.push_back(scored(truth, paths));
  RETURN_IF_ERROR(add_realised(config, settings, hooks, paths, report.cases));
  RETURN_IF_ERROR(write_report(report, paths));
  return report;
}

Result<BlindReport> run_foreign_check(const std::string& cases, const std::string& truths,
                                      const BlindCheckSettings& settings,
                                      const BlindCheckHooks& hooks) {
  const CheckPaths paths{settings.out};
  std::vector<OpenCase> open;
  std::error_code code;
  for (const fs::directory_entry& entry : fs::directory_iterator(cases, code)) {
    const std::string trials = (entry.path() / "trials.csv").string();
    if (fs::exists(trials)) open.push_back({entry.path().filename().string(), trials, ""});
  }
  if (open.empty()) {
    return Error{cases + ": has no CASE/trials.csv" + (code ? " (" + code.message() + ")" : "")};
  }
  std::ranges::sort(open, {}, &OpenCase::id);
  if (!goes_on(settings, paths)) {
    RETURN_IF_ERROR(check_fresh(paths));
    RETURN_IF_ERROR(write_check_state({{}, settings.asked}, paths.state()));
  }
  RETURN_IF_ERROR(diagnose_cases(open, paths, settings.diagnose, hooks));
  BlindReport report{settings.provenance, {}, {}};
  for (const OpenCase& c : open) {
    const std::string file = truths + "/" + c.id + ".json";
    Truth truth;
    truth.id = c.id;
    const bool has_truth = !truths.empty() && fs::exists(file);
    if (has_truth) {
      ASSIGN_OR_RETURN(const std::string text, read_text_file(file));
      ASSIGN_OR_RETURN(truth, parse_truth(text, file, c.id));
    }
    report.cases.push_back(scored(truth, paths));
    report.cases.back().has_truth = has_truth;
  }
  RETURN_IF_ERROR(write_report(report, paths));
  return report;
}

}  // namespace gapfarm
