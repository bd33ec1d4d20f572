#include "common/config/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "common/trials/files.h"

namespace gapfarm::config_test {

using testing::AllOf;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

std::string error_of(const std::string& text) {
  const auto config = parse_config(text, "c.toml");
  return config.ok() ? "no error" : config.error().message;
}

Config config_of(const std::string& text, const std::string& path = "c.toml") {
  auto config = parse_config(text, path);
  EXPECT_TRUE(config.ok()) << config.error().message;
  return config.ok() ? *config : Config{};
}

double value_of(const Config& config, const char* key) {
  return config.problem.values[config.problem.table().row(key)];
}

TEST(Config, HeldOutKeysKeepTheirDefaults) {
  const Config config = config_of("");
  EXPECT_EQ(config.problem.scenario, "srv1");
  EXPECT_EQ(config.problem.values, srv1_table().nominal());
  EXPECT_EQ(config.problem.commands.size(), 6u);
  EXPECT_EQ(config.seed, 1u);
  EXPECT_EQ(config.evolution.population, EvolutionSettings{}.population);
  EXPECT_FALSE(check_evolvable(config).ok());
}

TEST(Config, WhoSearchesByDefaultFollowsFromWhatIsSet) {
  const auto kind = [](const char* text) { return config_of(text).evolution.optimiser.kind; };
  EXPECT_EQ(kind(""), OptimiserKind::kAutoSearch);
  EXPECT_EQ(kind("[evolution]\nelite_replicates = 4\n[evolution.stop]\ngenerations = 9\n"),
            OptimiserKind::kAutoSearch);
  EXPECT_EQ(kind("[optimiser]\nsigma = 0.2\n"), OptimiserKind::kAutoSearch);
  const char* operators = "[evolution]\nselection = \"rank\"\n";
  EXPECT_EQ(kind(operators), OptimiserKind::kGenetic);
  EXPECT_THAT(default_optimiser(operators)->reason, HasSubstr("sets its 'selection'"));
  EXPECT_FALSE(default_optimiser("[optimiser]\nkind = \"cma_es\"\n"));
}

TEST(Config, NamesWhatTheSearchDoesNotRead) {
  const char* text =
      "[evolution]\npopulation = 9\nselection = \"rank\"\nseed_nominal = true\n"
      "[evolution.stop]\ngenerations = 9\n[optimiser]\nsigma = 0.2\nlocal = \"bobyqa\"\n"
      "population = 30\n";
  const auto unread = [&](OptimiserKind kind) { return unread_by_search(text, kind); };
  EXPECT_EQ(unread(OptimiserKind::kCmaEs),
            "kind = \"cma_es\" does not read evolution.population, evolution.selection, "
            "optimiser.local");
  EXPECT_THAT(unread(OptimiserKind::kRandomSearch), Not(HasSubstr("population")));
  EXPECT_THAT(unread(OptimiserKind::kGenetic), Not(HasSubstr("evolution.")));
  EXPECT_EQ(unread_by_search("", OptimiserKind::kAutoSearch), "");
}

TEST(Config, AFreePlanHasRangesAndAGridHasLevels) {
  const SimulateSettings plan = config_of(R"([simulate]
plan = "free"
duty_range = [-0.5, 1]
duration_range = [0.3, 0.9]
duty_step = 0.1
)")
                                    .simulate;
  EXPECT_EQ(plan.plan, PlanKind::kFree);
  EXPECT_EQ(plan.duty_range.lower, -0.5);
  EXPECT_EQ(plan.duration_range_s.upper, 0.9);
  EXPECT_EQ(plan.duty_step, 0.1);
  EXPECT_EQ(config_of("").simulate.plan, PlanKind::kGrid);
  EXPECT_THAT(error_of("[simulate]\nplan = \"free\"\nlevels = [0.5]\n"),
              HasSubstr("c.toml:3:10: levels is of plan = \"grid\" only"));
  EXPECT_THAT(error_of("[simulate]\nduty_step = 0.1\n"), HasSubstr("is of plan = \"free\" only"));
  EXPECT_THAT(error_of("[simulate]\nplan = \"free\"\nduty_range = [1, -1]\n"),
              HasSubstr("expected two numbers, the least and the greatest"));
}

TEST(Config, ReadsEverySection) {
  const Config config = config_of(
      R"(scenario = "srv1"
seed = 42
trials = ["a.csv", "/data/b.dat", "../c.csv"]
[parameters]
robot = "wheels"
mass = 1
step_rate = 120
[effects.battery_sag]
rate = 0.004
[effects.camera_seam]
axis = "y"
[genes]
mass = [0.2, 0.5]
friction = { range = [0.1, 1.0], scale = "linear" }
contact_length = "table"
wheel_shape = ["sphere", "cylinder"]
step_rate = [60, 480]
motor_lag.tau = [0, 0.2]
"heading_offset.angle" = [-0.1, 0.1]
[commands.forward]
duration = 1.5
left = 0.5
[fitness]
kind = "robust_mahalanobis"
heave_penalty = 3
[spread]
kind = "sampled"
replicates = 32
[evolution]
population = 10
elitism = 2
selection = "rank"
crossovers = ["one_point", "blend"]
mutations = "gaussian"
order = "separate"
self_adaptation = false
restart_generations = 20
[optimiser]
kind = "cma_es"
population = 12
sigma = 0.2
local = "bobyqa"
[evolution.stop]
generations = 500
time = 60
target_fitness = 0.05
stagnation_generations = 50
[farm]
workers = 0
listen = "tcp://0.0.0.0:5555"
[simulate]
sessions = 1
levels = [0.5, 1]
durations = [0.5]
commands = ["forward", "turn_cw"]
)",
      "configs/c.toml");
  EXPECT_EQ(config.seed, 42u);
  EXPECT_THAT(config.trial_files, ElementsAre("configs/a.csv", "/data/b.dat", "c.csv"));
  EXPECT_EQ(value_of(config, "robot"), 1);
  EXPECT_EQ(value_of(config, "mass"), 1);
  EXPECT_EQ(value_of(config, "battery_sag.rate"), 0.004);
  EXPECT_EQ(value_of(config, "camera_seam.axis"), 1);

  const ParameterTable& table = config.problem.table();
  const std::vector<Gene> genes = {
      {table.row("mass"), 0.2, 0.5, ParameterScale::kLinear},
      {table.row("contact_length"), 0.02, 0.14, ParameterScale::kLinear},
      {table.row("friction"), 0.1, 1.0, ParameterScale::kLinear},
      {table.row("step_rate"), 60, 480, ParameterScale::kLog},
      {table.row("wheel_shape"), 0, 1, ParameterScale::kLinear},
      {table.row("motor_lag.tau"), 0, 0.2, ParameterScale::kLinear},
      {table.row("heading_offset.angle"), -0.1, 0.1, ParameterScale::kLinear},
  };
  EXPECT_EQ(config.problem.genes, genes) << "in the table's order";
  EXPECT_TRUE(check_evolvable(config).ok());

  const CommandSpec& forward = config.problem.command("forward");
  EXPECT_EQ(forward.duration_s, 1.5);
  EXPECT_EQ(forward.left, 0.5);
  EXPECT_EQ(forward.right, 1);
  EXPECT_EQ(config.problem.fitness.kind, FitnessKind::kRobustMahalanobis);
  EXPECT_EQ(config.problem.fitness.heave_penalty, 3);
  EXPECT_EQ(config.problem.spread.kind, SpreadKind::kSampled);
  EXPECT_EQ(config.problem.spread.replicates, 32u);
  const EvolutionSettings& evolution = config.evolution;
  EXPECT_EQ(evolution.population, 10u);
  EXPECT_EQ(evolution.selection, SelectionKind::kRank);
  EXPECT_THAT(evolution.crossovers, ElementsAre(CrossoverKind::kOnePoint, CrossoverKind::kBlend));
  EXPECT_THAT(evolution.mutations, ElementsAre(MutationKind::kGaussian));
  EXPECT_EQ(evolution.order, VariationOrder::kSeparate);
  EXPECT_FALSE(evolution.self_adaptation);
  EXPECT_EQ(evolution.generations, 500u);
  EXPECT_EQ(evolution.optimiser.kind, OptimiserKind::kCmaEs);
  EXPECT_EQ(evolution.optimiser.population, 12u);
  EXPECT_EQ(evolution.optimiser.sigma, 0.2);
  EXPECT_EQ(evolution.optimiser.local, LocalSearchKind::kBobyqa);
  EXPECT_EQ(evolution.time_s, 60);
  EXPECT_EQ(evolution.target_fitness, 0.05);
  EXPECT_EQ(evolution.stagnation_generations, 50u);
  EXPECT_EQ(evolution.restart_generations, 20u);
  EXPECT_EQ(config.farm.workers, 0u);
  EXPECT_EQ(config.farm.listen, "tcp://0.0.0.0:5555");
  EXPECT_THAT(config.simulate.levels, ElementsAre(0.5, 1));
  EXPECT_THAT(config.simulate.commands, ElementsAre("forward", "turn_cw"));
}

TEST(Config, PointsAtUnknownTextAndSuggests) {
  EXPECT_EQ(error_of("[evolution]\n  populaton = 5\n"),
            "c.toml:2:3: unknown key 'populaton' in [evolution]; did you mean 'population'?");
  EXPECT_EQ(error_of("[evoluton]\n"),
            "c.toml:1:2: unknown section 'evoluton'; did you mean 'evolution'?");
  EXPECT_THAT(error_of("[parameters]\nfrictoin = 1\n"),
              AllOf(StartsWith("c.toml:2:1: unknown key"), HasSubstr("did you mean 'friction'?")));
  EXPECT_THAT(error_of("[effects.batery_sag]\nrate = 0\n"), HasSubstr("mean 'battery_sag'?"));
  EXPECT_THAT(error_of("[effects.battery_sag]\nrat = 0\n"), HasSubstr("2:1: unknown key 'rat'"));
  EXPECT_THAT(error_of("[genes]\nfricton = [0.1, 1]\n"),
              AllOf(StartsWith("c.toml:2:1: unknown gene"), HasSubstr("did you mean 'friction'?")));
  EXPECT_THAT(error_of("[genes.motor_lag]\nta = [0, 0.1]\n"), HasSubstr("did you mean 'tau'?"));
  EXPECT_THAT(error_of("[commands.foward]\nleft = 1\n"), HasSubstr("did you mean 'forward'?"));
  EXPECT_THAT(error_of("[evolution]\nselection = \"tornament\"\n"),
              StartsWith("c.toml:2:13: unknown selection 'tornament'; did you mean 'tournament'?"));
  EXPECT_THAT(error_of("scenario = \"srv2\"\n"), HasSubstr("did you mean 'srv1'?"));
  EXPECT_THAT(error_of("[parameters]\nwheel_shape = \"spere\"\n"), HasSubstr("mean 'sphere'?"));
  EXPECT_THAT(error_of("[parameters]\n\"motor_lag.tau\" = 0.1\n"),
              HasSubstr("belongs to an effect; write it in [effects.motor_lag]"));
}

TEST(Config, RefusesWrongTypes) {
  EXPECT_EQ(error_of("[parameters]\nmass = \"heavy\"\n"),
            "c.toml:2:8: mass is a string, expected a number in kg");
  EXPECT_EQ(error_of("[evolution]\npopulation = 10.5\n"),
            "c.toml:2:14: population is a number, expected an integer in [2, 1000000]");
  EXPECT_THAT(error_of("evolution = 3\n"), HasSubstr("expected the section [evolution]"));
  EXPECT_THAT(error_of("[parameters]\nstep_rate = 240.5\n"), HasSubstr("expected an integer"));
  EXPECT_THAT(error_of("trials = [1]\n"), HasSubstr("c.toml:1:11: trials is an integer"));
  EXPECT_THAT(error_of("[genes]\nmass = 0.3\n"), HasSubstr("expected [lower, upper]"));
  EXPECT_THAT(error_of("[genes]\nmass = [\"a\", 1]\n"), HasSubstr("2:9: mass is a string"));
  EXPECT_THAT(error_of("[genes]\nmotor_lag = [0, 1]\n"),
              HasSubstr("the section [genes.motor_lag]"));
  EXPECT_THAT(error_of("[evolution]\nself_adaptation = 1\n"), HasSubstr("expected true or false"));
}

TEST(Config, RefusesWhatIsOutOfRange) {
  EXPECT_THAT(
      error_of("[parameters]\nmass = 35\n"),
      AllOf(StartsWith("c.toml:2:8: mass is 35, but it must be between 0.1 kg and 1.5 kg; "),
            HasSubstr("name it in [robot] file")));
  EXPECT_THAT(error_of("[parameters]\nmass = nan\n"), StartsWith("c.toml:2:8: mass is nan"));
  EXPECT_THAT(error_of("[genes]\nmass = [0.2, 20]\n"), StartsWith("c.toml:2:14: mass is 20, but"));
  EXPECT_THAT(error_of("[genes]\nmass = [0.5, 0.5]\n"),
              HasSubstr("gene mass has the empty range [0.5 kg, 0.5 kg], expected lower < upper"));
  EXPECT_THAT(error_of("[genes]\nmass = [0.5]\n"), HasSubstr("range of 1 values"));
  EXPECT_THAT(error_of("[genes]\ndrive_noise_side = {scale = \"log\"}\n"),
              HasSubstr("which a log scale cannot hold"));
  EXPECT_THAT(error_of("[genes]\nwheel_shape = [\"sphere\", \"hull\"]\n"),
              HasSubstr("neighbours in: sphere, cylinder, box, hull"));
  EXPECT_THAT(error_of("[genes]\n\"motor_lag.tau\" = [0, 0.1]\nmotor_lag.tau = [0, 0.2]\n"),
              HasSubstr("gene motor_lag.tau is written twice"));
  EXPECT_THAT(error_of("[commands.forward]\nleft = 2\n"),
              HasSubstr("left is 2, expected a number in [-1, 1] (duty)"));
  EXPECT_THAT(error_of("[commands.forward]\nleft = 9007199254740993\n"),
              HasSubstr("left is 9007199254740992, expected a number in [-1, 1] (duty)"))
      << "of more digits than a double has";
  EXPECT_THAT(error_of("seed = -1\n"), HasSubstr("expected an integer of at least 0"));
  EXPECT_THAT(error_of("[fitness]\noutlier_share = 0.6\n"), HasSubstr("in [0, 0.5]"));
}

TEST(Config, RefusesWhatDoesNotFitTogether) {
  EXPECT_EQ(error_of("[evolution]\npopulation = 10\nelitism = 10\n"),
            "c.toml:3:11: elitism is 10, expected less than the population (10)");
  EXPECT_THAT(error_of("[evolution]\npopulation = 2\nelitism = 0\n"),
              StartsWith("c.toml:2:14: tournament_size is 3, expected at most the population (2)"));
  EXPECT_THAT(error_of("[farm]\nheartbeat_interval = 20\n"), HasSubstr("silence_limit is 10 s"));
  EXPECT_THAT(error_of("[farm]\nlisten = \"localhost\"\n"), HasSubstr("expected an endpoint"));
  EXPECT_THAT(error_of("[spread]\nreplicates = 4\n"), HasSubstr("belong to kind = \"sampled\""));
  EXPECT_THAT(error_of("[evolution]\nrestart_generations = 9\n[evolution.stop]\n"
                       "stagnation_generations = 9\n"),
              HasSubstr("or the run stops before it restarts"));
  EXPECT_THAT(error_of("[simulate]\ncommands = [\"forward\", \"forward\"]\n"), HasSubstr("twice"));
  EXPECT_THAT(error_of("[simulate]\npath_interval = 1e-9\n"), HasSubstr("at least 0.0001 s"));
  EXPECT_THAT(error_of("[evolution]\ncrossovers = []\n"), HasSubstr("is empty"));
  EXPECT_THAT(error_of("[evolution]\nmutations = []\n"), HasSubstr("is empty"));
  EXPECT_THAT(error_of("[evolution]\nmutation_probability = 2\n"), HasSubstr("[0, 1]"));
}

TEST(Config, ListsEveryMistakeInTheFilesOrder) {
  EXPECT_EQ(error_of("sed = 1\n[farm]\nwindow = 0\n[parameters]\nfriction = 90\n"),
            "c.toml:1:1: unknown key 'sed'; did you mean 'seed'?\n"
            "c.toml:3:10: window is 0, expected an integer in [1, 1024]\n"
            "c.toml:5:12: friction is 90, but it must be between 0.02 and 2");
}

TEST(Config, NamesWhatIsNotAConfig) {
  EXPECT_THAT(error_of("seed = \n"), StartsWith("c.toml:1:"));
  EXPECT_THAT(error_of("session,trial,t,command,left,right\n"),
              HasSubstr("found a trial log, expected a config"));
  EXPECT_THAT(error_of("model = 1\n"), HasSubstr("found a model, expected a config"));
  EXPECT_THAT(error_of("drive = \"omni\"\n"), HasSubstr("found a robot's file, expected a config"));
  const auto missing = read_config("/nowhere/c.toml");
  ASSERT_FALSE(missing.ok());
  EXPECT_THAT(missing.error().message, EndsWith("/nowhere/c.toml: no such file; check the path"));
  const auto here = read_config("nowhere/c.toml");
  ASSERT_FALSE(here.ok());
  EXPECT_THAT(here.error().message,
              EndsWith("which leads to " + std::filesystem::absolute("nowhere/c.toml").string()));
}

// The files that ship with the project; a folder of the project, so it must not be empty.
TEST(Config, ShippedConfigsAreRead) {
  int files = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(GAPFARM_SOURCE_DIR) + "/configs")) {
    if (entry.path().extension() != ".toml") continue;
    ++files;
    const auto config = read_config(entry.path().string());
    ASSERT_TRUE(config.ok()) << config.error().message;
    // Some are for commands that search nothing.
    if (config->problem.genes.empty()) continue;
    EXPECT_TRUE(check_evolvable(*config).ok()) << entry.path();
  }
  EXPECT_GE(files, 4);
}

// The example of every key must stay true, and the table must list every row.
TEST(Config, TheDocumentationIsTrue) {
  const auto page = read_text_file(std::string(GAPFARM_SOURCE_DIR) + "/docs/configuration.md");
  ASSERT_TRUE(page.ok());
  const std::size_t begin = page->find("```toml\n") + 8;
  const auto config = parse_config(page->substr(begin, page->find("```\n", begin) - begin), "docs");
  ASSERT_TRUE(config.ok()) << config.error().message;
  const EvolutionSettings defaults;
  EXPECT_EQ(config->evolution.population, defaults.population);
  EXPECT_EQ(config->evolution.crossovers, defaults.crossovers);
  EXPECT_EQ(config->evolution.mutation_probability, defaults.mutation_probability);
  EXPECT_EQ(config->evolution.generations, defaults.generations);
  EXPECT_EQ(config->farm.silence_limit_s, FarmSettings{}.silence_limit_s);
  EXPECT_EQ(config->simulate.trials_per_session, SimulateSettings{}.trials_per_session);
  EXPECT_EQ(config->problem.fitness.heave_penalty, FitnessSettings{}.heave_penalty);
  for (const Parameter& row : srv1_table().rows()) {
    if (!row.effect.empty()) continue;
    EXPECT_THAT(*page, HasSubstr("| " + row.key + " |"));
    if (row.kind == ParameterKind::kReal) {
      EXPECT_THAT(*page, HasSubstr("| " + row.key + " | " + row.unit + " | "));
    }
  }
}

}  // namespace gapfarm::config_test
