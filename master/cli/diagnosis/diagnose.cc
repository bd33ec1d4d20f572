// gapfarm diagnose CONFIG: where the gap lies, which effect causes it, how far it shrinks.
#include "master/diagnose/diagnose.h"

#include <spdlog/fmt/fmt.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/base/build_info.h"
#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/json/json.h"
#include "master/cli/diagnosis/diagnose_command.h"
#include "master/cli/subcommand.h"
#include "master/command/inputs.h"
#include "master/command/long_command.h"
#include "master/command/outputs.h"
#include "master/command/page_along.h"
#include "master/command/provenance.h"
#include "master/diagnose/result/diagnosis_json.h"
#include "master/report/report_html.h"

namespace gapfarm {

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

namespace {

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

// diagnosis.json without its trials.
Json diagnosis_summary_json(const Diagnosis& diagnosis, const DiagnoseCommand& command) {
  auto json = parse_json(to_json(diagnosis));
  json.erase("trials");
  json["out"] = command.out;
  return json;
}

}  // namespace

Status leave_diagnosis(const DiagnoseCommand& command, const Diagnosis& diagnosis,
                       Outputs::NamedTexts files, const std::string& left, Console& console) {
  files.emplace_back("report.html", report_html(diagnosis));
  // Last: whoever sees it sees the rest.
  files.emplace_back(kDiagnosisFile, to_json(diagnosis));
  RETURN_IF_ERROR(command.outputs.write_in(command.out, files));
  console.result(diagnosis_summary(diagnosis), diagnosis_summary_json(diagnosis, command));
  console.note("wrote: " + command.out + "/report.html, diagnosis.json, " + left);
  return {};
}

namespace {

constexpr const char* kAnswers = "simulations.sqlite";

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
  const std::filesystem::path out(command.out);
  if (result.diagnosis.verdict == Verdict::kUnusable) {
    // Those of a diagnosis that this one replaces are not of it.
    std::error_code ignored;
    for (const char* name : {"model.toml", "tuned.toml"})
      std::filesystem::remove(out / name, ignored);
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
    const std::string path = (std::filesystem::path(command.out) / name).string();
    RETURN_IF_ERROR(state == FolderState::kNew ? outputs.plan(path) : outputs.plan_again(path));
  }
  return {};
}

std::vector<ProgressStage> diagnosis_stages() {
  return mapped(kDiagnosisStages, [](const DiagnosisStage& stage) -> ProgressStage {
    return {stage.name, stage.share};
  });
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
  RETURN_IF_ERROR(LongCommand::begin("diagnose", {command.out}, diagnosis_stages(), context));
  ASSIGN_OR_RETURN(const auto page, open_page(command.page, command.out, context));
  ASSIGN_OR_RETURN(const auto asked, start_recorded(command.farm, config.farm, context));
  options.keep_base = !command.model.empty();
  options.excluded = command.exclude;
  options.seed = config.seed;
  const std::string stamp_file = (std::filesystem::path(command.out) / kStampFile).string();
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
