// What a config file says, typed.  Plain data: master and worker build their objects from it.  Of
// the text only [[stages]] and [validation] are read later (read_stages()).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/ranges.h"
#include "common/problem/problem.h"

namespace gapfarm {

enum class SelectionKind { kTournament, kRank };
enum class CrossoverKind { kOnePoint, kUniform, kBlend };
enum class MutationKind { kGaussian, kUniformReset };
// Separately: a child comes from crossover or from mutation.  In sequence: crossover, then
// mutation.
enum class VariationOrder { kSeparate, kSequence };

// The genetic algorithms, then the rows of methods.inc.
enum class OptimiserKind {
  kGenetic,
  kNsga2,
#define METHOD(name, file, Class, summary) k##Class,
#include "common/config/methods.inc"
};
enum class LocalSearchKind { kNelderMead, kSubplex, kBobyqa, kCobyla };
// What CMA-ES begins again with: a population that doubles, or by turns that and small ones.
enum class RestartKind { kIpop, kBipop };

// What [optimiser] says.  The genetic algorithm is set up by the rest of EvolutionSettings.
struct OptimiserSettings {
  OptimiserKind kind = OptimiserKind::kGenetic;
  // Individuals a generation; none: as the method has it (30 for differential evolution, 4 + 3 ln n
  // for CMA-ES over n genes, the evolution's population for random search).
  std::optional<unsigned> population;
  // F and CR of DE/rand/1/bin (0.8 and 0.9 when the other is given); neither: they adapt
  // themselves.
  std::optional<double> differential_weight, crossover_rate;
  double sigma = 0.3;         // CMA-ES: first s.d., share of a gene's range
  unsigned iterations = 100;  // de_simplex: of differential evolution before the simplex
  LocalSearchKind local = LocalSearchKind::kNelderMead;
  double step = 0.1;               // local search: first step, share of a gene's range
  unsigned local_evaluations = 0;  // of one local search; 0: 100 a gene
  RestartKind restarts = RestartKind::kIpop;
};

// Where a search begins in place of the config's own values, and where that is from.
struct SearchStart {
  std::vector<Genome> genomes;  // best first, of the problem's genes; empty: the config's values
  std::string from;             // a table, a model, a run
  // Of a run that another one branches off: its generation, the digest up to there, "GENE=VALUE",
  // and keys.
  std::uint64_t generation = 0;
  std::string digest;
  std::vector<std::string> fixed, freed;
};

struct EvolutionSettings {
  OptimiserSettings optimiser;
  unsigned population = 40;
  unsigned elitism = 2;
  SelectionKind selection = SelectionKind::kTournament;
  unsigned tournament_size = 3;
  double rank_pressure = 1.7;  // expected children of the best, (1, 2]
  std::vector<CrossoverKind> crossovers = {CrossoverKind::kBlend, CrossoverKind::kUniform};
  std::vector<MutationKind> mutations = {MutationKind::kGaussian, MutationKind::kUniformReset};
  VariationOrder order = VariationOrder::kSequence;
  double crossover_probability = 0.8;  // start value when self-adapted
  double mutation_probability = 0.5;   // same; per child
  double gene_mutation_share =
      0.0;                      // share of the genes a mutation changes; 0: one gene on average
  double mutation_sigma = 0.1;  // of a Gaussian mutation, in gene units
  double blend_alpha = 0.5;     // BLX-alpha (Eshelman and Schaffer 1993)
  bool self_adaptation = true;
  double probability_floor = 0.1;  // of a self-adapted operator
  unsigned elite_replicates = 8;   // at most so many scores an elite, when scores are noisy
  // Seeds the first generation with the config's own values as one individual.
  bool seed_nominal = true;
  // Stop conditions; the first that holds stops the run.
  std::uint64_t generations = 100;
  std::optional<std::uint64_t> evaluations;
  std::optional<double> time_s;
  std::optional<double> target_fitness;
  std::optional<std::uint64_t> stagnation_generations;  // without improvement
  // Restart (keeping the elites) after so many generations without improvement; none: never.
  std::optional<std::uint64_t> restart_generations;
  // The population in so many islands that wait for nobody else (master/evolve/optimisers.h).
  unsigned islands = 1;
  bool asynchronous = false;  // as many islands as the population has room for
  SearchStart start = {};
};

struct FarmSettings {
  std::optional<unsigned> workers;    // local processes; none: one a core
  std::optional<std::string> listen;  // endpoint for remote workers
  unsigned window = 2;                // jobs in a worker's hand
  double heartbeat_interval_s = 1;
  double silence_limit_s = 10;
  double progress_limit_s = 60;  // a local worker's simulation makes no step for so long; 0: off
  double answer_limit_s = 60;    // a local worker does not respond for so long; 0: off
  unsigned failure_limit = 3;    // workers that a genome may crash or hang
  unsigned kill_limit = 10;      // workers that may be killed (SIGKILL) under a genome
  double audit_share = 0.01;     // of the evaluations are done by two workers and compared
  double straggler_factor = 3;   // times the mean evaluation, after which idle workers get a copy
  bool allow_mixed_numeric_classes = false;
};

// Commands of the config at some levels and durations, or any duties for any time, as a joystick
// gives them.
enum class PlanKind { kGrid, kFree };

// `gapfarm simulate`: what to drive and how often.
struct SimulateSettings {
  PlanKind plan = PlanKind::kGrid;
  unsigned sessions = 3;
  unsigned trials_per_session = 100;
  unsigned chain = 4;  // trials between unrecorded moves
  double pause_s = 4;  // between commands
  double arena_m = 2;  // the robot is put down within [0.15, 0.85] of a square this wide
  std::vector<double> levels = {1.0};  // factors of the commands' duties
  std::vector<double> durations_s;     // empty: each command's own
  std::vector<std::string> commands;   // empty: all
  double path_interval_s = 0;          // 0: no paths
  // Of a free plan, drawn evenly for each side and trial.
  Interval duty_range = {-1, 1};
  Interval duration_range_s = {0.5, 2};
  double duty_step = 0;  // duties are multiples of it; 0: any
};

struct Config {
  std::string path;  // of the file
  std::string text;  // the file itself, kept in the run store
  Problem problem;   // its log is empty until trials are read
  EvolutionSettings evolution;
  FarmSettings farm;
  SimulateSettings simulate;
  std::vector<std::string> trial_files;  // as written, made relative to the config's folder; where
                                         // trials are windows of runs: folders of these
  WindowSettings windows;
  std::uint64_t seed = 1;
  std::string robot_path = {};  // of the robot's file; empty: there is none
};

}  // namespace gapfarm
