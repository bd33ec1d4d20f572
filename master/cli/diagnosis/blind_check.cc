// gapfarm blind-check CONFIG: the diagnosis against sealed truths.
#include "master/experiments/blind_check/blind_check.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/base/build_info.h"
#include "common/base/hash.h"
#include "common/process/process_pool.h"
#include "master/cli/subcommand.h"
#include "master/command/outputs.h"
#include "master/farm/planned_trials.h"

namespace gapfarm {
namespace {

struct BlindCheckOptions {
  BlindCheckSettings check;
  std::string foreign, truth, like;
  std::vector<std::string> sizes = {"clear", "subtle"};
  std::optional<unsigned> trials, workers, jobs;
  std::optional<std::uint64_t> seed;
};

Result<DesignSettings> design_of(const BlindCheckOptions& options, const Config& config) {
  DesignSettings design = options.check.design;
  RETURN_IF_ERROR(effects_named(config.problem.table(), design.effects));
  for (const std::string& word : options.sizes) {
    ASSIGN_OR_RETURN(const SizeLevel level, size_level(word));
    design.sizes.push_back(level);
  }
  design.seed = config.seed;
  return design;
}

Result<Config> config_of(const BlindCheckOptions& options, SessionPlans& plan, Console& console) {
  const std::string& path = options.check.diagnose.config_path;
  Result<Config> config = read_config(path);
  if (!config) return config;
  RETURN_IF_ERROR(check_can(config->problem.scenario, kSimulates, path));
  if (options.seed) config->seed = *options.seed;
  SimulateSettings& simulate = config->simulate;
  if (options.trials) {
    simulate.trials_per_session = (*options.trials + simulate.sessions - 1) / simulate.sessions;
  }
  if (!options.like.empty()) {
    const std::vector<std::string> files = {options.like};
    ASSIGN_OR_RETURN(const auto log,
                     read_trial_files(files, command_names(config->problem.commands)));
    show_notes(log, console);
    plan = plan_of(config->problem, log);
  }
  return config;
}

DiagnoseSettings diagnose_of(const BlindCheckOptions& options) {
  const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
  DiagnoseSettings diagnose = options.check.diagnose;
  diagnose.command = {executable_path(), "diagnose"};
  diagnose.jobs = options.jobs.value_or(std::max(1u, cores / 2));
  diagnose.workers = options.workers.value_or(std::max(1u, cores / diagnose.jobs));
  return diagnose;
}

// Cases are made and scored while no diagnosis runs: with all the workers together.
FarmOptions all_workers(const BlindCheckOptions& options) {
  const DiagnoseSettings diagnose = diagnose_of(options);
  return {.workers = static_cast<int>(diagnose.workers * diagnose.jobs)};
}

BlindCheckHooks hooks_of(const BlindCheckOptions& options, const Config& config,
                         CliContext& context) {
  BlindCheckHooks hooks;
  hooks.stop = &context.stop;
  hooks.start_farm = [&options, &config, &context] {
    return start_recorded(all_workers(options), config.farm, context);
  };
  hooks.note = [&context](const std::string& sentence) { context.console.note(sentence); };
  hooks.stages = context.work->hooks();
  hooks.diagnosed = [&context](std::size_t ended, std::size_t all) {
    context.work->advance(ended, all);
  };
  hooks.on_sealed = [&options, &context] {
    context.work->keeps_also("sealed and diagnosed", options.check.out);
    return context.work->keeps() ? context.work->answers().forget() : Status();
  };
  return hooks;
}

Result<int> print_check(const BlindCheckOptions& options, const Config& config,
                        CliContext& context) {
  const std::string& out = options.check.out;
  const unsigned nulls = options.check.design.nulls, pairs = options.check.design.pairs;
  const std::string cases = options.foreign.empty()
                                ? "cases of effects, " + std::to_string(nulls) + " nulls and " +
                                      std::to_string(pairs) + " pairs"
                                : "the cases of " + options.foreign;
  return print_dry_run("diagnose " + cases + " into " + out,
                       {{"out", out}, {"nulls", nulls}, {"pairs", pairs}}, all_workers(options),
                       config.farm, context);
}

// All that makes the cases and what is asked of them; not how many workers do it.
std::string asked(const BlindCheckOptions& options, const std::string& config_text) {
  std::string text = config_text;
  const auto add = [&](const std::string& word) { text += '\0' + word; };
  const DesignSettings& design = options.check.design;
  for (const std::string& word :
       {options.foreign, options.truth, options.like, options.check.diagnose.model_path}) {
    add(word);
  }
  for (const auto* lists : {&design.effects, &options.sizes}) {
    for (const std::string& word : *lists) add(word);
    add("");
  }
  for (const unsigned n : {design.nulls, design.pairs, design.excluded, design.per_effect,
                           options.trials.value_or(0)}) {
    add(std::to_string(n));
  }
  add(options.seed ? std::to_string(*options.seed) : "");
  return content_hash(text);
}

Result<int> run_blind(const BlindCheckOptions& options, CliContext& context) {
  BlindCheckSettings settings = options.check;
  ASSIGN_OR_RETURN(const Config config, config_of(options, settings.plan, context.console));
  ASSIGN_OR_RETURN(const auto design, design_of(options, config));
  if (context.dry_run) return print_check(options, config, context);
  RETURN_IF_ERROR(check_folder(settings.out, FolderKind::kBlindCheck));
  settings.design = design;
  settings.diagnose = diagnose_of(options);
  settings.provenance = {
      {"command", command_line()},
      {"program", "gapfarm " + build_info().version + ", build " + build_info().fingerprint},
      {"seed", std::to_string(config.seed)}};
  settings.asked = asked(options, config.text);
  const KeepingPlace place{settings.out, /*passing=*/false, /*forget=*/true};
  // Diagnoses take by far the most.
  RETURN_IF_ERROR(LongCommand::begin(
      "blind-check", place,
      {{"find strengths", 4}, {"drive the cases", 1}, {"diagnose", 94}, {"judge", 1}}, context));
  if (!options.foreign.empty()) context.work->keeps_also("diagnosed", settings.out);
  const BlindCheckHooks hooks = hooks_of(options, config, context);
  ASSIGN_OR_RETURN(const BlindReport report,
                   options.foreign.empty()
                       ? run_blind_check(config, settings, hooks)
                       : run_foreign_check(options.foreign, options.truth, settings, hooks));
  context.console.print(context.console.json() ? format_blind_json(report)
                                               : format_blind_summary(report));
  context.console.note("tables: " + settings.out + "/blind_check.md");
  return kExitDone;
}

void declare_cases(CLI::App& app, BlindCheckOptions& options) {
  app.add_option("--effects", options.check.design.effects, "Only these effects of the catalogue");
  app.add_option("--sizes", options.sizes,
                 "clear (5), subtle (1.6) or numbers: mean squared shift of the end poses in units "
                 "of their spread; 1 is nothing")
      ->delimiter(',');
  app.add_option("--per-effect", options.check.design.per_effect, "Cases an effect and size");
  app.add_option("--nulls", options.check.design.nulls, "Cases without any effect");
  app.add_option("--pairs", options.check.design.pairs, "Cases with two effects");
  app.add_option("--left-out", options.check.design.excluded,
                 "Cases whose effect, and what passes for it, the diagnosis has to do without");
  app.add_option("--trials", options.trials, "Trials a case (default: as [simulate] says)")
      ->check(CLI::Range(1, 1000000));
  app.add_option("--like", options.like, "Repeat the plan of this trial log");
  app.add_option("--foreign", options.foreign, "Diagnose the cases FOLDER/CASE/trials.csv instead");
  app.add_option("--truth", options.truth, "Truths of the foreign cases, FOLDER/CASE.json");
}

}  // namespace

SubcommandRun setup_blind_check(CLI::App& app) {
  auto options = std::make_shared<BlindCheckOptions>();
  BlindCheckSettings& check = options->check;
  app.add_option("CONFIG", check.diagnose.config_path, "Config file (TOML)")->required();
  app.add_option("--out", check.out, "Folder for cases, seals, diagnoses and result")->required();
  declare_cases(app, *options);
  app.add_option("--model", check.diagnose.model_path, "Base model for every diagnosis");
  app.add_option("--seed", options->seed, "Of robots, effects, plans and noise");
  app.add_option("--workers", options->workers, "Worker processes of each diagnosis")
      ->check(CLI::Range(1, 4096));
  app.add_option("--jobs", options->jobs, "Diagnoses at a time (default: half the cores)")
      ->check(CLI::Range(1, 4096));
  app.add_option("--time-limit", check.diagnose.time_limit_s,
                 "s; a slower diagnosis counts as failed")
      ->check(CLI::PositiveNumber);
  declare_long_command(app);
  app.footer(
      "Examples:\n"
      "  gapfarm blind-check configs/srv1.toml --out run/blind --seed 7\n"
      "  gapfarm blind-check configs/push.toml --out run/pushes --sizes clear --trials 90\n"
      "  gapfarm blind-check configs/srv1.toml --out run/foreign --foreign logs/cases \\\n"
      "      --truth logs/cases/truth");
  return [options](CliContext& context) { return run_blind(*options, context); };
}

}  // namespace gapfarm
