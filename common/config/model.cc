// Reading models.
#include "common/config/model.h"

#include "common/base/build_info.h"
#include "common/config/sections.h"
#include "common/problem/message_parts.h"
#include "common/trials/files.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

// key = { value, unit, lo, hi }, or the bare value.
void read_entry(TomlSection& section, const std::string& key, std::size_t row, Model& model) {
  const toml::node* node = section.find(key);
  if (node == nullptr) return;
  const Parameter& parameter = model.table()[row];
  const toml::table* table = node->as_table();
  if (table == nullptr) {
    model.values[row] =
        row_value(*node, model.table(), row, section.errors()).value_or(model.values[row]);
    return;
  }
  TomlSection entry(*table, "[" + key + "]", section.errors());
  const toml::node* value = entry.find("value");
  if (value == nullptr) {
    section.errors().add(*node, parameter.key + " has no value, expected {value = ...}");
  } else {
    model.values[row] =
        row_value(*value, model.table(), row, section.errors()).value_or(model.values[row]);
  }
  std::string unit = parameter.unit;
  entry.read("unit", unit);
  if (unit != parameter.unit) {
    entry.fail("unit", "unit of " + parameter.key + " is " + quoted_word(unit) + ", expected " +
                           quoted_word(parameter.unit) + "; convert the value");
  }
  std::optional<double> lower, upper;
  entry.read("lo", lower, -kUnbounded, kUnbounded);
  entry.read("hi", upper, -kUnbounded, kUnbounded);
  if (lower.has_value() != upper.has_value()) {
    section.errors().add(*node, parameter.key + " has one end of an interval, expected lo and hi");
  } else if (lower && *lower > *upper) {
    entry.fail("lo", "the interval of " + parameter.key + " has lo above hi");
  } else if (lower) {
    model.intervals.resize(model.values.size());
    model.intervals[row] = Interval{*lower, *upper};
  }
  entry.finish();
}

// A hand that moves a row between [parameters] and [noise] does no harm.
void read_base(TomlSection& top, const char* name, Model& model) {
  top.within(name, [&](TomlSection& section) {
    for (std::size_t row = 0; row < model.table().size(); ++row) {
      const Parameter& parameter = model.table()[row];
      if (parameter.effect.empty()) read_entry(section, parameter.key, row, model);
    }
  });
}

void read_model_fitness(TomlSection& top, Model& model) {
  top.within("fitness", [&](TomlSection& section) {
    // A failed run's best may be infinitely bad; that is no reason not to read its model.
    if (const toml::node* value = section.find("value")) {
      model.score = value->is_number() ? value->value<double>() : std::nullopt;
      if (!model.score) section.errors().wrong_type("value", *value, "a number");
    }
    read_fitness(section, model.fitness);
  });
}

// What format_model() wrote; nothing is started.
Status read_model_program(TomlSection& top, Model& model) {
  ExternalCommand command;
  std::string introduction;
  const bool objective = scenario_form(model.scenario).objective;
  top.within(model.scenario, [&](TomlSection& section) {
    section.read("program", command.argv);
    section.read("folder", command.folder);
    section.read("answer_limit", command.answer_limit_s, 1e-3, 1e6, "s");
    section.read("introduction", introduction);
    if (objective) read_objective(section, model.fitness, model.spread);
  });
  ASSIGN_OR_RETURN(model.external,
                   make_external_program(std::move(command), std::move(introduction), objective));
  model.values = model.table().nominal();
  return {};
}

}  // namespace

Result<Model> nominal_model(std::string_view scenario) {
  ASSIGN_OR_RETURN(const auto* table, parameter_table(scenario));
  Model model;
  model.scenario = scenario;
  model.version = build_info().version;
  model.fingerprint = build_info().fingerprint;
  model.values = table->nominal();
  model.commands = default_commands(scenario);
  return model;
}

Model model_of_problem(const Problem& problem, ParameterValues values) {
  Model model;
  static_cast<Simulated&>(model) = problem;
  model.version = build_info().version;
  model.fingerprint = build_info().fingerprint;
  model.values = std::move(values);
  model.residual = {};
  return model;
}

Problem problem_of(const Model& model) {
  Problem problem;
  static_cast<Simulated&>(problem) = model;
  return problem;
}

bool is_model(std::string_view text) {
  const auto parsed = parse_toml(text, "");
  return parsed.ok() && parsed->contains("model");
}

Result<Model> parse_model(std::string_view text, const std::string& path) {
  ASSIGN_OR_RETURN(const auto parsed, parse_wanted(text, path, "a model"));
  if (!parsed.contains("model")) {
    return text_error(path, {}, "no key 'model'", "a model",
                      "a config is evolved into one by 'gapfarm evolve'");
  }
  TomlErrors errors(path);
  TomlSection top(parsed, "", errors);
  std::uint64_t version = 1;
  top.read("model", version, 0);
  if (version != 1) {
    top.fail("model",
             "model is of another format version, expected 1; use the program that "
             "wrote it");
  }
  const std::string scenario =
      scenario_names()[top.choice("scenario", scenario_names()).value_or(0)];
  Model model = *nominal_model(scenario);
  model.version.clear();
  model.fingerprint.clear();
  top.read("kind", model.kind);
  const ScenarioForm& form = scenario_form(scenario);
  if (form.robot || (form.other_robot && top.find("robot") != nullptr)) {
    std::string robot;
    top.read("robot", robot);
    RETURN_IF_ERROR(model.set_robot(robot, path + ": robot"));
    model.values = model.table().nominal();  // effects that the file omits are neutral
  }
  if (form.program) {
    RETURN_IF_ERROR(under(path, read_model_program(top, model)));
  }
  read_base(top, "parameters", model);
  read_base(top, "noise", model);
  for_effect_rows(top, model.table(), [&](auto& own, const std::string& key, std::size_t row) {
    read_entry(own, key, row, model);
  });
  read_pieces(top, form, model.pieces, model.commands);
  if (!form.pieces) read_commands(top, model.commands);
  read_model_fitness(top, model);
  read_spread(top, model.spread);
  frame_section(top, model);
  read_residual(top, model);
  origin_sections(top, model);
  top.finish();
  if (!errors.empty()) return errors.error();
  return model;
}

Result<Model> read_model(const std::string& path) { return parse_file(path, parse_model); }

}  // namespace gapfarm
