// gapfarm diagnose CONFIG: where the gap lies, which effect causes it, how far it shrinks.
#include "master/diagnose/diagnose.h"

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>

#include "common/base/build_info.h"
#include "common/base/ranges.h"
#include "common/robot/robot.h"
#include "common/trials/files.h"
#include "master/cli/subcommand.h"
#include "master/command/outputs.h"
#include "master/command/page_along.h"
#include "master/command/provenance.h"
#include "master/diagnose/result/diagnosis_json.h"
#include "master/ground/diagnose_ground.h"
#include "master/ground/fit/fit_file.h"
#include "master/ground/fit/window_fit.h"
#include "master/ground/program_runs.h"
#include "master/report/report_html.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDiagnosisFile = "diagnosis.json";
constexpr const char* kAnswers = "simulations.sqlite";
constexpr const char* kFits = "fits.jsonl";

struct DiagnoseCommand : LongOptions {
  std::string config;
  TrialOptions trials;
  std::string model;
  std::vector<std::string> reference;  // of ground robots: what changed since
  std::optional<RunLog> reference_log;
  std::vector<std::string> exclude;
  std::optional<std::uint64_t> seed;
  PageOption page;
};

void add_diagnosis_provenance(const Config& config, const DiagnoseCommand& command,
                              Diagnosis* diagnosis) {
  auto& to = diagnosis->provenance;
  const TrialLog& log = config.problem.log;
  to.emplace_back("config", config.path);
  for (const std::string& file : config.trial_files) to.emplace_back("trials", file);
  to.emplace_back("problem", problem_hash(to_proto(config.problem)));
  to.emplace_back("trials read",
                  fmt::format("{} in {} sessions", log.trials.size(), count_sessions(log)));
  to.emplace_back("base model", command.model.empty() ? "tuned on this log" : command.model);
  for (const std::string& effect : command.exclude) {
    to.emplace_back("omitted from the catalogue", effect);
  }
  to.emplace_back("program", build_summary("gapfarm"));
  to.emplace_back("seed", std::to_string(config.seed));
}

std::string diagnosis_summary(const Diagnosis& d) {
  std::string text = d.headline + "\n  " + d.action + "\n";
  for (const SanityFinding& f : d.sanity) {
    text += "  " + f.name + ": " + f.text + " " + f.remedy + "\n";
  }
  if (d.verdict == Verdict::kUnusable) return text;
  for (const NamedEffect& e : d.effects) {
    text += fmt::format("  {}: confidence {:.2f}, closes {:.0f} % [{:.0f}, {:.0f}] of the gap",
                        e.name, e.confidence, 100 * e.closed, 100 * e.closed_lo, 100 * e.closed_hi);
    for (const Estimate& p : e.parameters) {
      // A seam's place is one along an axis.
      const std::string key =
          p.key == "position" && !e.axis.empty() ? p.key + " along " + e.axis : p.key;
      text += fmt::format(", {} {:.4g} [{:.4g}, {:.4g}] {}", key, p.value, p.lo, p.hi, p.unit);
      if (p.bound) {
        text += fmt::format(" (bound {:.3g}, {:.1f} times as wide)", *p.bound, *p.width_over_bound);
      }
    }
    if (!e.aliases.empty()) text += "; not distinguished from " + joined(e.aliases);
    text += "\n";
  }
  text += fmt::format(
      "  gap {:.3f} nats a trial tuned, {:.3f} final; {:.1f} mm and {:.1f} mrad tuned, {:.1f} and "
      "{:.1f} final, {:.1f} and {:.1f} at the floor\n",
      d.gap.tuned, d.gap.final_, d.position_mm.tuned, d.heading_mrad.tuned, d.position_mm.final_,
      d.heading_mrad.final_, d.position_mm.floor, d.heading_mrad.floor);
  std::string detectable;
  for (const Screened& s : d.screening) {
    if (contains(d.effects, s.effect, &NamedEffect::name)) continue;
    for (std::size_t i = 0; i < s.detectable_from.size(); ++i) {
      const auto& [key, size] = s.detectable_from[i];
      detectable += (i > 0                ? ", "
                     : detectable.empty() ? s.effect + " "
                                          : "; " + s.effect + " ") +
                    fmt::format("{} {:.3g}", key, size);
    }
  }
  if (!detectable.empty()) {
    text += "  would have been named (95 %, by slopes at the fit) from: " + detectable + "\n";
  }
  for (const std::string& caution : d.cautions) text += "  note: " + caution + "\n";
  return text;
}

// Leaves `files`, report.html and diagnosis.json, and shows what was found.  `left`: of the files,
// for people.
Status leave_diagnosis(const DiagnoseCommand& command, const Diagnosis& diagnosis,
                       Outputs::NamedTexts files, const std::string& left, Console& console) {
  files.emplace_back("report.html", report_html(diagnosis));
  // Last: whoever sees it sees the rest.
  files.emplace_back(kDiagnosisFile, to_json(diagnosis));
  RETURN_IF_ERROR(command.outputs.write_in(command.out, files));
  Json json = parse_json(to_json(diagnosis));
  json.erase("trials");
  json["out"] = command.out;
  console.result(diagnosis_summary(diagnosis), json);
  console.note("wrote: " + command.out + "/report.html, diagnosis.json, " + left);
  return {};
}

Model model_of(const Config& config, const DiagnosisResult& result, const ParameterValues& values,
               const std::string& kind) {
  Model model = model_of_problem(config.problem, values);
  model.kind = kind;
  model.frame_x_m = result.frame_m.x();
  model.frame_y_m = result.frame_m.y();
  model.data = {problem_hash(to_proto(config.problem)), config.problem.log.trials.size(),
                config.trial_files};
  return model;
}

Status write_models(const Config& config, const DiagnoseCommand& command,
                    const DiagnosisResult& result) {
  const fs::path out(command.out);
  if (result.diagnosis.verdict == Verdict::kUnusable) {
    // Those of a diagnosis that this one replaces are not of it.
    std::error_code ignored;
    for (const char* name : {"model.toml", "tuned.toml"}) fs::remove(out / name, ignored);
    return {};
  }
  Model model = model_of(config, result, result.final_, "diagnosed");
  model.residual = result.residual;
  model.intervals.resize(model.values.size());
  for (std::size_t i = 0; i < result.intervals.size(); ++i) {
    const auto& [lo, hi] = result.intervals[i];
    if (lo < hi) model.intervals[i] = Interval{lo, hi};
  }
  RETURN_IF_ERROR(command.outputs.write_model((out / "model.toml").string(), model));
  const Model tuned = model_of(config, result, result.tuned, "tuned");
  return command.outputs.write_model((out / "tuned.toml").string(), tuned);
}

Provenance stamp_of(const Config& config, const DiagnoseCommand& command,
                    const std::vector<Gene>& searched) {
  Provenance stamp;
  stamp.command = "diagnose";
  stamp.problem = problem_hash(to_proto(config.problem));
  Json genes = Json::object();
  for (const Gene& gene : searched) {
    genes[config.problem.table()[gene.row].key] = {gene.lower, gene.upper};
  }
  stamp.options = {{"genes", genes},
                   {"model", !command.model.empty()},
                   {"leave-out", command.exclude},
                   {"seed", config.seed}};
  if (command.reference_log) stamp.options["reference"] = log_hash(*command.reference_log);
  stamp.about = {{"config", config.path}, {"trials", config.trial_files}};
  stamp.build = build_info().fingerprint;
  return stamp;
}

// Makes sure that the folder takes this diagnosis, a new one or the same again.
Status plan_outputs(DiagnoseCommand& command, const Config& config, const Provenance& stamp) {
  Outputs& outputs = command.outputs;
  RETURN_IF_ERROR(check_folder(command.out, FolderKind::kDiagnosis));
  outputs.reads(config);
  outputs.reads(command.model);
  ASSIGN_OR_RETURN(const auto state,
                   compare_stamp(command.out, kDiagnosisFile, stamp, outputs.force()));
  std::vector<const char*> names = {kStampFile, "model.toml", "tuned.toml", "report.html",
                                    kDiagnosisFile};
  if (config.problem.ground) {
    names = {kStampFile, "robot.toml", "values.json", "report.html", kDiagnosisFile};
  } else if (config.problem.windows()) {
    names = {kStampFile, "model.toml", "report.html", kDiagnosisFile};
  }
  for (const char* name : names) {
    const std::string path = (fs::path(command.out) / name).string();
    RETURN_IF_ERROR(state == FolderState::kNew ? outputs.plan(path) : outputs.plan_again(path));
  }
  return {};
}

// What the command line says of the problem, on top of the config.
Status apply_options(const DiagnoseCommand& command, Config& config, std::vector<Gene>& searched,
                     std::optional<Eigen::Vector2d>& frame, Console& console) {
  if (command.seed) config.seed = *command.seed;
  if (!command.model.empty()) {
    ASSIGN_OR_RETURN(const Model model, read_model_of(command.model, console));
    RETURN_IF_ERROR(check_no_residual(model, command.model, "a base to diagnose"));
    RETURN_IF_ERROR(check_same_robot(model, command.model, config, command.config));
    config.problem.values = model.values;
    frame = {model.frame_x_m, model.frame_y_m};
  }
  if (!config.problem.windows()) {
    RETURN_IF_ERROR(check_excluded(config.problem, command.exclude));
  }
  searched = std::move(config.problem.genes);
  config.problem.genes.clear();
  config.problem.fitness.kind = FitnessKind::kLogScore;
  return {};
}

// The folders of a log, or those that a run's model was fitted to.
Result<std::vector<std::string>> reference_folders(const std::vector<std::string>& named,
                                                   Console& console) {
  std::vector<std::string> folders;
  for (const std::string& name : named) {
    if (is_there(fs::path(name) / "commands.csv")) {
      folders.push_back(name);
      continue;
    }
    const auto model = read_model_of(name, console);
    if (!model) {
      return Error{"--reference " + name + ": neither a folder with commands.csv and poses.csv " +
                   "nor a run or model (" + model.error().message + ")"};
    }
    for (const std::string& folder : model->data.files) {
      if (is_there(fs::path(folder) / "commands.csv")) {
        folders.push_back(folder);
        continue;
      }
      return Error{"--reference " + name + ": the log that it was fitted to, " + folder +
                   ", is not there; name its folder instead"};
    }
  }
  return folders;
}

// Reads the log that --reference names, if it does.  Errors: the scenario is not of ground robots;
// a model whose log is gone.
Status read_reference(DiagnoseCommand* command, const Config& config, Console& console) {
  if (command->reference.empty()) return {};
  if (!config.problem.ground) {
    return Error{"--reference: asks what changed of a ground robot, but the scenario is " +
                 config.problem.scenario + "; diagnose both logs, or use crossfit"};
  }
  ASSIGN_OR_RETURN(const auto folders, reference_folders(command->reference, console));
  ASSIGN_OR_RETURN(
      command->reference_log,
      under("--reference", read_run_folders(folders, config.problem.ground->robot().channels)));
  for (const std::string& note : command->reference_log->notes) console.note("reference: " + note);
  return {};
}

// A ground robot: its file and its runs, by its kinematics, and nothing is simulated; or runs that
// a program follows, which is asked for every motion.  `searched`: the config's genes; `stamp`: the
// text of question.json.
Result<int> run_diagnose_runs(DiagnoseCommand& command, const Config& config,
                              const std::vector<Gene>& searched, const std::string& stamp,
                              CliContext& context) {
  const bool kinematic = config.problem.ground != nullptr;
  Problem problem = config.problem;
  ASSIGN_OR_RETURN(const auto runs, read_run_folders(config.trial_files, problem.channels()));
  if (command.reference_log && log_hash(*command.reference_log) == log_hash(runs)) {
    return Error{"--reference: found the log that is diagnosed, expected an earlier one"};
  }
  context.begun = true;
  RETURN_IF_ERROR(LongCommand::begin(
      "diagnose", {command.out}, {std::begin(kGroundStages), std::end(kGroundStages)}, context));
  ASSIGN_OR_RETURN(const auto page, open_page(command.page, command.out, context));
  const fs::path out(command.out);
  RETURN_IF_ERROR(command.outputs.write((out / kStampFile).string(), stamp));
  LongCommand& work = *context.work;
  GroundDiagnoseOptions options;
  options.excluded = command.exclude;
  options.seed = config.seed;
  options.windows.run_in_s = config.windows.run_in_s;
  options.reference = command.reference_log;
  options.on_stage = [&](const std::string& stage) { work.stage(stage); };
  options.on_finding = [&](Finding finding) { work.found(std::move(finding)); };
  options.on_progress = [&](std::size_t done, std::size_t total) { work.advance(done, total); };
  options.stopped = [&] { return context.stop.requested(); };
  std::optional<FitFile> fits;
  Outputs::NamedTexts files;
  std::string left;
  std::optional<GroundDiagnosis> result;
  if (kinematic) {
    const GroundRobot robot = problem.ground->robot_at(problem.values);
    fits.emplace(out / kFits);
    work.keeps_also("fitted", out / kFits);
    options.memo = &*fits;
    ASSIGN_OR_RETURN(result, diagnose_ground(robot, runs, options));
    files = {{"robot.toml", format_robot(result->corrected)},
             {"values.json", format_values({robot, config.trial_files, result->values,
                                            fs::current_path().string()})}};
    left = "robot.toml with what was named put in; next: gapfarm export ros " + command.out;
  } else {
    ASSIGN_OR_RETURN(const auto farm, start_recorded(command.farm, config.farm, context));
    const std::vector<Gene> tuned = command.model.empty() ? searched : std::vector<Gene>();
    ASSIGN_OR_RETURN(result, diagnose_program_runs(*farm, tuned, runs, options, &problem));
    Model model = model_of_problem(problem, problem.values);
    model.kind = "diagnosed";
    model.data = {problem_hash(to_proto(config.problem)), problem.log.trials.size(),
                  config.trial_files};
    files = {{"model.toml", format_model(model)}};
    left = "model.toml with what was tuned and named put in";
  }
  add_diagnosis_provenance(config, command, &result->diagnosis);
  for (const std::string& name : command.reference) {
    result->diagnosis.provenance.emplace_back("reference", name);
  }
  RETURN_IF_ERROR(leave_diagnosis(command, result->diagnosis, std::move(files), "and " + left,
                                  context.console));
  if (fits) fits->remove();
  return kExitDone;
}

Result<int> run_diagnose(DiagnoseCommand& command, CliContext& context) {
  DiagnoseOptions options;
  ASSIGN_OR_RETURN(
      const auto config,
      open_config(command.config, command.trials, context.console, [&](Config& read) -> Status {
        return apply_options(command, read, options.genes, options.frame_m, context.console);
      }));
  RETURN_IF_ERROR(read_reference(&command, config, context.console));
  const Provenance stamp = stamp_of(config, command, options.genes);
  RETURN_IF_ERROR(plan_outputs(command, config, stamp));
  if (context.dry_run) {
    const std::size_t trials = config.problem.log.trials.size();
    return print_dry_run(
        fmt::format("diagnose {} trials of {} into {}, {}", trials, command.config, command.out,
                    command.model.empty() ? "the base tuned on them" : "by " + command.model),
        {{"out", command.out}, {"trials", trials}, {"seed", config.seed}}, command.farm,
        config.farm, context);
  }
  if (config.problem.windows()) {
    return run_diagnose_runs(command, config, options.genes, format_stamp(stamp), context);
  }
  // Every simulation goes into the folder: what a figure rests on can be looked up.
  const auto stage_of = [](const DiagnosisStage& s) { return ProgressStage{s.name, s.share}; };
  RETURN_IF_ERROR(
      LongCommand::begin("diagnose", {command.out}, mapped(kDiagnosisStages, stage_of), context));
  ASSIGN_OR_RETURN(const auto page, open_page(command.page, command.out, context));
  ASSIGN_OR_RETURN(const auto asked, start_recorded(command.farm, config.farm, context));
  options.keep_base = !command.model.empty();
  options.excluded = command.exclude;
  options.seed = config.seed;
  const std::string stamp_file = (fs::path(command.out) / kStampFile).string();
  RETURN_IF_ERROR(command.outputs.write(stamp_file, format_stamp(stamp)));
  LongCommand& work = *context.work;
  options.on_stage = [&](const std::string& stage) { work.stage(stage); };
  options.on_finding = [&](Finding finding) { work.found(std::move(finding)); };
  ASSIGN_OR_RETURN(auto result, diagnose(*asked, config.problem, options));
  add_diagnosis_provenance(config, command, &result.diagnosis);
  for (const auto& [fit, tasks] : result.fits) {
    // A stop may have come between them: their numbers need not follow one another.
    const std::string questions = joined(
        tasks, ", ", [&](const auto& task) { return work.answers().key(result.problem, task); });
    result.diagnosis.provenance.emplace_back("predictions of " + fit,
                                             fmt::format("{}, questions {}", kAnswers, questions));
  }
  RETURN_IF_ERROR(write_models(config, command, result));
  const bool usable = result.diagnosis.verdict != Verdict::kUnusable;
  RETURN_IF_ERROR(leave_diagnosis(command, result.diagnosis, {},
                                  usable ? "model.toml" : "and no model", context.console));
  return asked->given_up() > 0 ? kExitQuarantined : kExitDone;
}

}  // namespace

SubcommandRun setup_diagnose(CLI::App& app) {
  auto command = std::make_shared<DiagnoseCommand>();
  app.add_option("CONFIG", command->config, "Config file (TOML)")->required();
  command->trials.declare(app);
  app.add_option("--out", command->out, "Folder for report, diagnosis and models")->required();
  app.add_option("--model", command->model, "Base model (run or model.toml); default: tuned here");
  app.add_option("--reference", command->reference,
                 "Of ground robots: an earlier log, or a run or model and so its log; asks what "
                 "changed since")
      ->type_name("FOLDER|RUN|MODEL");
  app.add_option("--exclude,--leave-out", command->exclude,
                 "Effects that the catalogue is to be without (--leave-out is the old name)");
  app.add_option("--seed", command->seed, "Of the bootstrap");
  command->declare(app, LongOptions::Leaves::kFolder, true);
  command->page.declare(app);
  app.footer(
      "Examples:\n"
      "  gapfarm diagnose configs/srv1.toml --trials log.csv --out diagnosis\n"
      "  gapfarm diagnose configs/srv1.toml --trials log.csv --out d2 --model run/srv1\n"
      "  gapfarm diagnose configs/push.toml --trials pushes.csv --out d3\n"
      "  gapfarm diagnose husky.toml --out d4\n"
      "  gapfarm diagnose husky.toml --reference monday --trials friday --out changed\n"
      "Stopped?  The same command goes on: simulations are kept in OUT/simulations.sqlite,\n"
      "fits of ground robots in OUT/fits.jsonl.");
  return [command](CliContext& context) { return run_diagnose(*command, context); };
}

}  // namespace gapfarm
