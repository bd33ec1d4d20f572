#include "master/run/stored_run.h"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <type_traits>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/config/config.h"
#include "common/json/json.h"
#include "common/problem/problem.h"
#include "common/trials/files.h"
#include "master/evolve/optimisers.h"

namespace gapfarm {
namespace {

using Ours = EvolutionOverrides;
using Theirs = EvolutionSettings;

// Every override: its name, and its place here and among the settings.
template <class Visit>
void each(Visit visit) {
  visit("generations", &Ours::generations, &Theirs::generations);
  visit("evaluations", &Ours::evaluations, &Theirs::evaluations);
  visit("time_s", &Ours::time_s, &Theirs::time_s);
  visit("target_fitness", &Ours::target_fitness, &Theirs::target_fitness);
  visit("population", &Ours::population, &Theirs::population);
}

// Among the overrides: the kind that a config without one got.  Runs from before there was `auto`
// by default have none, and are the genetic algorithm's.
constexpr const char* kDefaultKind = "optimiser";
// And the log's files, which the config may not name.
constexpr const char* kTrialFiles = "trials";

// Among the overrides, too: the folder in which the run's command was called.
constexpr const char* kFolder = "folder";

Json start_json(const SearchStart& start) {
  Json json = {{"from", start.from}, {"genomes", start.genomes}};
  if (start.generation > 0) {
    json["generation"] = start.generation;
    json["digest"] = start.digest;
    json["fixed"] = start.fixed;
    json["freed"] = start.freed;
  }
  return json;
}

// Of a store that was changed by hand: what can be read.
SearchStart stored_start(const RunInfo& info, std::size_t genes) {
  SearchStart start;
  const Json json = search_start(info);
  if (!json.is_object()) return start;
  const auto numbers = [](const Json& list) {
    return filtered(list, &Json::is_number, [](const Json& value) { return value.get<double>(); });
  };
  for (const Json& genome : json.value("genomes", Json::array())) {
    if (genome.size() == genes) start.genomes.push_back(numbers(genome));
  }
  return start;
}

}  // namespace

RunInfo run_info(const Config& config, const EvolutionOverrides& overrides) {
  const v1::Problem problem = to_proto(config.problem);
  const FitnessKind kind = config.problem.fitness.kind;
  RunInfo info;
  info.config_path = config.path;
  info.config_text = config.text;
  Json changes = parse_json(overrides.to_json());
  if (default_optimiser(config.text)) {
    changes[kDefaultKind] =
        optimisers()[static_cast<std::size_t>(config.evolution.optimiser.kind)].name;
  }
  if (!config.trial_files.empty()) changes[kTrialFiles] = config.trial_files;
  std::error_code ignored;
  changes[kFolder] = std::filesystem::current_path(ignored).string();
  const SearchStart& start = config.evolution.start;
  if (!start.genomes.empty()) changes["start"] = start_json(start);
  info.overrides = json_text(changes);
  info.problem = serialise(problem);
  info.problem_hash = problem_hash(problem);
  info.seed = config.seed;
  info.fitness = fitness_name(kind);
  info.fitness_unit = fitness_unit(kind);
  info.higher_is_better = higher_is_better(kind);
  return info;
}

Result<Problem> stored_problem(const RunInfo& info) {
  v1::Problem message;
  if (!message.ParseFromString(info.problem)) {
    return Error{"the stored problem cannot be read; the run store is damaged"};
  }
  return from_proto(message);
}

Result<Problem> stored_problem(const RunReader& run) {
  return under(run.run().string(), stored_problem(run.info()));
}

Result<Config> parse_stored(const RunInfo& info, const Problem& problem) {
  const Json all = parse_json(info.overrides);
  const bool has = all.is_object() && all.contains(kFolder) && all[kFolder].is_string();
  const std::string folder = has ? all[kFolder].get<std::string>() : "";
  const auto seen = [&](const std::string& path) { return has ? path_from(folder, path) : path; };
  ASSIGN_OR_RETURN(Config config, parse_config(info.config_text, seen(info.config_path),
                                               start_no_program, &problem));
  if (!all.is_object() || !all.value(kTrialFiles, Json()).is_array()) return config;
  config.trial_files.clear();
  for (const Json& file : all[kTrialFiles]) {
    if (file.is_string()) config.trial_files.push_back(seen(file.get<std::string>()));
  }
  return config;
}

std::string merged_overrides(const RunInfo& info, const EvolutionOverrides& overrides) {
  Json all = parse_json(info.overrides);
  if (!all.is_object()) all = Json::object();
  all.update(parse_json(overrides.to_json()));
  return json_text(all);
}

Result<Config> stored_config(const RunInfo& info, const EvolutionOverrides& overrides) {
  ASSIGN_OR_RETURN(Problem problem, stored_problem(info));
  ASSIGN_OR_RETURN(auto config, parse_stored(info, problem));
  config.problem = std::move(problem);
  config.seed = info.seed;
  if (default_optimiser(info.config_text) && !parse_json(info.overrides).contains(kDefaultKind)) {
    config.evolution.optimiser.kind = OptimiserKind::kGenetic;
  }
  EvolutionOverrides::from_json(merged_overrides(info, overrides)).apply(config.evolution);
  config.evolution.start = stored_start(info, config.problem.genes.size());
  return config;
}

Result<Model> model_of_member(const RunReader& run, const StoredIndividual& member,
                              std::uint64_t generation) {
  const std::string name = run.run().string();
  ASSIGN_OR_RETURN(const Problem problem, stored_problem(run));
  if (!member.fitness || member.genome.size() != problem.genes.size()) {
    return Error{name + ": genome " + std::to_string(member.birth_id) + " did not end well (" +
                 member.outcome + "), so it makes no model; choose another"};
  }
  ASSIGN_OR_RETURN(const auto generations, run.generations());
  std::uint64_t evaluations = 0;
  for (const StoredGeneration& g : generations) {
    if (g.generation == generation) evaluations = g.evaluations;
  }
  Model model = model_of_problem(problem, problem.values_of(member.genome));
  model.score = member.fitness;
  model.data = {run.info().problem_hash, problem.log.trials.size(), {}};
  if (const auto config = parse_stored(run.info(), problem)) {
    model.data.files = config->trial_files;
  }
  model.origin = {name, run.info().seed, generation, evaluations};
  return model;
}

Result<Model> current_best(const RunReader& run) {
  ASSIGN_OR_RETURN(const auto generations, run.generations());
  const std::string name = run.run().string();
  if (generations.empty()) {
    return Error{name +
                 ": no generation is complete yet; wait for the first, see `gapfarm status " +
                 shell_quoted(name) + "`"};
  }
  const StoredGeneration& last = generations.back();
  // By number: another generation may be committed meanwhile.
  ASSIGN_OR_RETURN(const auto members, run.individuals(last.generation));
  if (members.empty() || !members.front().fitness) {
    return Error{name + ": nothing has ended well yet; see `gapfarm status " + shell_quoted(name) +
                 "`"};
  }
  return model_of_member(run, members.front(), last.generation);
}

void EvolutionOverrides::apply(EvolutionSettings& settings) const {
  each([&](const char*, auto ours, auto theirs) {
    if (this->*ours) settings.*theirs = *(this->*ours);
  });
  if (population) settings.optimiser.population = *population;
}

std::string EvolutionOverrides::to_json() const {
  Json json = Json::object();
  each([&](const char* name, auto ours, auto) {
    if (this->*ours) json[name] = *(this->*ours);
  });
  return json_text(json);
}

EvolutionOverrides EvolutionOverrides::from_json(const std::string& text) {
  EvolutionOverrides overrides;
  const Json json = parse_json(text);
  if (!json.is_object()) return overrides;
  each([&](const char* name, auto ours, auto) {
    using Value = typename std::decay_t<decltype(overrides.*ours)>::value_type;
    if (json.contains(name) && json[name].is_number()) {
      overrides.*ours = json[name].template get<Value>();
    }
  });
  return overrides;
}

}  // namespace gapfarm
