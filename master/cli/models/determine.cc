// gapfarm determine CONFIG: which parameters of a tuned model the data determine.
#include "master/experiments/determine/determine.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "master/cli/subcommand.h"
#include "master/command/outputs.h"
#include "master/evolve/evolve.h"

namespace gapfarm {
namespace {

struct DetermineCommand : LongOptions {
  std::string config, model;
  TrialOptions trials;
  DetermineSettings settings;
};

LikelihoodOf farm_likelihood(Farm& farm, const Problem& problem, std::uint64_t seed) {
  const std::string hash = farm.add_problem(to_proto(problem));
  return [&farm, hash, seed, fitness = problem.fitness](
             const std::vector<Genome>& genomes) -> Result<std::vector<double>> {
    const auto tasks = mapped(indices(genomes.size()), [&](std::size_t i) {
      return evaluation_task({i, 0, genomes[i]}, seed);
    });
    ASSIGN_OR_RETURN(const auto results, farm.run(hash, tasks));
    std::vector<double> scores;
    for (const v1::TaskResult& result : results) {
      ASSIGN_OR_RETURN(const auto score, score_of(result, fitness));
      scores.push_back(score.outcome == v1::OK ? -score.cost : NAN);
    }
    return scores;
  };
}

Json to_json(const DetermineReport& report, const ParameterTable& table) {
  Json genes = Json::array(), pairs = genes;
  for (const GeneDetermined& g : report.genes) {
    genes.push_back({{"parameter", table[g.gene.row].key},
                     {"value", g.value},
                     {"unit", table[g.gene.row].unit},
                     {"lo", g.interval_95.lower},
                     {"hi", g.interval_95.upper},
                     {"deviation_share", g.deviation},
                     {"determined", g.determined},
                     {"at_bound", g.at_bound}});
  }
  for (const Compensation& c : report.compensations) {
    pairs.push_back({{"a", table[report.genes[c.a].gene.row].key},
                     {"b", table[report.genes[c.b].gene.row].key},
                     {"correlation", c.correlation}});
  }
  return {{"reliable", report.reliable},
          {"at_maximum", !report.outside},
          {"parameters", genes},
          {"compensations", pairs},
          {"roughness", report.roughness},
          {"explained", report.explained},
          {"evaluations", report.evaluations},
          {"failures", report.failures}};
}

// The problem at the model's values, scored by likelihood whatever it was tuned by, and that its
// table can be written.
Result<Problem> open_problem(DetermineCommand& command, const Config& config, Console& console) {
  ASSIGN_OR_RETURN(const Model model, read_model_of(command.model, console));
  RETURN_IF_ERROR(check_no_residual(model, command.model, "determine"));
  command.outputs.reads(config);
  command.outputs.reads(command.model);
  command.outputs.reads((std::filesystem::path(command.model) / "model.toml").string());
  RETURN_IF_ERROR(command.outputs.plan(command.out));
  RETURN_IF_ERROR(check_same_robot(model, command.model, config, command.config));
  Problem problem = config.problem;
  problem.values = model.values;
  problem.log = shifted(std::move(problem.log), -model.frame_x_m, -model.frame_y_m);
  problem.fitness.kind = FitnessKind::kLogScore;
  problem.spread = {};
  return problem;
}

Result<int> run_determine(DetermineCommand& command, CliContext& context) {
  ASSIGN_OR_RETURN(const auto config,
                   open_config(command.config, command.trials, context.console, check_evolvable));
  ASSIGN_OR_RETURN(const Problem problem, open_problem(command, config, context.console));
  const Genome point = problem.genome_of(problem.values);
  DetermineSettings settings = command.settings;
  settings.seed = config.seed;
  if (context.dry_run) {
    const std::size_t genes = problem.genes.size(), trials = problem.log.trials.size();
    return print_dry_run(
        fmt::format("look at the likelihood of {} parameters about {} on {} trials", genes,
                    command.model, trials),
        {{"out", command.out}, {"genes", genes}, {"trials", trials}}, command.farm, config.farm,
        context);
  }
  ASSIGN_OR_RETURN(const auto asked,
                   command.begin("determine", {{"evaluate"}}, config.farm, context));
  ASSIGN_OR_RETURN(const auto report,
                   determine(problem, point, farm_likelihood(*asked, problem, config.seed),
                             settings, context.work->hooks()));
  if (!command.out.empty()) {
    RETURN_IF_ERROR(command.outputs.write(command.out, determine_csv(report, problem.table())));
  }
  context.console.result(determine_text(report, problem.table()), to_json(report, problem.table()));
  const auto is_loose = [](const GeneDetermined& g) { return !g.determined; };
  const std::string loose = joined(filtered(report.genes, is_loose), ", ",
                                   [&](auto& g) { return problem.table()[g.gene.row].key; });
  if (!report.reliable) {
    context.console.note(
        "warning: the likelihood about this model is no hill whose width could be measured; is it "
        "the best of its run?");
  } else if (!loose.empty()) {
    context.console.note("warning: these data do not determine " + loose +
                         "; other values explain the log as well, so do not read them as measured");
  }
  return kExitDone;
}

}  // namespace

SubcommandRun setup_determine(CLI::App& app) {
  auto command = std::make_shared<DetermineCommand>();
  DetermineSettings& to = command->settings;
  app.add_option("CONFIG", command->config, "Its [genes] and trials are what is asked about")
      ->required();
  app.add_option("--model", command->model, "The tuned model: a file, or a run's folder")
      ->required();
  command->trials.declare(app);
  app.add_option("--out", command->out, "CSV to write");
  app.add_option("--width", to.half_width,
                 "Greatest half width of the box looked at, share of each range")
      ->check(CLI::Range(0.001, 0.5))
      ->capture_default_str();
  app.add_option("--share", to.share,
                 "Share of its range that a determined parameter's 95 % interval may cover")
      ->check(CLI::Range(0.01, 1.0))
      ->capture_default_str();
  command->declare(app, LongOptions::Leaves::kFile, true);
  app.footer(
      "The curvature of the log likelihood about the model says how far each parameter could be\n"
      "elsewhere, all others moving along.\n\n"
      "Examples:\n"
      "  gapfarm determine configs/demo.toml --model run/demo\n"
      "  gapfarm determine configs/srv1.toml --model model.toml --trials log.csv --out "
      "determined.csv");
  return [command](CliContext& context) { return run_determine(*command, context); };
}

}  // namespace gapfarm
