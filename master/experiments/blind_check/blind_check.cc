#include "master/experiments/blind_check/blind_check.h"

#include <algorithm>
#include <filesystem>

#include "common/base/hash.h"
#include "common/trials/files.h"
#include "common/trials/write.h"
#include "master/experiments/blind_check/cases/seal.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

// Sealed truths in hand: just made, or taken from the box.
struct InHand {
  TruthKey key;
  std::vector<SealedTruth> sealed;
  std::vector<OutOfReach> out_of_reach;
};

std::string key_path_of(const BlindCheckSettings& settings) {
  return settings.key_path.empty() ? settings.out + ".key" : settings.key_path;
}

// Whether the folder holds this very check, stopped.
bool goes_on(const BlindCheckSettings& settings, const CheckPaths& paths) {
  if (settings.asked.empty() || !fs::exists(paths.state())) return false;
  const Result<CheckState> state = read_check_state(paths.state());
  return state && state->asked == settings.asked && !fs::exists(paths.result());
}

// A folder to start in: new, empty, or one whose making was cut short.
Status check_fresh(const CheckPaths& paths) {
  if (!fs::exists(paths.state())) return {};
  return Error{
      paths.out +
      ": holds another blind check, or a finished one; give --resume to go on with it as it "
      "was asked, or another --out"};
}

// A file that only its owner can read.
Status write_private_file(const std::string& path, std::string_view bytes) {
  return write_file_atomically(path, bytes, IfThere::kReplace, 0600);
}

Status make_out(const std::string& out) {
  std::error_code code;
  fs::create_directories(out, code);
  if (code) return Error{out + ": cannot be made: " + code.message()};
  return {};
}

Status write_cases(const std::vector<Truth>& cases, const std::vector<TrialLog>& logs,
                   const CheckPaths& paths) {
  for (std::size_t i = 0; i < cases.size(); ++i) {
    RETURN_IF_ERROR(write_trials(logs[i], paths.trials(cases[i].id)));
  }
  return {};
}

Result<InHand> make_cases(const Config& config, const BlindCheckSettings& settings,
                          const BlindCheckHooks& hooks, const CheckPaths& paths) {
  RETURN_IF_ERROR(check_fresh(paths));
  RETURN_IF_ERROR(make_out(paths.out));
  hooks.stages.began(0);
  ASSIGN_OR_RETURN(const auto farm, hooks.start_farm());
  ASSIGN_OR_RETURN(const auto planned,
                   planned_problem(config, settings.plan, settings.design.seed, *farm));
  ASSIGN_OR_RETURN(const auto design, draw_design(planned, settings.design, *farm));
  if (design.cases.empty()) return Error{"the design holds no case; ask for effects or nulls"};
  hooks.stages.began(1);
  ASSIGN_OR_RETURN(const auto logs, simulate_cases(config, design.cases, settings.plan, 0, *farm));
  RETURN_IF_ERROR(write_cases(design.cases, logs, paths));

  InHand hand{TruthKey::random(), {}, design.out_of_reach};
  for (const Truth& truth : design.cases) {
    hand.sealed.push_back({truth.id, random_salt(), format_truth(truth)});
  }
  RETURN_IF_ERROR(write_file_atomically(paths.seals(), format_seals(hand.sealed)));
  RETURN_IF_ERROR(write_private_file(paths.box(), hand.key.close_box(hand.sealed)));
  // Last: from here on the check can be resumed.
  const CheckState state{content_hash(config.text), design.out_of_reach, settings.asked};
  RETURN_IF_ERROR(write_check_state(state, paths.state()));
  return hand;
}

Result<TruthKey> find_key(const BlindCheckSettings& settings, const CheckPaths& paths) {
  // An opened check may be scored again.
  const std::string path =
      fs::exists(paths.opened_key()) ? paths.opened_key() : key_path_of(settings);
  const Result<std::string> text = read_text_file(path);
  if (!text) {
    return Error{path + ": the key that opens " + paths.box() +
                 " is not there; it is written when a check is stopped, and gone when it was "
                 "killed.  Start again (with --key FILE a killed check can be resumed too)"};
  }
  return TruthKey::parse(*text, path);
}

Result<InHand> take_up(const Config& config, const BlindCheckSettings& settings,
                       const CheckPaths& paths) {
  ASSIGN_OR_RETURN(const CheckState state, read_check_state(paths.state()));
  if (state.made_of != content_hash(config.text)) {
    return Error{paths.out + ": was made from another config than " + config.path +
                 "; resume it with that one, or choose another --out"};
  }
  ASSIGN_OR_RETURN(TruthKey key, find_key(settings, paths));
  ASSIGN_OR_RETURN(const auto box, read_text_file(paths.box()));
  ASSIGN_OR_RETURN(const auto sealed, key.open_box(box, paths.box()));
  ASSIGN_OR_RETURN(const auto seals, read_text_file(paths.seals()));
  RETURN_IF_ERROR(verify_seals(sealed, seals, paths.seals()));
  // No key lies about while diagnoses run, unless the user wants one.
  std::error_code ignored;
  if (settings.key_path.empty()) fs::remove(key_path_of(settings), ignored);
  return InHand{key, sealed, state.out_of_reach};
}

Result<std::vector<Truth>> truths_of(const InHand& hand) {
  std::vector<Truth> truths;
  for (const SealedTruth& sealed : hand.sealed) {
    ASSIGN_OR_RETURN(Truth truth, parse_truth(sealed.truth, sealed.id, sealed.id));
    truths.push_back(std::move(truth));
  }
  return truths;
}

Status open_truths(const InHand& hand, const BlindCheckSettings& settings,
                   const CheckPaths& paths) {
  ASSIGN_OR_RETURN(const auto seals, read_text_file(paths.seals()));
  RETURN_IF_ERROR(verify_seals(hand.sealed, seals, paths.seals()));
  std::string salts;
  for (const SealedTruth& sealed : hand.sealed) {
    RETURN_IF_ERROR(write_file_atomically(paths.truth(sealed.id), sealed.truth));
    salts += sealed.id + " " + sealed.salt + "\n";
  }
  RETURN_IF_ERROR(write_file_atomically(paths.salts(), salts));
  RETURN_IF_ERROR(write_file_atomically(paths.opened_key(), hand.key.text()));
  std::error_code ignored;
  fs::remove(key_path_of(settings), ignored);
  return {};
}

// Promised against realised, for the cases in which an effect was named; and what is closed of
// effects that could not be.
Status add_realised(const Config& config, const BlindCheckSettings& settings,
                    const BlindCheckHooks& hooks, const CheckPaths& paths,
                    std::vector<ScoredCase>& cases) {
  std::vector<DiagnosedCase> diagnosed;
  std::vector<std::size_t> owner;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    if (!cases[i].promised && cases[i].truth.excluded.empty()) continue;
    auto models = read_diagnosed_case(cases[i].truth, paths.diagnosis(cases[i].truth.id));
    if (!models) continue;
    diagnosed.push_back(std::move(*models));
    owner.push_back(i);
  }
  if (diagnosed.empty()) return {};
  hooks.stages.began(3);
  ASSIGN_OR_RETURN(const auto farm, hooks.start_farm());
  ASSIGN_OR_RETURN(const auto fresh, score_fresh_logs(config, diagnosed, settings.plan, *farm));
  for (std::size_t i = 0; i < owner.size(); ++i) {
    if (!fresh[i]) continue;
    cases[owner[i]].fresh = fresh[i];
    if (cases[owner[i]].promised) cases[owner[i]].realised = realised_shrinkage(*fresh[i]);
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
  std::vector<OpenCase> open;
  for (const Truth& truth : truths) {
    open.push_back({truth.id, paths.trials(truth.id), truth.excluded});
  }
  const PrivateMemory unreadable;
  const std::string key_path = key_path_of(settings);
  if (!settings.key_path.empty()) {
    RETURN_IF_ERROR(write_private_file(key_path, hand.key.text()));
  }
  Status diagnosed = diagnose_cases(open, paths, settings.diagnose, hooks);
  if (diagnosed) return {};
  RETURN_IF_ERROR(write_private_file(key_path, hand.key.text()));
  if (hooks.note)
    hooks.note("stopped; the key of the truths is in " + key_path +
               ", and the same command goes on from here");
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
  ASSIGN_OR_RETURN(const InHand hand, settings.resume || goes_on(settings, paths)
                                          ? take_up(config, settings, paths)
                                          : make_cases(config, settings, hooks, paths));
  ASSIGN_OR_RETURN(const auto truths, truths_of(hand));
  if (hooks.note) {
    hooks.note(std::to_string(truths.size()) + " cases sealed, see " + paths.seals());
  }
  if (hooks.on_sealed) {
    RETURN_IF_ERROR(hooks.on_sealed());
  }
  RETURN_IF_ERROR(diagnose_blindly(hand, truths, settings, hooks, paths));
  RETURN_IF_ERROR(open_truths(hand, settings, paths));
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
  const std::string made_of = fs::weakly_canonical(cases, code).string();
  if (!settings.resume && !goes_on(settings, paths)) {
    RETURN_IF_ERROR(check_fresh(paths));
    RETURN_IF_ERROR(write_check_state({made_of, {}, settings.asked}, paths.state()));
  } else {
    ASSIGN_OR_RETURN(const CheckState state, read_check_state(paths.state()));
    if (state.made_of != made_of) {
      return Error{paths.out + ": is the check of " + state.made_of + ", not of " + made_of};
    }
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
