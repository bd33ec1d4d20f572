// gapfarm crossfit CONFIG: tune on some trials, try on others, beside what no model would do.
#include "master/experiments/crossfit/crossfit.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "master/cli/models/parameter_options.h"
#include "master/cli/subcommand.h"
#include "master/command/outputs.h"

namespace gapfarm {
namespace {

struct CrossfitOptions : LongOptions {
  std::string config;
  TrialOptions trials;
  CrossfitPlan plan;
  std::vector<std::string> only, tests, set, genes;
  std::optional<std::uint64_t> evaluations, seed;
};

CrossfitPlan plan_of(const CrossfitOptions& options, const Config& config) {
  CrossfitPlan plan = options.plan;
  for (const std::string& test : options.tests) {
    const auto filters = tokens_of(test);
    plan.tests.emplace_back(filters.begin(), filters.end());
  }
  plan.evolution = config.evolution;
  plan.seed = options.seed.value_or(config.seed);
  if (options.evaluations) plan.evolution.evaluations = *options.evaluations;
  return plan;
}

Json errors_json(const EndErrors& e) {
  return {{"trials", e.trials},
          {"mean_mm", 1e3 * e.mean_m},
          {"median_mm", 1e3 * e.median_m},
          {"median_position_mm", 1e3 * e.median_position_m},
          {"median_heading_deg", e.median_heading_rad * 180 / M_PI}};
}

Json to_json(const Problem& problem, const CrossfitGroup& group) {
  Json genes = Json::object();
  for (const Gene& gene : problem.genes) {
    genes[problem.table()[gene.row].key] = group.tuned.values[gene.row];
  }
  Json sets = Json::array();
  for (const CrossfitSet& set : group.sets) {
    Json json = {{"set", set.name},
                 {"part", set.part},
                 {"untuned", errors_json(set.untuned)},
                 {"tuned", errors_json(set.tuned)},
                 {"stay", errors_json(set.stay)}};
    if (set.repeat.trials > 0) json["repeat"] = errors_json(set.repeat);
    sets.push_back(std::move(json));
  }
  Json sweeps = Json::object();
  for (const Sweep& sweep : group.sweeps) {
    for (const SweepPoint& p : sweep.points) {
      sweeps[sweep.parameter].push_back(
          {{"value", p.value}, {"train_mm", 1e3 * p.train_m}, {"test_mm", 1e3 * p.test_m}});
    }
  }
  return {{"group", group.name},
          {"fitness", group.tuned.fitness},
          {"evaluations", group.tuned.evaluations},
          {"parameters", genes},
          {"sets", sets},
          {"warnings", group.warnings},
          {"sweeps", sweeps}};
}

std::string describe(const Problem& problem, const CrossfitGroup& group) {
  std::string text =
      (group.name.empty() ? "all" : group.name) +
      fmt::format(": {} {:.5g} after {} evaluations;", fitness_name(problem.fitness.kind),
                  group.tuned.fitness, group.tuned.evaluations);
  for (const Gene& gene : problem.genes) {
    text += fmt::format(" {} {:.4g}", problem.table()[gene.row].key, group.tuned.values[gene.row]);
  }
  const auto kept = [&](const Gene& gene) {
    return group.tuned.values[gene.row] == problem.values[gene.row];
  };
  if (std::ranges::all_of(problem.genes, kept)) {
    text += "\n  nothing was gained by tuning: these are the config's own values";
  }
  text += fmt::format("\n  {:<36} {:>6} {:>8} {:>8} {:>8} {:>8} | {:>8} {:>8}\n", "mean error, mm",
                      "trials", "still", "untuned", "tuned", "repeats", "median mm", "degrees");
  for (const CrossfitSet& set : group.sets) {
    const std::string repeat =
        set.repeat.trials > 0 ? fmt::format("{:.2f}", 1e3 * set.repeat.mean_m) : "-";
    text +=
        fmt::format("  {:<36} {:>6} {:>8.2f} {:>8.2f} {:>8.2f} {:>8} | {:>9.2f} {:>7.2f}\n",
                    set.name + (set.part.empty() ? "" : " / " + set.part), set.tuned.trials,
                    1e3 * set.stay.mean_m, 1e3 * set.untuned.mean_m, 1e3 * set.tuned.mean_m, repeat,
                    1e3 * set.tuned.median_position_m, set.tuned.median_heading_rad * 180 / M_PI);
  }
  for (const std::string& warning : group.warnings) text += "  " + warning + "\n";
  for (const Sweep& sweep : group.sweeps) {
    text += "  " + sweep.parameter + " alone (train, test mm):";
    for (const SweepPoint& p : sweep.points) {
      text += fmt::format(" {:.3g}: {:.2f}, {:.2f};", p.value, 1e3 * p.train_m, 1e3 * p.test_m);
    }
    text += "\n";
  }
  return text;
}

Status apply(const CrossfitOptions& options, Config& config) {
  for (const std::string& setting : options.set) {
    RETURN_IF_ERROR(apply_setting(setting, config.problem));
  }
  if (!options.genes.empty()) {
    RETURN_IF_ERROR(apply_genes(options.genes, config.problem));
  }
  ASSIGN_OR_RETURN(config.problem.log, select_trials(config.problem.log, options.only));
  return check_evolvable(config);
}

Result<int> run_crossfit(const CrossfitOptions& options, CliContext& context) {
  ASSIGN_OR_RETURN(const auto config,
                   open_config(options.config, options.trials, context.console,
                               [&](Config& read) { return apply(options, read); }));
  show_warnings(config.problem, config.trial_files, context.console);
  CrossfitPlan plan = plan_of(options, config);
  RETURN_IF_ERROR(check_crossfit(config.problem, plan));
  if (context.dry_run) {
    const std::size_t genes = config.problem.genes.size(),
                      trials = config.problem.log.trials.size();
    return print_dry_run(
        fmt::format("tune {} parameters on parts of {} trials and try them on others", genes,
                    trials),
        {{"genes", genes}, {"trials", trials}}, options.farm, config.farm, context);
  }
  ASSIGN_OR_RETURN(const auto asked, options.begin("crossfit", {{"fit"}}, config.farm, context));
  plan.hooks = context.work->hooks();
  ASSIGN_OR_RETURN(const auto groups, crossfit(config.problem, plan, *asked));
  context.console.result(
      joined(groups, "", [&](const auto& group) { return describe(config.problem, group); }),
      mapped(groups, [&](const auto& group) { return to_json(config.problem, group); }));
  return kExitDone;
}

}  // namespace

SubcommandRun setup_crossfit(CLI::App& app) {
  auto options = std::make_shared<CrossfitOptions>();
  app.add_option("CONFIG", options->config, "Config file (TOML)")->required();
  options->trials.declare(app);
  app.add_option("--only", options->only,
                 "COLUMN=VALUE[,VALUE...]: leave all other trials out; may repeat, all must hold");
  app.add_option("--set", options->set, "PARAMETER=VALUE, effects included; may repeat");
  app.add_option("--genes", options->genes,
                 "KEY or KEY=LOWER,UPPER in place of the config's genes; may repeat");
  app.add_option("--train", options->plan.train,
                 "COLUMN=VALUE[,VALUE...] of the trials to tune on; may repeat, all must hold");
  app.add_option("--test", options->tests,
                 "A set of trials to try it on: such filters between blanks; may repeat");
  app.add_option("--by", options->plan.by, "Tune for each value of this column on its own");
  app.add_option("--per", options->plan.per, "Show errors by the values of this column");
  app.add_option("--repeats", options->plan.repeats,
                 "Columns that make a condition: trials alike in them repeat one another");
  app.add_option("--sweep", options->plan.sweeps,
                 "Vary these parameters alone around what was tuned");
  app.add_option("--evaluations", options->evaluations,
                 "Stop each fit after the generation in which so many are reached, in place of the "
                 "config's")
      ->check(CLI::PositiveNumber);
  app.add_option("--seed", options->seed, "In place of the config's");
  options->declare(app, LongOptions::Leaves::kNothing, false);
  app.footer(
      "Examples:\n"
      "  gapfarm crossfit configs/push.toml --trials pushes.csv --by object \\\n"
      "      --train start=0.11,0.15,0.21 --test start=0.13,0.18 --repeats object start\n"
      "  gapfarm crossfit configs/srv1.toml --trials a.csv b.csv --train session=a \\\n"
      "      --test session=b --per command");
  return [options](CliContext& context) { return run_crossfit(*options, context); };
}

}  // namespace gapfarm
