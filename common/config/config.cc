#include "common/config/config.h"

#include <filesystem>

#include "common/base/build_info.h"
#include "common/base/clock.h"
#include "common/config/sections.h"
#include "common/external/simulator.h"
#include "common/trials/files.h"
#include "common/trials/format.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

std::string beside(const std::string& config, const std::string& file) {
  const std::filesystem::path path(file);
  if (path.is_absolute()) return file;
  return (std::filesystem::path(config).parent_path() / path).lexically_normal().string();
}

void read_top(TomlSection& top, Config& config) {
  config.problem.scenario = scenario_names()[top.choice("scenario", scenario_names()).value_or(0)];
  top.read("seed", config.seed, 0);
  if (const auto files = top.strings("trials")) {
    for (const std::string& file : *files) {
      if (file.empty()) top.fail("trials", "trials names an empty file, expected paths");
      config.trial_files.push_back(beside(config.path, file));
    }
    if (scenario_form(config.problem.scenario).objective) {
      top.fail("trials", "scenario objective has no trials; its program has what it needs");
    }
  }
}

// [robot].  False when there is no robot to go on with.
bool read_robot_section(TomlSection& top, const Problem* known, Config& config) {
  const ScenarioForm& form = scenario_form(config.problem.scenario);
  auto section = top.section("robot");
  if (!section && !form.robot) return true;
  if (!section) {
    top.errors().add(top.table().source().begin,
                     "scenario ground needs a robot:\n  [robot]\n  file = \"robot.toml\"");
    return false;
  }
  std::string file;
  section->read("file", file);
  section->finish();
  const std::string path = beside(config.path, file);
  const auto text = known ? Result<std::string>(known->robot_file) : read_text_file(path);
  const Status set = text ? config.problem.set_robot(*text, path) : Status(text.error());
  if (!set) {
    top.errors().add(section->table().source().begin, set.error().message);
    return false;
  }
  config.robot_path = path;
  return true;
}

void read_runs_section(TomlSection& top, Config& config) {
  auto runs = top.section("runs");
  if (!runs) return;
  for (const std::string& folder : runs->strings("folders").value_or(std::vector<std::string>())) {
    config.trial_files.push_back(beside(config.path, folder));
  }
  if (auto horizons = runs->numbers("horizons", 0, 1e5, "s")) config.windows.horizons_s = *horizons;
  runs->read("run_in", config.windows.run_in_s, 0, 1e3, "s");
  runs->finish();
}

// What only scenarios have in which something moves.
void read_motions(TomlSection& top, const ScenarioForm& form, Config& config) {
  Problem& problem = config.problem;
  read_effects(top, problem.table(), problem.values);
  read_pieces(top, form, problem.pieces, problem.commands);
  if (!form.pieces) read_commands(top, problem.commands);
  read_fitness(top, problem.fitness);
  read_spread(top, problem.spread);
  read_simulate(top, problem.commands, config.simulate);
  top.find("validation");  // as [[stages]]
}

void search_everything(const ParameterTable& table, std::vector<Gene>& genes) {
  for (std::size_t row = 0; row < table.size(); ++row) {
    genes.push_back({row, table[row].lower, table[row].upper, table[row].scale});
  }
}

// `known`: none, or whose robot and program these are.
Result<Config> parse(std::string_view text, const std::string& path, const ProgramStarter& start,
                     const Problem* known);

}  // namespace

Result<std::string> start_no_program(const ExternalCommand& command) {
  return Error{"would have to start '" + command.argv[0] + "', and here nothing is started"};
}

Result<std::string> start_program(const ExternalCommand& command) {
  return ExternalSimulator(command, monotonic_seconds).introduce();
}

Result<Config> parse_config(std::string_view text, const std::string& path,
                            const ProgramStarter& start) {
  return parse(text, path, start, nullptr);
}

Result<Config> parse_config_of(const Problem& known, std::string_view text,
                               const std::string& path) {
  return parse(text, path, start_no_program, &known);
}

Result<Config> read_config(const std::string& path) {
  const std::string file = shipped_file(path);
  ASSIGN_OR_RETURN(auto text, read_text_file(file));
  return parse_config(text, file, start_program);
}

namespace {

Result<Config> parse(std::string_view text, const std::string& path, const ProgramStarter& start,
                     const Problem* known) {
  auto parsed = parse_toml(text, path);
  if (!parsed.ok()) {
    const TextFormat format = sniff_format(text);
    const bool recognised = format != TextFormat::kToml && format != TextFormat::kUnknown;
    return recognised ? wrong_format(path, format, "a config") : parsed.error();
  }
  if (parsed->contains("model")) {
    return text_error(path, {}, "a model", "a config",
                      "predict and simulate take models; evolving needs a config");
  }
  if (parsed->contains("drive")) {
    return text_error(
        path, {}, "a robot's file", "a config",
        "gapfarm robot " + path + " --out COPY --config CONFIG --runs FOLDER writes one");
  }
  Config config;
  config.path = path;
  config.text = text;
  TomlErrors errors(path);
  TomlSection top(*parsed, "", errors);
  read_top(top, config);
  Problem& problem = config.problem;
  const ScenarioForm& form = scenario_form(problem.scenario);
  if ((form.robot || form.other_robot) && !read_robot_section(top, known, config))
    return errors.error();
  if (form.windows) read_runs_section(top, config);
  if (form.program && !read_external_section(top, config.path, start, known, problem)) {
    return errors.error();
  }
  const ParameterTable& table = problem.table();
  problem.values = problem.tracked ? problem.tracked->values() : table.nominal();
  problem.commands = default_commands(problem.scenario);
  read_parameters(top, table, problem.values);
  read_genes(top, table, problem.genes);
  if (form.objective) {
    if (problem.genes.empty()) search_everything(table, problem.genes);
  } else {
    read_motions(top, form, config);
  }
  read_evolution(top, config.evolution);
  read_optimiser(top, config.evolution.optimiser);
  const bool front = config.evolution.optimiser.kind == OptimiserKind::kNsga2;
  if (front == problem.fitness.objectives.empty()) {
    errors.add(parsed->source().begin,
               front ? "optimiser nsga2 needs several objectives: [fitness] objectives = "
                       "[\"position\", \"heading\"], or minimise and maximise in [objective]"
                     : "several objectives need [optimiser] kind = \"nsga2\"; the other kinds "
                       "search one fitness");
  }
  read_farm(top, config.farm);
  top.find("stages");  // read by those who look at them: read_stages()
  top.finish();
  if (!errors.empty()) return errors.error();
  return config;
}

}  // namespace

Status check_moves(const std::string& scenario, const std::string& path) {
  if (!scenario_form(scenario).objective) return {};
  return Error{path +
               ": scenario objective has values and a number, and no trials or motions, which this "
               "command is about; it can be checked, evolved, resumed, compared and replayed, and "
               "shown by status, serve and report"};
}

Status check_evolvable(const Config& config) {
  if (config.problem.genes.empty()) {
    return Error{config.path +
                 ": there are no genes to evolve; add a section such as\n  [genes]\n"
                 "  friction = [0.1, 1.5]"};
  }
  return {};
}

}  // namespace gapfarm
