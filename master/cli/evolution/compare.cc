// gapfarm compare FILE...: searches side by side over seeds.
#include "master/experiments/compare/compare.h"

#include <spdlog/fmt/fmt.h>

#include <map>
#include <nlohmann/json.hpp>

#include "common/base/build_info.h"
#include "common/json/fields.h"
#include "common/score/baselines.h"
#include "common/trials/files.h"
#include "master/cli/subcommand.h"
#include "master/command/outputs.h"

namespace gapfarm {
namespace {

struct CompareCommand : LongOptions {
  std::vector<std::string> files;
  TrialOptions trials;
  std::optional<unsigned> seeds;
  std::optional<std::uint64_t> first_seed, evaluations;
  std::optional<double> target;
};

constexpr const char* kFiles[] = {"summary.csv", "runs.csv", "convergence.csv", "compare.html"};

struct Inputs {
  std::vector<Variant> variants;
  CompareOptions options;
  std::optional<double> target;
};

// Comparison files give variants and settings, configs a variant each; the command line outranks.
Result<Inputs> read_inputs(const CompareCommand& command) {
  Inputs inputs;
  for (const std::string& named : command.files) {
    const std::string file = shipped_file(named);
    ASSIGN_OR_RETURN(const auto text, read_text_file(file));
    if (is_comparison(text)) {
      ASSIGN_OR_RETURN(auto comparison, read_comparison(file));
      if (comparison.seeds) inputs.options.seeds = *comparison.seeds;
      if (comparison.evaluations) inputs.options.evaluations = *comparison.evaluations;
      if (comparison.target_fitness) inputs.target = comparison.target_fitness;
      for (Variant& v : comparison.variants) inputs.variants.push_back(std::move(v));
    } else {
      ASSIGN_OR_RETURN(auto config, read_config(file));
      inputs.variants.push_back({std::filesystem::path(file).stem().string(), std::move(config)});
    }
  }
  name_apart(inputs.variants);
  inputs.options.seeds = command.seeds.value_or(inputs.options.seeds);
  inputs.options.first_seed = command.first_seed.value_or(inputs.options.first_seed);
  inputs.options.evaluations = command.evaluations.value_or(inputs.options.evaluations);
  if (command.target) inputs.target = command.target;
  return inputs;
}

// Reads every variant's log; equal lists of files only once.
Status read_logs(const TrialOptions& given, std::vector<Variant>& variants, Console& console) {
  std::map<std::vector<std::string>, TrialLog> read;
  for (Variant& variant : variants) {
    Config& config = variant.config;
    const auto& files = given.files.empty() ? config.trial_files : given.files;
    if (const auto before = read.find(files); before != read.end()) {
      config.trial_files = files;
      config.problem.log = before->second;
      continue;
    }
    RETURN_IF_ERROR(read_log_of(given, &config));
    show_notes(config.problem.log, console);
    if (!config.problem.windows()) read[config.trial_files] = config.problem.log;
  }
  return {};
}

// What makes fitness values comparable.
Status check_alike(const std::vector<Variant>& variants) {
  const Problem& first = variants.front().config.problem;
  for (const Variant& variant : variants) {
    const Problem& problem = variant.config.problem;
    const auto refuse = [&](const std::string& what) {
      return Error{"variant \"" + variant.name + "\" has another " + what + " than \"" +
                   variants.front().name + "\", so their fitness cannot be compared"};
    };
    if (problem.scenario != first.scenario) return refuse("scenario");
    const auto program = [](const Problem& p) {
      return p.external ? p.external->command.argv : std::vector<std::string>();
    };
    if (program(problem) != program(first)) return refuse("program");
    if (problem.fitness.kind != first.fitness.kind) return refuse("fitness");
    if (variant.config.trial_files != variants.front().config.trial_files) return refuse("log");
    RETURN_IF_ERROR(check_evolvable(variant.config));
  }
  return {};
}

void add_random_search(std::vector<Variant>& variants) {
  for (const Variant& variant : variants) {
    if (variant.config.evolution.optimiser.kind == OptimiserKind::kRandomSearch) return;
  }
  Variant random{"random search", variants.front().config};
  random.config.evolution.optimiser = {};
  random.config.evolution.optimiser.kind = OptimiserKind::kRandomSearch;
  variants.push_back(std::move(random));
}

// The config's own values, nothing searched.
Result<Baseline> untuned(Farm& farm, const Problem& problem) {
  v1::Task task;
  task.mutable_evaluate();
  ASSIGN_OR_RETURN(const auto results, farm.run(farm.add_problem(to_proto(problem)), {task}));
  Baseline baseline{"the config's own values", std::nullopt};
  if (results.front().outcome() == v1::OK) baseline.fitness = results.front().evaluate().fitness();
  return baseline;
}

std::vector<std::pair<std::string, std::string>> provenance(const CompareCommand& command,
                                                            const Inputs& inputs) {
  std::vector<std::pair<std::string, std::string>> rows;
  for (const std::string& file : command.files) rows.emplace_back("file", file);
  const Config& first = inputs.variants.front().config;
  for (const std::string& file : first.trial_files) rows.emplace_back("trials", file);
  rows.emplace_back("trials read", std::to_string(first.problem.log.trials.size()));
  rows.emplace_back("seeds", fmt::format("{} to {}", inputs.options.first_seed,
                                         inputs.options.first_seed + inputs.options.seeds - 1));
  rows.emplace_back("program", build_summary("gapfarm"));
  return rows;
}

constexpr auto kBaseline = [](auto& v, const Baseline& row) { FIELDS(name, fitness); };
constexpr auto kVariant = [](auto& v, const VariantSummary& row) {
  FIELDS(name, median);
  v.field("median_lo", row.median_95.lower);
  v.field("median_hi", row.median_95.upper);
  FIELDS(mean_rank, successes, median_to_target, expected_to_target);
  v.field("final", row.final_fitness);
};
constexpr auto kSummary = [](auto& v, const ComparisonSummary& row) {
  FIELDS(fitness, higher_is_better, target, evaluations, seeds);
  v.list("baselines", row.baselines, kBaseline);
  v.list("variants", row.variants, kVariant);
};

Status plan_outputs(CompareCommand& command, const Inputs& inputs) {
  for (const std::string& file : command.files) command.outputs.reads(file);
  for (const Variant& variant : inputs.variants) command.outputs.reads(variant.config);
  return command.outputs.plan_in(command.out, {std::begin(kFiles), std::end(kFiles)});
}

Result<int> run_compare(CompareCommand& command, CliContext& context) {
  ASSIGN_OR_RETURN(Inputs inputs, read_inputs(command));
  RETURN_IF_ERROR(read_logs(command.trials, inputs.variants, context.console));
  RETURN_IF_ERROR(check_alike(inputs.variants));
  RETURN_IF_ERROR(plan_outputs(command, inputs));
  add_random_search(inputs.variants);
  const Config& first = inputs.variants.front().config;
  if (context.dry_run) {
    const CompareOptions& options = inputs.options;
    return print_dry_run(
        fmt::format("compare {} searches, {} runs of {} evaluations each, into {}",
                    inputs.variants.size(), options.seeds, options.evaluations, command.out),
        {{"out", command.out},
         {"variants", inputs.variants.size()},
         {"seeds", options.seeds},
         {"evaluations", options.evaluations}},
        command.farm, first.farm, context);
  }
  RETURN_IF_ERROR(LongCommand::begin("compare", {command.out}, {{"evaluate"}}, context));
  ASSIGN_OR_RETURN(const auto asked, start_recorded(command.farm, first.farm, context));
  context.work->stage(
      0, 1 + inputs.options.evaluations * inputs.options.seeds * inputs.variants.size());
  ASSIGN_OR_RETURN(const auto as_written, untuned(*asked, first.problem));
  ASSIGN_OR_RETURN(const auto runs, compare(*asked, inputs.variants, inputs.options));
  ComparisonSummary summary =
      summarise_comparison(inputs.variants, runs, inputs.options, inputs.target);
  summary.baselines = {as_written};
  if (!is_value(first.problem.fitness.kind)) {
    const auto constant = constant_velocity_fitness(first.problem);
    if (!constant)
      context.console.note("no constant-velocity baseline: " + constant.error().message);
    summary.baselines.insert(
        summary.baselines.begin(),
        {"constant velocity", constant ? std::optional(*constant) : std::nullopt});
  }
  const std::string page =
      comparison_page(summary, "Searches compared", provenance(command, inputs));
  RETURN_IF_ERROR(command.outputs.write_in(command.out, {{kFiles[0], summary_csv(summary)},
                                                         {kFiles[1], runs_csv(summary, runs)},
                                                         {kFiles[2], convergence_csv(summary)},
                                                         {kFiles[3], page}}));
  context.console.result(comparison_text(summary), FieldWriter::written(summary, kSummary));
  context.console.note("wrote: " + (std::filesystem::path(command.out) / "compare.html").string() +
                       ", summary.csv, runs.csv, convergence.csv");
  return asked->given_up() > 0 ? kExitQuarantined : kExitDone;
}

}  // namespace

SubcommandRun setup_compare(CLI::App& app) {
  auto command = std::make_shared<CompareCommand>();
  app.add_option("FILE", command->files,
                 "Comparison files with [compare] and [variants], or configs, a variant each")
      ->required();
  command->trials.declare(app, "Trial logs in place of the configs'");
  app.add_option("--out", command->out, "Folder for the tables and the page")->required();
  app.add_option("--seeds", command->seeds, "Runs of each variant")->check(CLI::Range(1, 10000));
  app.add_option("--first-seed", command->first_seed, "Seed of each variant's first run");
  app.add_option("--evaluations", command->evaluations, "Evaluations of each run")
      ->check(CLI::PositiveNumber);
  app.add_option("--target", command->target, "Fitness whose reaching counts as success");
  command->declare(app, LongOptions::Leaves::kFolder, true);
  app.footer(
      "Random search, constant-velocity motion and the config's own values are always among the\n"
      "baselines.\n\n"
      "Examples:\n"
      "  gapfarm compare configs/compare/forward.toml --trials log/*.dat --out compared\n"
      "  gapfarm compare a.toml b.toml --seeds 20 --evaluations 2000 --target 0.5 --out compared");
  return [command](CliContext& context) { return run_compare(*command, context); };
}

}  // namespace gapfarm
