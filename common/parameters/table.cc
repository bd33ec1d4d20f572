#include "common/parameters/table.h"

#include <cassert>
#include <charconv>
#include <cmath>
#include <numbers>

#include "common/parameters/external.h"
#include "common/parameters/ground.h"
#include "common/parameters/push.h"
#include "common/parameters/racquetball.h"

namespace gapfarm {
namespace {

std::string number(double value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  return {text, end};
}

using enum ParameterKind;
using enum ParameterScale;

// In the order of enum Srv1.
std::vector<Parameter> srv1_rows() {
  return {
      {"robot", "-", kChoice, kLinear, 0, 1, 0, "robot model", {"treads", "wheels"}, ""},
      {"mass", "kg", kReal, kLinear, 0.1, 1.5, 0.35, "of the whole robot", {}, ""},
      {"contact_length",
       "m",
       kReal,
       kLinear,
       0.02,
       0.14,
       0.07,
       "front to rear contact of a tread",
       {},
       ""},
      {"track_gauge", "m", kReal, kLinear, 0.04, 0.16, 0.085, "left to right contact", {}, ""},
      {"friction", "-", kReal, kLog, 0.02, 2, 0.6, "of the floor along the treads", {}, ""},
      {"friction_ratio", "-", kReal, kLog, 0.3, 3, 1, "lateral over longitudinal friction", {}, ""},
      {"tread_creep",
       "-",
       kReal,
       kLinear,
       0,
       0.5,
       0,
       "slip over tread speed at 0.7 of full traction (robot = treads)",
       {},
       ""},
      {"mass_height",
       "m",
       kReal,
       kLinear,
       0.001,
       0.08,
       0.03,
       "centre of mass over the floor",
       {},
       ""},
      {"full_speed", "m/s", kReal, kLinear, 0.05, 0.8, 0.28, "of a tread at full duty", {}, ""},
      {"drive_noise_common",
       "-",
       kReal,
       kLinear,
       0,
       0.3,
       0.02,
       "per-trial standard deviation of both sides' speed, as a share of it",
       {},
       ""},
      {"drive_noise_side",
       "-",
       kReal,
       kLinear,
       0,
       0.3,
       0.02,
       "per-trial standard deviation of each side's speed, as a share of it",
       {},
       ""},
      {"pose_noise_position",
       "m",
       kReal,
       kLog,
       1e-5,
       0.1,
       0.002,
       "standard deviation of a measured x and y",
       {},
       ""},
      {"pose_noise_heading",
       "rad",
       kReal,
       kLog,
       1e-5,
       0.5,
       0.01,
       "standard deviation of a measured heading",
       {},
       ""},
      {"drive_noise_tail",
       "-",
       kReal,
       kLinear,
       0,
       1,
       0,
       "1 / degrees of freedom of the drives' noise (Student's t); 0: Gaussian",
       {},
       ""},
      {"pose_noise_tail",
       "-",
       kReal,
       kLinear,
       0,
       1,
       0,
       "1 / degrees of freedom of a measured pose's noise (Student's t); 0: Gaussian",
       {},
       ""},
      {"gravity", "m/s^2", kReal, kLinear, 1, 30, 9.81, "downward", {}, ""},
      {"step_rate", "Hz", kInteger, kLog, 30, 2000, 240, "physics steps a second", {}, ""},
      {"sub_steps", "-", kInteger, kLinear, 1, 10, 1, "physics steps within each of those", {}, ""},
      {"solver_iterations", "-", kInteger, kLinear, 1, 200, 10, "of the contact solver", {}, ""},
      {"restitution", "-", kReal, kLinear, 0, 1, 0, "of robot and floor", {}, ""},
      {"linear_damping", "-", kReal, kLinear, 0, 1, 0, "share of velocity lost a second", {}, ""},
      {"angular_damping", "-", kReal, kLinear, 0, 1, 0, "share of spin lost a second", {}, ""},
      {"wheel_shape",
       "-",
       kChoice,
       kLinear,
       0,
       3,
       0,
       "collision shape (robot = wheels)",
       {"sphere", "cylinder", "box", "hull"},
       ""},
      {"maximum_velocity",
       "rad/s",
       kReal,
       kLinear,
       1,
       100,
       40,
       "greatest spin of a wheel (robot = wheels)",
       {},
       ""},
      {"motor_torque",
       "N m",
       kReal,
       kLog,
       1e-4,
       5,
       0.05,
       "of each wheel's motor (robot = wheels)",
       {},
       ""},
  };
}

struct ScenarioTable {
  const char* scenario;
  const ParameterTable& (*table)();
};
constexpr ScenarioTable kScenarioTables[] = {{"srv1", srv1_table},
                                             {"push", push_table},
                                             {"racquetball", racquetball_table},
                                             {"ground", ground_table},
                                             {"external", external_table}};

Parameter effect_parameter(const Effect& effect, const EffectParameter& p) {
  return {effect.name + "." + p.key,
          p.unit,
          p.choices.empty() ? kReal : kChoice,
          kLinear,
          p.lower,
          p.upper,
          p.neutral,
          p.summary,
          p.choices,
          effect.name};
}

}  // namespace

ParameterTable::ParameterTable(std::vector<Parameter> base, std::span<const Effect> effects)
    : rows_(std::move(base)), effects_(effects) {
  for (const Effect& effect : effects) {
    effect_rows_.push_back(rows_.size());
    for (const EffectParameter& p : effect.parameters) rows_.push_back(effect_parameter(effect, p));
  }
}

std::optional<std::size_t> ParameterTable::find(std::string_view key) const {
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (rows_[i].key == key) return i;
  }
  return std::nullopt;
}

std::size_t ParameterTable::row(std::string_view key) const {
  const auto found = find(key);
  assert(found);
  return *found;
}

ParameterValues ParameterTable::nominal() const {
  ParameterValues values;
  for (const Parameter& row : rows_) values.push_back(row.nominal);
  return values;
}

bool ParameterTable::is_neutral(std::size_t e, const ParameterValues& values) const {
  for (std::size_t i = 0; i < effects_[e].strengths; ++i) {
    if (values[effect_rows_[e] + i] != effects_[e].parameters[i].neutral) return false;
  }
  return true;
}

Status ParameterTable::check(std::size_t row, double value) const {
  const Parameter& p = rows_[row];
  const bool whole = p.kind == kReal || value == std::floor(value);
  if (std::isfinite(value) && value >= p.lower && value <= p.upper && whole) return {};
  std::string text = p.key + " is " + number(value) + ", but it must be ";
  if (p.kind != kReal) text += "a whole number ";
  text += "between " + format(row, p.lower) + " and " + format(row, p.upper);
  return Error{text};
}

std::string ParameterTable::format(std::size_t row, double value) const {
  const Parameter& p = rows_[row];
  if (p.kind == kBoolean) return value != 0 ? "true" : "false";
  const auto index = static_cast<std::size_t>(value);
  if (p.kind == kChoice && value >= 0 && index < p.choices.size()) return p.choices[index];
  return number(value) + (p.unit == "-" ? "" : " " + p.unit);
}

const ParameterTable& srv1_table() {
  static const ParameterTable table(srv1_rows(), srv1_effects_and_seconds());
  return table;
}

std::span<const std::string> scenario_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const ScenarioTable& row : kScenarioTables) all.emplace_back(row.scenario);
    return all;
  }();
  return names;
}

Result<const ParameterTable*> parameter_table(std::string_view scenario) {
  std::string known;
  for (const ScenarioTable& row : kScenarioTables) {
    if (scenario == row.scenario) return &row.table();
    known += (known.empty() ? "" : ", ") + std::string(row.scenario);
  }
  return Error{"unknown scenario '" + std::string(scenario) + "'; known: " + known};
}

}  // namespace gapfarm
