// gapfarm determine CONFIG: which parameters of a tuned model the data determine.
#include "master/determine/determine.h"

#include <cmath>
#include <memory>

#include "common/config/config.h"
#include "common/trials/files.h"
#include "master/cli/inputs.h"
#include "master/evolve/evaluation.h"

namespace gapfarm {
namespace {

struct DetermineCommand {
  std::string config, model, out;
  std::vector<std::string> trials;
  DetermineSettings settings;
  FarmOptions farm;
};

// The problem at the model's values, scored by likelihood whatever it was tuned by.
Result<Problem> problem_at(const Config& config, const Model& model) {
  if (model.scenario != config.problem.scenario) {
    return Error{"the model is one of scenario '" + model.scenario + "', the config of '" +
                 config.problem.scenario + "'"};
  }
  Problem problem = config.problem;
  problem.values = model.values;
  problem.fitness.kind = FitnessKind::kLogScore;
  problem.spread = {};
  return problem;
}

LikelihoodOf farm_likelihood(Farm& farm, const Problem& problem, std::uint64_t seed) {
  const std::string hash = farm.add_problem(to_proto(problem));
  return [&farm, hash, seed](const std::vector<Genome>& genomes) -> Result<std::vector<double>> {
    std::vector<v1::Task> tasks;
    for (std::size_t i = 0; i < genomes.size(); ++i) {
      tasks.push_back(evaluation_task({i, 0, genomes[i]}, seed));
    }
    const auto results = farm.run(hash, tasks);
    if (!results) return results.error();
    std::vector<double> scores;
    for (const v1::TaskResult& result : *results) {
      const auto score = score_of(result, FitnessKind::kLogScore);
      if (!score) return score.error();
      scores.push_back(score->outcome == v1::OK ? -score->cost : NAN);
    }
    return scores;
  };
}

int run_determine(const DetermineCommand& command, CliContext& context) {
  Result<Config> config = read_config_and_trials(command.config, command.trials);
  if (config) {
    if (Status s = check_evolvable(*config); !s) config = s.error();
  }
  const Result<Model> model = read_model_of(command.model);
  Result<Problem> problem = !config  ? Result<Problem>(config.error())
                            : !model ? Result<Problem>(model.error())
                                     : problem_at(*config, *model);
  if (!problem) {
    context.console.error(problem.error());
    return kExitBadUsage;
  }
  Genome point;
  for (const Gene& gene : problem->genes) {
    point.push_back(encode_gene(problem->table(), gene, problem->values[gene.row]));
  }
  DetermineSettings settings = command.settings;
  settings.seed = config->seed;
  auto farm = start_farm(command.farm, config->farm, context);
  if (!farm) return failed(farm.error(), context);
  const auto report =
      determine(*problem, point, farm_likelihood(**farm, *problem, config->seed), settings);
  if (!report) return failed(report.error(), context);
  if (!command.out.empty()) {
    const Status written =
        write_file_atomically(command.out, determine_csv(*report, problem->table()));
    if (!written) return failed(written.error(), context);
  }
  context.console.print(determine_text(*report, problem->table()));
  std::string loose;
  for (const GeneDetermined& g : report->genes) {
    if (!g.determined) loose += (loose.empty() ? "" : ", ") + problem->table()[g.gene.row].key;
  }
  if (!report->reliable) {
    context.console.note(
        "warning: the likelihood about this model is no hill whose width could be "
        "measured; is it the best of its run?");
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
  app.add_option("--trials", command->trials, "Trial logs in place of the config's");
  app.add_option("--out", command->out, "CSV to write");
  app.add_option("--width", to.half_width,
                 "Greatest half width of the box looked at, share of each range")
      ->check(CLI::Range(0.001, 0.5))
      ->capture_default_str();
  app.add_option("--share", to.share,
                 "Share of its range that a determined parameter's 95 % interval may cover")
      ->check(CLI::Range(0.01, 1.0))
      ->capture_default_str();
  command->farm.declare(app, true);
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
