// The sections of a config, one function each.  Internal to common/config.
#pragma once

#include "common/config/config.h"
#include "common/config/model.h"
#include "common/config/settings.h"
#include "common/config/toml_section.h"

namespace gapfarm {

// The file as TOML; what it is where that is known and not TOML.
Result<toml::table> parse_wanted(std::string_view text, const std::string& path,
                                 const char* wanted);

// [external] or [objective].  False when there is no program to go on with.
bool read_external_section(TomlSection& top, const std::string& config_path,
                           const ProgramStarter& start, const Problem* known, Problem& problem);

// direction and noisy of [objective], in configs and models.
void read_objective(TomlSection& section, FitnessSettings& fitness, SpreadSettings& spread);

// Each reads its section into the settings and reports what is wrong.
void read_parameters(TomlSection& section, const ParameterTable& table, ParameterValues& values);
void read_evolution(TomlSection& section, EvolutionSettings& evolution);
void read_farm(TomlSection& section, FarmSettings& farm);
void read_simulate(TomlSection& section, const std::vector<CommandSpec>& commands,
                   SimulateSettings& simulate);

// Each reads its section of `top` (when it is there) in the same way.
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
// What configs and models hold of these, once: a TomlSection reads it, TomlLines write it.
template <class Rows, class Command>
void command_rows(Rows& rows, Command& command) {
  rows.read("left", command.left, -1, 1, "(duty)");
  rows.read("right", command.right, -1, 1, "(duty)");
  rows.read("duration", command.duration_s, 0, 60, "s");
}

template <class Rows, class OnePiece>
void piece_rows(Rows& rows, OnePiece& piece) {
  rows.read("thickness", piece.thickness_m, 1e-4, 0.5, "m");
  rows.read("mass", piece.mass_kg, 1e-4, 100, "kg");
  rows.read("symmetry", piece.symmetry, 1, 16);
}

template <class Rows, class Fitness>
void fitness_rows(Rows& rows, Fitness& fitness) {
  rows.read("outlier_share", fitness.outlier_share, 0, kMostOutliers);
  rows.read("roll_penalty", fitness.roll_penalty, 0, kUnbounded, "per rad");
  rows.read("pitch_penalty", fitness.pitch_penalty, 0, kUnbounded, "per rad");
  rows.read("heave_penalty", fitness.heave_penalty, 0, kUnbounded, "per m");
  rows.read("rest_penalty", fitness.rest_penalty, 0, kUnbounded, "per s");
  rows.read("rest_limit", fitness.rest_limit_s, 0, 60, "s");
}

template <class Rows, class Of>
void frame_section(Rows& top, Of& model) {
  constexpr double kFarthest_m = 10'000;  // as poses of a log
  top.within("frame", [&](auto& frame) {
    frame.read("x", model.frame_x_m, -kFarthest_m, kFarthest_m, "m");
    frame.read("y", model.frame_y_m, -kFarthest_m, kFarthest_m, "m");
  });
}

template <class Rows, class Of>
void origin_sections(Rows& top, Of& model) {
  top.within("data", [&](auto& data) {
    data.read("hash", model.data.hash);
    data.read("trials", model.data.trials, 0);
    data.read("files", model.data.files);
  });
  top.within("program", [&](auto& program) {
    program.read("version", model.version);
    program.read("fingerprint", model.fingerprint);
  });
  top.within("run", [&](auto& run) {
    run.read("path", model.origin.run);
    run.read("seed", model.origin.seed, 0);
    run.read("generation", model.origin.generation, 0);
    run.read("evaluations", model.origin.evaluations, 0);
  });
}

// In a model a value stands beside it.
void read_fitness(TomlSection& section, FitnessSettings& fitness);
void read_spread(TomlSection& top, SpreadSettings& spread);
void read_optimiser(TomlSection& top, OptimiserSettings& optimiser);

// The value of a row as TOML writes it: a number, a boolean or a choice's word.  None when it is
// not one that the row accepts; the error is reported.
std::optional<double> row_value(const toml::node& node, const ParameterTable& table,
                                std::size_t row, TomlErrors& errors);

// Words of the enums, in their order.
const std::vector<std::string>& fitness_names();
const std::vector<std::string>& spread_names();
const std::vector<std::string>& optimiser_names();

}  // namespace gapfarm
