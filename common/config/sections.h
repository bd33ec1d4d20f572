// The sections of a config, one function each.  Internal to common/config.
#pragma once

#include "common/config/config.h"
#include "common/config/model.h"
#include "common/config/settings.h"
#include "common/config/toml_section.h"

namespace gapfarm {

// [external] or [objective].  False when there is no program to go on with.
bool read_external_section(TomlSection& top, const std::string& config_path,
                           const ProgramStarter& start, const Problem* known, Problem& problem);

// direction and noisy of [objective], in configs and models.
void read_objective(TomlSection& section, FitnessSettings& fitness, SpreadSettings& spread);

// Each reads its section of `top` (when it is there) into the settings and reports what is wrong.
void read_parameters(TomlSection& top, const ParameterTable& table, ParameterValues& values);
void read_effects(TomlSection& top, const ParameterTable& table, ParameterValues& values);
// What [effects] may hold: a key in the section of its effect, and its row.
using EffectRowReader =
    std::function<void(TomlSection& own, const std::string& key, std::size_t row)>;
void for_effect_rows(TomlSection& top, const ParameterTable& table, const EffectRowReader& read);
void read_genes(TomlSection& top, const ParameterTable& table, std::vector<Gene>& genes);
void read_commands(TomlSection& top, std::vector<CommandSpec>& commands);
// [[pieces]], when the scenario's form has them; they become its commands.
void read_pieces(TomlSection& top, const ScenarioForm& form, std::vector<Piece>& pieces,
                 std::vector<CommandSpec>& commands);
void read_fitness(TomlSection& top, FitnessSettings& fitness);
// What of it a model has, too; `section` is not finished.
void read_fitness_of(TomlSection& section, FitnessSettings& fitness);
void read_spread(TomlSection& top, SpreadSettings& spread);
void read_evolution(TomlSection& top, EvolutionSettings& evolution);
void read_optimiser(TomlSection& top, OptimiserSettings& optimiser);
void read_farm(TomlSection& top, FarmSettings& farm);
void read_simulate(TomlSection& top, const std::vector<CommandSpec>& commands,
                   SimulateSettings& simulate);

// [residual] of a model, and its text; empty where there is none.
void read_residual(TomlSection& top, Model& model);
std::string residual_section(const Model& model);
Status check_residual_of(const Model& model);

// The value of a row as TOML writes it: a number, a boolean or a choice's word.  None when it is
// not one that the row accepts; the error is reported.
std::optional<double> row_value(const toml::node& node, const ParameterTable& table,
                                std::size_t row, TomlErrors& errors);

// Words of the enums, in their order.
const std::vector<std::string>& fitness_names();
const std::vector<std::string>& spread_names();
const std::vector<std::string>& optimiser_names();

}  // namespace gapfarm
