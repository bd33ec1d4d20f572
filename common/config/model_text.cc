// Writing models.
#include <cmath>
#include <limits>

#include "common/base/text.h"
#include "common/config/model.h"
#include "common/config/sections.h"
#include "common/trials/files.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

// A TOML float: integers would lose the sign of -0.
std::string toml_number(double value) {
  std::string text = format_double(value);
  if (std::isfinite(value) && text.find_first_of(".e") == text.npos) text += ".0";
  return text;
}

// TOML integers end at 2^63 - 1; seeds do not.
std::string toml_count(std::uint64_t value) {
  const std::string text = std::to_string(value);
  return value > std::numeric_limits<std::int64_t>::max() ? toml_string(text) : text;
}

// Numbers of integer rows, words of choices, true and false.
std::string row_text(const Parameter& row, double value) {
  if (row.kind == ParameterKind::kReal) return toml_number(value);
  if (row.kind == ParameterKind::kBoolean) return value != 0 ? "true" : "false";
  if (row.kind == ParameterKind::kChoice)
    return toml_string(row.choices[static_cast<std::size_t>(value)]);
  return format_double(value);
}

std::string entry(const Model& model, std::size_t row, const std::string& key) {
  const Parameter& parameter = model.table()[row];
  std::string text = key + " = { value = " + row_text(parameter, model.values[row]);
  if (parameter.kind == ParameterKind::kReal) text += ", unit = " + toml_string(parameter.unit);
  if (row < model.intervals.size() && model.intervals[row]) {
    text += ", lo = " + toml_number(model.intervals[row]->lower) +
            ", hi = " + toml_number(model.intervals[row]->upper);
  }
  return text + " }" + (parameter.summary.empty() ? "" : "  # " + parameter.summary) + "\n";
}

bool is_noise(const Parameter& row) { return row.key.find("_noise_") != std::string::npos; }

std::string base_section(const Model& model, const char* name, bool noise) {
  const bool objective = scenario_form(model.scenario).objective;  // whose rows are its own
  if (objective && noise) return "";
  std::string text = std::string("\n[") + name + "]\n";
  const ParameterTable& table = model.table();
  for (std::size_t row = 0; row < table.size(); ++row) {
    if (!table[row].effect.empty() || (!objective && is_noise(table[row])) != noise) continue;
    text += entry(model, row, table[row].key);
  }
  return text;
}

// Effects with a parameter or an interval of their own; the others do nothing.
std::string effect_sections(const Model& model) {
  const ParameterTable& table = model.table();
  std::string text;
  for (std::size_t e = 0; e < table.effects().size(); ++e) {
    const Effect& effect = table.effects()[e];
    bool own = false;
    std::string entries;
    for (std::size_t i = 0; i < effect.parameters.size(); ++i) {
      const std::size_t row = table.effect_row(e) + i;
      own = own || model.values[row] != table[row].nominal ||
            (row < model.intervals.size() && model.intervals[row]);
      entries += entry(model, row, effect.parameters[i].key);
    }
    if (own) text += "\n[effects." + effect.name + "]  # " + effect.summary + "\n" + entries;
  }
  return text;
}

// The file as it is, line by line.
std::string robot_text(const Model& model) {
  if (model.robot_file.empty()) return "";
  if (model.robot_file.find("'''") != std::string::npos) {
    return "robot = " + toml_string(model.robot_file) + "\n";
  }
  return "robot = '''\n" + model.robot_file + "'''\n";
}

std::string directions(const FitnessSettings& fitness) {
  if (fitness.objectives.empty()) {
    return std::string("\ndirection = ") +
           (higher_is_better(fitness.kind) ? "\"maximise\"" : "\"minimise\"");
  }
  std::string senses[2];
  for (const SearchedObjective& objective : fitness.objectives) {
    std::string& names = senses[objective.maximise ? 1 : 0];
    names += (names.empty() ? "" : ", ") + toml_string(objective.name);
  }
  std::string text;
  for (const int i : {0, 1}) {
    if (senses[i].empty()) continue;
    text += (i == 0 ? "\nminimise = [" : "\nmaximise = [") + senses[i] + "]";
  }
  return text;
}

std::string program_section(const Model& model) {
  if (!model.external) return "";
  const ExternalCommand& command = model.external->command;
  std::string argv = joined(command.argv, ", ", toml_string);
  const std::string objective = directions(model.fitness) +
                                (model.spread.kind == SpreadKind::kSampled ? "\nnoisy = true" : "");
  return "\n[" + model.scenario + "]\nprogram = [" + argv +
         "]\nfolder = " + toml_string(command.folder) +
         "\nanswer_limit = " + toml_number(command.answer_limit_s) +
         "\nintroduction = " + toml_string(model.external->introduction) +
         (scenario_form(model.scenario).objective ? objective : "") + "\n";
}

std::string piece_sections(const Model& model) {
  std::string text;
  for (const Piece& piece : model.pieces) {
    std::string corners;
    for (const Eigen::Vector2d& c : piece.corners) {
      corners +=
          (corners.empty() ? "[" : ", [") + toml_number(c[0]) + ", " + toml_number(c[1]) + "]";
    }
    text += "\n[[pieces]]\nname = " + toml_string(piece.name) + "\ncorners = [" + corners +
            "]\nthickness = " + toml_number(piece.thickness_m) +
            "\nmass = " + toml_number(piece.mass_kg) +
            "\nsymmetry = " + std::to_string(piece.symmetry) + "\n";
  }
  return text;
}

std::string command_sections(const Model& model) {
  const ScenarioForm& form = scenario_form(model.scenario);
  if (form.pieces) return piece_sections(model);
  if (form.robot) return "";
  std::string text;
  for (const CommandSpec& command : model.commands) {
    text += "\n[commands." + command.name + "]\nleft = " + toml_number(command.left) +
            "\nright = " + toml_number(command.right) +
            "\nduration = " + toml_number(command.duration_s) + "\n";
  }
  return text;
}

std::string score_sections(const Model& model) {
  const FitnessSettings& fitness = model.fitness;
  if (is_value(fitness.kind)) {
    return model.score ? "\n[fitness]\nvalue = " + toml_number(*model.score) + "\n" : "";
  }
  std::string text = std::string("\n[fitness]\nkind = ") + toml_string(fitness_name(fitness.kind));
  if (model.score) text += "\nvalue = " + toml_number(*model.score);
  text += "\noutlier_share = " + toml_number(fitness.outlier_share) +
          "\nroll_penalty = " + toml_number(fitness.roll_penalty) +
          "\npitch_penalty = " + toml_number(fitness.pitch_penalty) +
          "\nheave_penalty = " + toml_number(fitness.heave_penalty) +
          "\nrest_penalty = " + toml_number(fitness.rest_penalty) +
          "\nrest_limit = " + toml_number(fitness.rest_limit_s) + "\n";
  text += "\n[spread]\nkind = " +
          toml_string(spread_names()[static_cast<std::size_t>(model.spread.kind)]) + "\n";
  if (model.spread.kind == SpreadKind::kSampled) {
    text += "replicates = " + std::to_string(model.spread.replicates) + "\n";
  }
  return text;
}

// Only where it is not the world's own origin.
std::string frame_section(const Model& model) {
  if (model.frame_x_m == 0 && model.frame_y_m == 0) return "";
  return "\n# The effects' places count from this point of the world, in metres.\n[frame]\nx = " +
         toml_number(model.frame_x_m) + "\ny = " + toml_number(model.frame_y_m) + "\n";
}

std::string origin_sections(const Model& model) {
  std::string files = joined(model.data.files, ", ", toml_string);
  return "\n[data]\nhash = " + toml_string(model.data.hash) +
         "\ntrials = " + std::to_string(model.data.trials) + "\nfiles = [" + files + "]\n" +
         "\n[program]\nversion = " + toml_string(model.version) +
         "\nfingerprint = " + toml_string(model.fingerprint) + "\n" +
         "\n[run]\npath = " + toml_string(model.origin.run) +
         "\nseed = " + toml_count(model.origin.seed) +
         "\ngeneration = " + std::to_string(model.origin.generation) +
         "\nevaluations = " + std::to_string(model.origin.evaluations) + "\n";
}

}  // namespace

std::string format_model(const Model& model) {
  const bool objective = scenario_form(model.scenario).objective;
  return std::string("# A gapfarm model") +
         (objective ? "" : ": 'gapfarm predict' and 'gapfarm simulate' take it") +
         ".\nmodel = 1\nscenario = " + toml_string(model.scenario) +
         "\nkind = " + toml_string(model.kind) + "\n" + robot_text(model) + program_section(model) +
         base_section(model, "parameters", false) + base_section(model, "noise", true) +
         effect_sections(model) + frame_section(model) + residual_section(model) +
         command_sections(model) + score_sections(model) + origin_sections(model);
}

Status check_model(const Model& model) {
  if (auto known = parameter_table(model.scenario); !known.ok()) return known.error();
  const ParameterTable& table = model.table();
  if (model.values.size() != table.size()) {
    return Error{"the model has " + std::to_string(model.values.size()) + " values, expected " +
                 std::to_string(table.size())};
  }
  for (std::size_t row = 0; row < table.size(); ++row) {
    RETURN_IF_ERROR(table.check(row, model.values[row]));
  }
  return check_residual_of(model);
}

Status write_model(const Model& model, const std::string& path) {
  if (Status s = check_model(model); !s.ok()) return Error{path + ": " + s.error().message};
  return write_file_atomically(path, format_model(model));
}

}  // namespace gapfarm
