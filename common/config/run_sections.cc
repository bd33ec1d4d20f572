// [evolution], [farm] and [simulate]: how a run goes.

#include "common/config/sections.h"
#include "common/problem/problem.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

const std::vector<std::string> kSelectionNames = {"tournament", "rank"};
const std::vector<std::string> kCrossoverNames = {"one_point", "uniform", "blend"};
const std::vector<std::string> kMutationNames = {"gaussian", "uniform_reset"};
const std::vector<std::string> kOrderNames = {"separate", "sequence"};

constexpr unsigned kMany = 1000000;

template <class Kind>
void read_kinds(TomlSection& section, const char* key, const std::vector<std::string>& known_names,
                std::vector<Kind>& to) {
  const auto found = section.choices(key, known_names);
  if (!found) return;
  const std::string name = key;
  if (found->empty()) section.fail(key, name + " is empty, expected at least one");
  to.clear();
  for (const std::size_t index : *found) to.push_back(static_cast<Kind>(index));
}

void read_stop(TomlSection& evolution, EvolutionSettings& to) {
  evolution.within("stop", [&](TomlSection& stop) {
    stop.read("generations", to.generations, 1);
    stop.read("evaluations", to.evaluations, 1);
    stop.read("time", to.time_s, 1e-3, kUnbounded, "s");
    stop.read("target_fitness", to.target_fitness, -kUnbounded, kUnbounded);
    stop.read("stagnation_generations", to.stagnation_generations, 1);
  });
}

// Values that are fine alone but not together.  Compares with defaults too, so that a population
// below the default elitism is noticed where it is written.
void check_evolution(TomlSection& section, const EvolutionSettings& evolution) {
  const auto blame = [&](const char* key, const std::string& sentence) {
    section.fail(section.table().contains(key) ? key : "population", sentence);
  };
  const std::string population = std::to_string(evolution.population);
  if (evolution.elitism >= evolution.population) {
    blame("elitism", "elitism is " + std::to_string(evolution.elitism) +
                         ", expected less than the population (" + population + ")");
  }
  if (evolution.selection == SelectionKind::kTournament &&
      evolution.tournament_size > evolution.population) {
    blame("tournament_size", "tournament_size is " + std::to_string(evolution.tournament_size) +
                                 ", expected at most the population (" + population + ")");
  }
  if (evolution.restart_generations && evolution.stagnation_generations &&
      *evolution.restart_generations >= *evolution.stagnation_generations) {
    blame("restart_generations", "restart_generations is " +
                                     std::to_string(*evolution.restart_generations) +
                                     ", expected less than stop.stagnation_generations (" +
                                     std::to_string(*evolution.stagnation_generations) +
                                     "), or the run stops before it restarts");
  }
}

void check_commands(TomlSection& section, const std::vector<CommandSpec>& commands,
                    SimulateSettings& simulate) {
  const std::vector<std::string> names = command_names(commands);
  const auto found = section.choices("commands", names);
  if (!found) return;
  simulate.commands.clear();
  for (const std::size_t index : *found) simulate.commands.push_back(names[index]);
}

// Two ascending numbers.
void read_range(TomlSection& section, const char* key, double lower, double upper, const char* unit,
                Interval& to) {
  const auto ends = section.numbers(key, lower, upper, unit);
  if (!ends) return;
  if (ends->size() != 2 || (*ends)[0] > (*ends)[1]) {
    section.fail(key, std::string(key) + ": expected two numbers, the least and the greatest");
    return;
  }
  to = {(*ends)[0], (*ends)[1]};
}

// What a free plan draws from; a grid knows nothing of it.
void read_free_plan(TomlSection& section, SimulateSettings& to) {
  read_range(section, "duty_range", -1, 1, "", to.duty_range);
  read_range(section, "duration_range", 0, 60, "s", to.duration_range_s);
  section.read("duty_step", to.duty_step, 0, 1);
  for (const char* key : {"duty_range", "duration_range", "duty_step"}) {
    if (to.plan == PlanKind::kGrid && section.table().contains(key)) {
      section.fail(key, std::string(key) + " is of plan = \"free\" only");
    }
  }
  for (const char* key : {"levels", "durations", "commands"}) {
    if (to.plan == PlanKind::kFree && section.table().contains(key)) {
      section.fail(key, std::string(key) +
                            " is of plan = \"grid\" only; a free plan has "
                            "duty_range, duration_range and duty_step");
    }
  }
}

bool is_endpoint(const std::string& text) {
  return text.rfind("tcp://", 0) == 0 || text.rfind("ipc://", 0) == 0;
}

}  // namespace

void read_evolution(TomlSection& section, EvolutionSettings& to) {
  section.read("population", to.population, 2, kMany);
  section.read("elitism", to.elitism, 0, kMany);
  section.read("selection", to.selection, kSelectionNames);
  section.read("tournament_size", to.tournament_size, 1, kMany);
  section.read("rank_pressure", to.rank_pressure, 1.01, 2);
  read_kinds(section, "crossovers", kCrossoverNames, to.crossovers);
  read_kinds(section, "mutations", kMutationNames, to.mutations);
  section.read("order", to.order, kOrderNames);
  section.read("crossover_probability", to.crossover_probability, 0, 1);
  section.read("mutation_probability", to.mutation_probability, 0, 1);
  section.read("gene_mutation_share", to.gene_mutation_share, 0, 1);
  section.read("mutation_sigma", to.mutation_sigma, 1e-6, 1);
  section.read("blend_alpha", to.blend_alpha, 0, 2);
  section.read("self_adaptation", to.self_adaptation);
  section.read("probability_floor", to.probability_floor, 0, 0.5);
  section.read("elite_replicates", to.elite_replicates, 1, 10000);
  section.read("seed_nominal", to.seed_nominal);
  section.read("restart_generations", to.restart_generations, 1);
  section.read("islands", to.islands, 1, 10000);
  section.read("asynchronous", to.asynchronous);
  read_stop(section, to);
  check_evolution(section, to);
}

void read_farm(TomlSection& section, FarmSettings& to) {
  section.read("workers", to.workers, 0, 4096);
  if (std::string listen = "ipc://"; section.find("listen") != nullptr) {
    section.read("listen", listen);
    if (!is_endpoint(listen)) {
      section.fail("listen", "listen is " + quoted_word(listen) +
                                 ", expected an endpoint such as \"tcp://0.0.0.0:5555\"");
    }
    to.listen = std::move(listen);
  }
  section.read("window", to.window, 1, 1024);
  // ZeroMQ's own heartbeat time-to-live overflows above 65.5 s.
  section.read("heartbeat_interval", to.heartbeat_interval_s, 0.01, 60, "s");
  section.read("silence_limit", to.silence_limit_s, 0.05, 3600, "s");
  if (to.silence_limit_s <= to.heartbeat_interval_s) {
    const char* key =
        section.table().contains("silence_limit") ? "silence_limit" : "heartbeat_interval";
    section.fail(key, "silence_limit is " + format_double(to.silence_limit_s) +
                          " s, expected more than heartbeat_interval (" +
                          format_double(to.heartbeat_interval_s) + " s)");
  }
  section.read("progress_limit", to.progress_limit_s, 0, 1e6, "s");
  section.read("answer_limit", to.answer_limit_s, 0, 1e6, "s");
  section.read("failure_limit", to.failure_limit, 1, 1000);
  section.read("kill_limit", to.kill_limit, 1, 1000000);
  section.read("audit_share", to.audit_share, 0, 1);
  section.read("straggler_factor", to.straggler_factor, 0, 1e6);
  section.read("allow_mixed_numeric_classes", to.allow_mixed_numeric_classes);
}

void read_simulate(TomlSection& section, const std::vector<CommandSpec>& commands,
                   SimulateSettings& to) {
  static const std::string plans[] = {"grid", "free"};
  section.read("plan", to.plan, plans);
  section.read("sessions", to.sessions, 1, kMany);
  section.read("trials_per_session", to.trials_per_session, 1, kMany);
  section.read("chain", to.chain, 1, kMany);
  section.read("pause", to.pause_s, 0, 3600, "s");
  section.read("arena", to.arena_m, 0.1, 100, "m");
  if (auto levels = section.numbers("levels", 0, 1)) {
    if (levels->empty()) section.fail("levels", "levels is empty, expected at least one");
    to.levels = std::move(*levels);
  }
  if (auto durations = section.numbers("durations", 0, 60, "s")) {
    to.durations_s = std::move(*durations);
  }
  check_commands(section, commands, to);
  read_free_plan(section, to);
  section.read("path_interval", to.path_interval_s, 0, 60, "s");
  if (to.path_interval_s != 0 && to.path_interval_s < kLeastPathInterval_s) {
    section.fail("path_interval",
                 "path_interval is too fine, expected 0 (no paths) or at least 0.0001 s");
  }
}

}  // namespace gapfarm
