// gapfarm check CONFIG: everything that a run would need, without running it.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/math/statistics.h"
#include "master/cli/data/idle_genes.h"
#include "master/cli/subcommand.h"
#include "master/command/inputs.h"
#include "master/diagnose/result/diagnosis_json.h"
#include "master/evolve/evolve.h"
#include "master/evolve/optimisers.h"
#include "master/ground/program_runs.h"
#include "master/run/run.h"

namespace gapfarm {
namespace {

struct CheckOptions {
  std::string config;
  TrialOptions trials;
};

struct Summary {
  std::size_t trials = 0;
  std::size_t sessions = 0;
  std::map<std::string, std::size_t> commands;
  std::vector<std::string> effects;         // enabled: not neutral, or searched
  double evaluation_s = 0;                  // on one worker here, as measured
  std::optional<v1::TaskResult> evaluated;  // the config's own values; none: not looked at
  std::vector<SanityFinding> sanity;
  std::vector<IdleGene> idle;
};

bool has_failed(const v1::TaskResult& result) {
  return result.outcome() != v1::OK && result.outcome() != v1::INFEASIBLE;
}

// The config's own values by one worker, and the seconds that other ones take once it knows the
// problem: the median of a few.
Status measure_evaluation(const Config& config, CliContext& context, Summary* summary) {
  SocketFarmOptions quiet;  // the answer says what went wrong
  quiet.on_event = [](const FarmEvent&) {};
  ASSIGN_OR_RETURN(auto farm, start_farm({.workers = 1}, {}, context, std::move(quiet)));
  const std::string hash = farm->add_problem(to_proto(config.problem));
  // The first one brings the problem to the worker and starts a user's program, which takes seconds
  // at most: nothing beside a long one.
  constexpr double kLong_s = 10;
  constexpr unsigned kFew = 5;
  std::vector<double> took_s;
  double all_s = 0;
  for (unsigned k = 0; k <= kFew && all_s < kLong_s; ++k) {
    // About the middle of every gene's range, no two alike: at the same values a worker scores
    // again what it simulated.
    const Genome genome = k == 0 ? Genome() : Genome(config.problem.genes.size(), 0.5 + 0.01 * k);
    const double began_s = monotonic_seconds();
    ASSIGN_OR_RETURN(const auto results,
                     farm->run(hash, {evaluation_task({0, k, genome}, config.seed)}));
    took_s.push_back(monotonic_seconds() - began_s);
    all_s += took_s.back();
    if (k > 0) continue;
    summary->evaluated = results.front();
    if (has_failed(results.front())) break;
  }
  if (took_s.size() > 1) took_s.erase(took_s.begin());
  summary->evaluation_s = median(took_s);
  const Problem& problem = config.problem;
  if (!problem.windows() || problem.ground || has_failed(*summary->evaluated)) return {};
  // Nothing but the program says where its robot should be.
  ASSIGN_OR_RETURN(const auto runs, read_run_folders(config.trial_files, problem.channels()));
  ASSIGN_OR_RETURN(const auto found, check_program_log(*farm, problem, runs, config.windows));
  if (found) summary->sanity.push_back(*found);
  return {};
}

// Where it takes longer than somebody who checks would wait, nothing is looked for.
Status find_idle_genes(const Config& config, unsigned workers, CliContext& context,
                       Summary* summary) {
  constexpr double kLongest_s = 60;
  const auto evaluations = static_cast<double>(config.problem.genes.size() + 1);
  if (config.problem.genes.empty()) return {};
  if (!summary->evaluated || summary->evaluated->outcome() == v1::WORKER_FAILED) return {};
  const double all_s = evaluations * summary->evaluation_s / std::max(1u, workers);
  if (all_s > kLongest_s) {
    context.console.note("genes that change no score were not looked for: " +
                         format_duration(all_s) + " of evaluations");
    return {};
  }
  const int local = static_cast<int>(std::max(1u, workers));  // remote ones do not check
  ASSIGN_OR_RETURN(auto farm, start_farm({.workers = local}, {}, context));
  ASSIGN_OR_RETURN(summary->idle, idle_genes(*farm, config));
  return {};
}

// Effects that are on in the config's own values or that a gene may turn on.
std::vector<std::string> enabled_effects(const Problem& problem) {
  const ParameterTable& table = problem.table();
  std::vector<std::string> enabled;
  for (std::size_t e = 0; e < table.effects().size(); ++e) {
    const std::size_t first = table.effect_row(e);
    const std::size_t past = first + table.effects()[e].parameters.size();
    const bool searched = std::ranges::any_of(
        problem.genes, [&](const Gene& gene) { return gene.row >= first && gene.row < past; });
    if (searched || !table.is_neutral(e, problem.values)) {
      enabled.push_back(table.effects()[e].name);
    }
  }
  return enabled;
}

Summary summarise(const Config& config) {
  const Problem& problem = config.problem;
  Summary summary;
  for (const Trial& trial : problem.log.trials) ++summary.commands[trial.command];
  summary.trials = problem.log.trials.size();
  summary.sessions = count_sessions(problem.log);
  summary.effects = enabled_effects(problem);
  if (is_value(problem.fitness.kind)) return summary;
  summary.sanity = log_warnings(problem, config.trial_files);
  return summary;
}

// At the config's own values: trials that differ in nothing that matters share theirs.
unsigned motions_of(const Summary& summary) {
  return summary.evaluated ? summary.evaluated->evaluate().conditions() : 0;
}

Json to_json(const Config& config, const Summary& summary, unsigned workers) {
  Json evaluated;
  if (const auto& result = summary.evaluated) {
    evaluated = {{"outcome", v1::Outcome_Name(result->outcome())}, {"message", result->message()}};
    if (result->outcome() == v1::OK) evaluated["fitness"] = result->evaluate().fitness();
  }
  Json idle = mapped(summary.idle, [&](const IdleGene& gene) -> Json {
    return {{"parameter", gene.key}, {"remedy", gene.remedy}};
  });
  Json genes = mapped(config.problem.genes, [&](const Gene& gene) -> Json {
    const Parameter& row = config.problem.table()[gene.row];
    return {{"parameter", row.key},
            {"unit", row.unit},
            {"lower", gene.lower},
            {"upper", gene.upper},
            {"log_scale", gene.scale == ParameterScale::kLog}};
  });
  return {
      {"config", config.path},
      {"scenario", config.problem.scenario},
      {"fitness", fitness_name(config.problem.fitness.kind)},
      {"problem", problem_hash(to_proto(config.problem))},
      {"trials", summary.trials},
      {"sessions", summary.sessions},
      {"commands", summary.commands},
      {"motions", motions_of(summary)},
      {"evaluation_s", summary.evaluation_s},
      {"evaluated", evaluated},
      {"most_evaluations", genes.empty() ? 0 : most_evaluations(config.evolution, genes.size())},
      {"effects", summary.effects},
      {"genes", genes},
      {"population", config.evolution.population},
      {"generations", config.evolution.generations},
      {"workers", workers},
      {"seed", config.seed},
      {"sanity", sanity_json(summary.sanity)},
      {"idle_genes", idle}};
}

std::string directions_text(const FitnessSettings& fitness) {
  if (fitness.objectives.empty()) {
    return std::string(higher_is_better(fitness.kind) ? "higher" : "lower") + " is better";
  }
  return joined(fitness.objectives, ", ", [&](const SearchedObjective& objective) {
    return objective.name + (objective.maximise ? " higher is better" : " lower is better");
  });
}

// Of an objective, at the config's own values.
std::string value_text(const FitnessSettings& fitness, const Summary& summary) {
  const v1::TaskResult& result = *summary.evaluated;
  const std::string more = result.message().empty() ? "" : "; " + result.message();
  std::string values;
  for (int i = 0; i < result.evaluate().objectives_size(); ++i) {
    values += (i > 0 ? ", " : "") + fitness.objectives[static_cast<std::size_t>(i)].name + " " +
              format_number(result.evaluate().objectives(i), 10);
  }
  switch (result.outcome()) {
    case v1::OK:
      return (values.empty() ? format_number(result.evaluate().fitness(), 10) : values) +
             " at the config's own values" + more;
    case v1::INFEASIBLE:
      return "none that counts: violations sum to " +
             format_number(result.evaluate().penalty(), 10) + " at the config's own values" + more;
    default:
      return "none at the config's own values, the evaluation failed";
  }
}

std::string standing(const Summary& summary) {
  if (const auto& result = summary.evaluated; result && has_failed(*result)) {
    return "readable, but the evaluation at the config's own values failed: " +
           (result->message().empty() ? v1::Outcome_Name(result->outcome()) : result->message());
  }
  const std::vector<SanityFinding>& findings = summary.sanity;
  for (const SanityFinding& f : findings) {
    if (f.severity != Severity::kNote) return "readable, but " + finding_phrase(f);
  }
  if (!summary.idle.empty()) return "readable, but genes that change no score are searched";
  return "fine";
}

// What is searched, how, and what that costs.
std::string search_text(const Config& config, const Summary& summary, unsigned workers) {
  const Problem& problem = config.problem;
  if (problem.genes.empty()) return "\ngenes        none: nothing can be evolved\n";
  std::string text = fmt::format("\ngenes        {}\n", problem.genes.size());
  for (const Gene& gene : problem.genes) {
    const auto end = [&](double value) { return problem.table().format(gene.row, value); };
    text += fmt::format("             {} in [{}, {}]{}\n", problem.table()[gene.row].key,
                        end(gene.lower), end(gene.upper),
                        gene.scale == ParameterScale::kLog ? ", log scale" : "");
  }
  const OptimiserKind kind = config.evolution.optimiser.kind;
  text += fmt::format("evolution    {}, at most {} generations, seed {}\n",
                      kind == OptimiserKind::kGenetic
                          ? fmt::format("{} individuals", config.evolution.population)
                          : fmt::format("by {}", optimisers()[static_cast<std::size_t>(kind)].name),
                      config.evolution.generations, config.seed);
  const std::string unread = unread_by_search(config.text, kind);
  if (!unread.empty()) text += "             " + unread + "\n";
  const auto most = most_evaluations(config.evolution, problem.genes.size());
  const double one_s = summary.evaluation_s, all_s = one_s * static_cast<double>(most);
  if (one_s > 0) {
    text += fmt::format(
        "cost         {} an evaluation (measured here); {} of them about {} on {} workers like "
        "it\n",
        one_s < 1 ? format_number(one_s, 2) + " s" : format_duration(one_s), most,
        format_duration(all_s / std::max(1u, workers)), workers);
  }
  text += fmt::format("farm         {} local workers", workers);
  if (config.farm.listen) text += ", and remote ones at " + *config.farm.listen;
  return text + "\nproblem      " + problem_hash(to_proto(problem)) + "\n";
}

std::string describe(const Config& config, const Summary& summary, unsigned workers) {
  const Problem& problem = config.problem;
  std::string text = config.path + ": " + standing(summary) + "\n";
  for (const SanityFinding& f : summary.sanity) {
    text += fmt::format("{}        {}: {} {}\n", f.severity == Severity::kNote ? "note " : "doubt",
                        f.name, f.text, f.remedy);
  }
  for (const IdleGene& gene : summary.idle) {
    text += "idle gene    " + gene.key + " changes no score; " + gene.remedy + ".\n";
  }
  text += "scenario     " + problem.scenario + ", ";
  if (is_value(problem.fitness.kind)) {
    text += problem.external->table.declaration().name + "\nvalue        " +
            value_text(problem.fitness, summary) + "\ndirection    " +
            directions_text(problem.fitness);
    return text + search_text(config, summary, workers);
  }
  // The first row of every other table is the model that is simulated.
  if (problem.external) {
    text += problem.external->table.declaration().name + "\n";
  } else if (problem.ground) {
    text += drive_names()[static_cast<std::size_t>(problem.ground->robot().drive)] + "\n";
  } else {
    text += problem.table()[0].key + " " + problem.table().format(0, problem.values[0]);
    if (problem.tracked) {
      const std::string& name = problem.tracked->name();
      text += ", sizes of " + (name.empty() ? "the file of [robot]" : name);
    }
    text += "\n";
  }
  text += fmt::format("trials       {} in {} sessions:", summary.trials, summary.sessions);
  for (const auto& [command, count] : summary.commands) {
    text += fmt::format(" {} {}", count, command);
  }
  text += fmt::format(
      "\nmotions      {} simulated an evaluation\neffects      {}\nfitness      {}, {} is better",
      motions_of(summary), summary.effects.empty() ? "none" : joined(summary.effects),
      fitness_name(problem.fitness.kind),
      higher_is_better(problem.fitness.kind) ? "higher" : "lower");
  return text + search_text(config, summary, workers);
}

Result<int> run_check(const CheckOptions& options, CliContext& context) {
  Console& console = context.console;
  // A ground robot's needs no genes to be diagnosed and exported.
  const auto check = [](const Config& read) {
    return read.problem.ground && read.problem.genes.empty() ? Status() : check_runnable(read);
  };
  ASSIGN_OR_RETURN(const auto config, open_config(options.config, options.trials, console, check));
  const unsigned workers = local_workers({}, config.farm);
  Summary summary = summarise(config);
  // Times that are no seconds would take as long to simulate.
  if (!config.problem.windows() || !any_unusable(summary.sanity)) {
    RETURN_IF_ERROR(measure_evaluation(config, context, &summary));
    RETURN_IF_ERROR(find_idle_genes(config, workers, context, &summary));
  }
  console.result(describe(config, summary, workers), to_json(config, summary, workers));
  if (!summary.evaluated) return kExitBadUsage;
  if (summary.evaluated->outcome() == v1::WORKER_FAILED) return kExitQuarantined;
  return summary.idle.empty() && !has_failed(*summary.evaluated) ? kExitDone : kExitBadUsage;
}

}  // namespace

SubcommandRun setup_check(CLI::App& app) {
  auto options = std::make_shared<CheckOptions>();
  app.add_option("CONFIG", options->config, "Config file (TOML)")->required();
  options->trials.declare(app);
  options->trials.needed = false;
  app.footer(
      "Examples:\n"
      "  gapfarm check configs/demo.toml\n"
      "  gapfarm check configs/srv1_forward.toml --trials logs/*.dat");
  return [options](CliContext& context) { return run_check(*options, context); };
}

}  // namespace gapfarm
