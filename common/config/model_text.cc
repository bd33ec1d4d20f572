// Writing models.

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/config/model.h"
#include "common/config/sections.h"
#include "common/problem/message_parts.h"
#include "common/trials/files.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

// Numbers of integer rows, words of choices, true and false.
std::string row_text(const ParameterTable& table, std::size_t row, double value) {
  if (table[row].kind == ParameterKind::kReal) return toml_number(value);
  const std::string text = table.text_of(row, value);
  return table[row].kind == ParameterKind::kChoice ? toml_string(text) : text;
}

void write_entry(const Model& model, std::size_t row, const std::string& key, TomlLines& out) {
  const Parameter& parameter = model.table()[row];
  std::string text = key + " = { value = " + row_text(model.table(), row, model.values[row]);
  if (parameter.kind == ParameterKind::kReal) text += ", unit = " + toml_string(parameter.unit);
  if (row < model.intervals.size() && model.intervals[row]) {
    text += ", lo = " + toml_number(model.intervals[row]->lower) +
            ", hi = " + toml_number(model.intervals[row]->upper);
  }
  out.raw(text + " }" + (parameter.summary.empty() ? "" : "  # " + parameter.summary) + "\n");
}

bool is_noise(const Parameter& row) { return row.key.find("_noise_") != std::string::npos; }

void write_base(const Model& model, const char* name, bool noise, TomlLines& out) {
  const bool objective = scenario_form(model.scenario).objective;  // whose rows are its own
  if (objective && noise) return;
  const ParameterTable& table = model.table();
  out.within(name, [&](TomlLines& section) {
    for (std::size_t row = 0; row < table.size(); ++row) {
      if (!table[row].effect.empty() || (!objective && is_noise(table[row])) != noise) continue;
      write_entry(model, row, table[row].key, section);
    }
  });
}

// Effects with a parameter or an interval of their own; the others do nothing.
void write_effects(const Model& model, TomlLines& out) {
  const ParameterTable& table = model.table();
  for (std::size_t e = 0; e < table.effects().size(); ++e) {
    const Effect& effect = table.effects()[e];
    bool own = false;
    TomlLines entries;
    for (std::size_t i = 0; i < effect.parameters.size(); ++i) {
      const std::size_t row = table.effect_row(e) + i;
      own = own || model.values[row] != table[row].nominal ||
            (row < model.intervals.size() && model.intervals[row]);
      write_entry(model, row, effect.parameters[i].key, entries);
    }
    if (own) {
      out.raw("\n[effects." + effect.name + "]  # " + effect.summary + "\n" + entries.text());
    }
  }
}

// The file as it is, line by line.
void write_robot(const std::string& file, TomlLines& out) {
  if (file.empty()) return;
  if (file.find("'''") != std::string::npos) return out.read("robot", file);
  out.raw("robot = '''\n" + file + "'''\n");
}

void write_directions(const FitnessSettings& fitness, TomlLines& out) {
  using Names = std::vector<std::string>;
  if (fitness.objectives.empty()) {
    return out.read("direction",
                    std::string(higher_is_better(fitness.kind) ? "maximise" : "minimise"));
  }
  for (const bool maximise : {false, true}) {
    Names names;
    for (const SearchedObjective& objective : fitness.objectives) {
      if (objective.maximise == maximise) names.push_back(objective.name);
    }
    if (!names.empty()) out.read(maximise ? "maximise" : "minimise", names);
  }
}

void write_program(const Model& model, TomlLines& out) {
  if (!model.external) return;
  out.within(model.scenario, [&](TomlLines& section) {
    const ExternalCommand& command = model.external->command;
    section.read("program", command.argv);
    section.read("folder", command.folder);
    section.read("answer_limit", command.answer_limit_s);
    section.read("introduction", model.external->introduction);
    if (!scenario_form(model.scenario).objective) return;
    write_directions(model.fitness, section);
    if (model.spread.kind == SpreadKind::kSampled) section.read("noisy", true);
  });
}

void write_commands(const Model& model, TomlLines& out) {
  for (const Piece& piece : model.pieces) {
    out.raw("\n[[pieces]]\n");
    out.read("name", piece.name);
    const auto corners = mapped(piece.corners, [](const Eigen::Vector2d& c) {
      return std::vector<double>{c[0], c[1]};
    });
    out.raw("corners = " + toml_rows(corners) + "\n");
    piece_rows(out, piece);
  }
  const ScenarioForm& form = scenario_form(model.scenario);
  if (form.pieces || form.robot) return;
  for (const CommandSpec& command : model.commands) {
    out.within("commands." + command.name, [&](TomlLines& own) { command_rows(own, command); });
  }
}

void write_score(const Model& model, TomlLines& out) {
  const FitnessSettings& fitness = model.fitness;
  const bool value = is_value(fitness.kind);
  if (value && !model.score) return;
  out.within("fitness", [&](TomlLines& section) {
    if (!value) section.read("kind", fitness.kind, fitness_names());
    section.read("value", model.score);
    if (!value) fitness_rows(section, fitness);
  });
  if (value) return;
  out.within("spread", [&](TomlLines& section) {
    section.read("kind", model.spread.kind, spread_names());
    if (model.spread.kind != SpreadKind::kSampled) return;
    section.read("replicates", model.spread.replicates, 2, 100000);
  });
}

}  // namespace

std::string format_model(const Model& model) {
  const bool objective = scenario_form(model.scenario).objective;
  TomlLines out;
  out.raw(std::string("# A gapfarm model") +
          (objective ? "" : ": 'gapfarm predict' and 'gapfarm simulate' take it") +
          ".\nmodel = 1\n");
  out.read("scenario", model.scenario);
  out.read("kind", model.kind);
  write_robot(model.robot_file, out);
  write_program(model, out);
  write_base(model, "parameters", false, out);
  write_base(model, "noise", true, out);
  write_effects(model, out);
  if (model.frame_x_m != 0 || model.frame_y_m != 0) {
    out.raw("\n# The effects' places count from this point of the world, in metres.");
    frame_section(out, model);
  }
  write_residual(model, out);
  write_commands(model, out);
  write_score(model, out);
  origin_sections(out, model);
  return out.text();
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
  RETURN_IF_ERROR(under(path, check_model(model)));
  return write_file_atomically(path, format_model(model));
}

}  // namespace gapfarm
