#include "common/config/config.h"

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "common/base/build_info.h"
#include "common/base/clock.h"
#include "common/base/ranges.h"
#include "common/config/sections.h"
#include "common/config/toml_section.h"
#include "common/external/simulator.h"
#include "common/trials/files.h"
#include "common/trials/format.h"
#include "common/trials/text/csv.h"

namespace gapfarm {

Result<toml::table> parse_wanted(std::string_view text, const std::string& path,
                                 const char* wanted) {
  auto parsed = parse_toml(text, path);
  if (parsed) return parsed;
  const TextFormat format = sniff_format(text);
  const bool recognised = format != TextFormat::kToml && format != TextFormat::kUnknown;
  return recognised ? wrong_format(path, format, wanted) : parsed.error();
}

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

void read_windows(TomlSection& runs, Config& config) {
  for (const std::string& folder : runs.strings("folders").value_or(std::vector<std::string>())) {
    config.trial_files.push_back(beside(config.path, folder));
  }
  if (auto horizons = runs.numbers("horizons", 0, 1e5, "s")) config.windows.horizons_s = *horizons;
  runs.read("run_in", config.windows.run_in_s, 0, 1e3, "s");
}

// What only scenarios have in which something moves.
void read_motions(TomlSection& top, const ScenarioForm& form, Config& config) {
  Problem& problem = config.problem;
  read_effects(top, problem.table(), problem.values);
  read_pieces(top, form, problem.pieces, problem.commands);
  if (!form.pieces) read_commands(top, problem.commands);
  top.within("fitness", read_fitness, problem.fitness);
  read_spread(top, problem.spread);
  top.within("simulate", read_simulate, problem.commands, config.simulate);
  top.find("validation");  // as [[stages]]
}

void search_everything(const ParameterTable& table, std::vector<Gene>& genes) {
  for (std::size_t row = 0; row < table.size(); ++row) {
    genes.push_back({row, table[row].lower, table[row].upper, table[row].scale});
  }
}

}  // namespace

Result<Config> parse_config(std::string_view text, const std::string& path,
                            const ProgramStarter& start, const Problem* known) {
  ASSIGN_OR_RETURN(const auto parsed, parse_wanted(text, path, "a config"));
  if (parsed.contains("model")) {
    return text_error(path, {}, "a model", "a config",
                      "predict and simulate take models; evolving needs a config");
  }
  if (parsed.contains("drive")) {
    return text_error(
        path, {}, "a robot's file", "a config",
        "gapfarm robot " + path + " --out COPY --config CONFIG --runs FOLDER writes one");
  }
  Config config;
  config.path = path;
  config.text = text;
  TomlErrors errors(path);
  TomlSection top(parsed, "", errors);
  read_top(top, config);
  Problem& problem = config.problem;
  const ScenarioForm& form = scenario_form(problem.scenario);
  if ((form.robot || form.other_robot) && !read_robot_section(top, known, config))
    return errors.error();
  if (form.windows) top.within("runs", read_windows, config);
  if (form.program && !read_external_section(top, config.path, start, known, problem)) {
    return errors.error();
  }
  const ParameterTable& table = problem.table();
  problem.values = problem.tracked ? problem.tracked->values() : table.nominal();
  problem.commands = default_commands(problem.scenario);
  top.within("parameters", read_parameters, table, problem.values);
  read_genes(top, table, problem.genes);
  if (form.objective) {
    if (problem.genes.empty()) search_everything(table, problem.genes);
  } else {
    read_motions(top, form, config);
  }
  top.within("evolution", read_evolution, config.evolution);
  read_optimiser(top, config.evolution.optimiser);
  const bool front = config.evolution.optimiser.kind == OptimiserKind::kNsga2;
  if (front == problem.fitness.objectives.empty()) {
    errors.add(parsed.source().begin,
               front ? "optimiser nsga2 needs several objectives: [fitness] objectives = "
                       "[\"position\", \"heading\"], or minimise and maximise in [objective]"
                     : "several objectives need [optimiser] kind = \"nsga2\"; the other kinds "
                       "search one fitness");
  }
  top.within("farm", read_farm, config.farm);
  top.find("stages");  // read by those who look at them: read_stages()
  top.finish();
  if (!errors.empty()) return errors.error();
  return config;
}

Result<std::string> start_no_program(const ExternalCommand& command) {
  return Error{"would have to start '" + command.argv[0] + "', and here nothing is started"};
}

Result<std::string> start_program(const ExternalCommand& command) {
  return ExternalSimulator(command, monotonic_seconds).introduce();
}

Result<Config> read_config(const std::string& path) {
  const std::string file = shipped_file(path);
  ASSIGN_OR_RETURN(auto text, read_text_file(file));
  return parse_config(text, file, start_program);
}

Status check_moves(const std::string& scenario, const std::string& path) {
  return check_can(scenario, kPredicts | kSimulates | kTraces, path);
}

Status check_evolvable(const Config& config) {
  if (config.problem.genes.empty()) {
    return Error{config.path +
                 ": there are no genes to evolve; add a section such as\n  [genes]\n"
                 "  friction = [0.1, 1.5]"};
  }
  return {};
}

namespace {

// Puts `changes` into `base`; sections are merged, everything else is replaced.
void merge(toml::table& base, const toml::table& changes) {
  for (const auto& [key, node] : changes) {
    toml::table* below = base.contains(key) ? base.get(key)->as_table() : nullptr;
    if (below != nullptr && node.is_table()) {
      merge(*below, *node.as_table());
    } else {
      base.insert_or_assign(key, node);
    }
  }
}

Result<Variant> read_variant(const std::string& name, const toml::table& changes, toml::table base,
                             const std::string& base_path, const std::string& path) {
  merge(base, changes);
  std::ostringstream text;
  text << base;
  Result<Config> config = parse_config(text.str(), base_path, start_program);
  // Places would be those of the merged text, which nobody has seen.
  if (!config) {
    return Error{path + ": variant \"" + name +
                 "\", merged with its config: " + config.error().message};
  }
  return Variant{name, *std::move(config)};
}

}  // namespace

bool is_comparison(std::string_view text) {
  const auto parsed = parse_toml(text, "");
  return parsed.ok() && parsed->contains("compare");
}

Result<Comparison> read_comparison(const std::string& path) {
  ASSIGN_OR_RETURN(const auto parsed, parse_file(path, parse_toml));
  TomlErrors errors(path);
  TomlSection top(parsed, "", errors);
  Comparison comparison;
  std::string config;
  top.within("compare", [&](TomlSection& section) {
    section.read("config", config);
    section.read("seeds", comparison.seeds, 1, 10000);
    section.read("evaluations", comparison.evaluations, 1);
    section.read("target_fitness", comparison.target_fitness, -kUnbounded, kUnbounded);
  });
  const auto variants = top.section("variants");
  top.finish();
  if (!errors.empty()) return errors.error();
  if (config.empty()) return Error{path + ": [compare] names no config; add config = \"FILE\""};
  if (!variants || variants->table().empty()) {
    return Error{path + ": there are no variants; add sections such as [variants.small]"};
  }
  const std::string base_path = beside(path, config);
  ASSIGN_OR_RETURN(const auto base, parse_file(base_path, parse_toml));
  for (const auto& [name, section] : in_file_order(variants->table())) {
    if (!section->is_table()) return Error{path + ": variant \"" + name + "\" is no section"};
    ASSIGN_OR_RETURN(auto variant, read_variant(name, *section->as_table(), base, base_path, path));
    comparison.variants.push_back(std::move(variant));
  }
  return comparison;
}

namespace {

class StageReader {
 public:
  StageReader(const Config& config, TomlErrors& errors) : config_(config), errors_(errors) {
    for (const Gene& gene : config.problem.genes) {
      names_.push_back(config.problem.table()[gene.row].key);
    }
  }

  void read(std::vector<TomlSection> sections, const toml::node& node, std::vector<Stage>& stages) {
    std::vector<bool> used(names_.size());
    for (TomlSection& section : sections) {
      stages.push_back(read_stage(section, &section == &sections.back()));
      for (const std::size_t gene : stages.back().genes) used[gene] = true;
    }
    if (misread_ || sections.empty()) return;
    for (std::size_t gene = 0; gene < used.size(); ++gene) {
      if (!used[gene]) errors_.add(node, "gene " + names_[gene] + " is in no stage; add it to one");
    }
  }

 private:
  Stage read_stage(TomlSection& section, bool last) {
    const toml::table& table = section.table();
    Stage stage;
    const auto genes = section.choices("genes", names_);
    if (genes) {
      stage.genes = *genes;
      std::ranges::sort(stage.genes);
    }
    section.read("evaluations", stage.evaluations, 1);
    section.finish();
    if (genes ? genes->empty() : section.find("genes") == nullptr) {
      errors_.add(table, "a stage searches nothing; give it genes = [...]");
    }
    misread_ = misread_ || stage.genes.empty();
    if (!last && stage.evaluations == 0) {
      errors_.add(table, "a stage before the last has no end; give it evaluations = N");
    }
    return stage;
  }

  const Config& config_;
  TomlErrors& errors_;
  std::vector<std::string> names_;
  bool misread_ = false;  // genes of a stage
};

}  // namespace

Result<StagePlan> read_stages(const Config& config) {
  ASSIGN_OR_RETURN(const auto parsed, parse_toml(config.text, config.path));
  TomlErrors errors(config.path);
  TomlSection top(parsed, "", errors);
  StagePlan plan;
  if (const toml::node* node = top.find("stages")) {
    const std::string missing = "stages is no list, expected sections [[stages]]";
    StageReader(config, errors).read(top.sections("stages", missing), *node, plan.stages);
    if (!config.problem.fitness.objectives.empty()) {
      errors.add(*node,
                 "stages go on from one best, and a search of several objectives has a "
                 "front; leave [[stages]] out");
    }
  }
  top.within("validation", [&](TomlSection& section) {
    const auto files = section.strings(config.problem.windows() ? "folders" : "trials");
    for (const std::string& file : files.value_or(std::vector<std::string>())) {
      plan.validation_files.push_back(beside(config.path, file));
    }
  });
  if (!errors.empty()) return errors.error();
  return plan;
}

}  // namespace gapfarm
