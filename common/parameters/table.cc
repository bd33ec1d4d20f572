#include "common/parameters/table.h"

#include <algorithm>
#include <cassert>
#include <charconv>
#include <cmath>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/parameters/external.h"
#include "common/parameters/ground.h"
#include "common/parameters/rows.h"

namespace gapfarm {
namespace {

// Of one of the config's pieces.
Parameter own_shape_factor(int piece) {
  const std::string number = std::to_string(piece);
  return rows::real("shape_factor_" + number, "-", 0, 1, 0,
                    "the same of the config's piece " + number + "; 0: shape_factor");
}

Parameter own_pressure(int piece) {
  const std::string number = std::to_string(piece);
  return rows::real("pressure_" + number, "-", 0, 10, 0,
                    "the same of the config's piece " + number + "; 0: pressure");
}

std::vector<Parameter> push_rows() {
  using namespace rows;  // NOLINT: what follows is rows
#define ROW(name, row) row,
#define SETTING(name, member, row) row,
  return {
#include "common/parameters/push_rows.inc"
  };
}

}  // namespace

const ParameterTable& push_table() {
  static const ParameterTable table(push_rows(), push_effects());
  return table;
}

bool rests_on_its_face(const ParameterValues& values) {
  const std::size_t row = row_of(Push::kModel);
  return push_table()[row].choices[static_cast<std::size_t>(values[row])] == "distributed";
}

namespace {

std::vector<Parameter> racquetball_rows() {
  using namespace rows;  // NOLINT: what follows is rows
#define ROW(name, row) row,
#define SETTING(name, member, row) row,
  return {
#include "common/parameters/racquetball_rows.inc"
  };
}

}  // namespace

const ParameterTable& racquetball_table() {
  static const ParameterTable table(racquetball_rows(), {});
  return table;
}

namespace {

// The shortest text that reads back as `value`.
std::string number(double value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  return {text, end};
}

// More digits than any of these parameters is known to.
double rounded(double value) { return rounded_to_digits(value, 4); }

using enum ParameterKind;
using enum ParameterScale;

struct ScenarioTable {
  const char* scenario;
  const ParameterTable& (*table)();
};
constexpr ScenarioTable kScenarioTables[] = {{"srv1", srv1_table},
                                             {"push", push_table},
                                             {"racquetball", racquetball_table},
                                             {"ground", ground_table},
                                             {"external", external_table},
                                             {"external_runs", external_runs_table},
                                             {"objective", external_table}};

}  // namespace

ParameterTable::ParameterTable(std::vector<Parameter> base, std::span<const Effect> effects)
    : rows_(std::move(base)), effects_(effects) {
  for (const Effect& effect : effects) {
    effect_rows_.push_back(rows_.size());
    for (const Parameter& p : effect.parameters) {
      rows_.push_back(p);
      rows_.back().key = effect.name + "." + p.key;
      rows_.back().effect = effect.name;
    }
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

void ParameterTable::without_chance(ParameterValues* values) const {
  for (std::size_t e = 0; e < effects_.size(); ++e) {
    if (effects_[e].shows != EffectShows::kChance) continue;
    for (std::size_t i = 0; i < effects_[e].strengths; ++i) {
      (*values)[effect_rows_[e] + i] = effects_[e].parameters[i].nominal;
    }
  }
}

bool ParameterTable::is_neutral(std::size_t e, const ParameterValues& values) const {
  return std::ranges::all_of(indices(effects_[e].strengths), [&](std::size_t i) {
    return values[effect_rows_[e] + i] == effects_[e].parameters[i].nominal;
  });
}

Status ParameterTable::check(std::size_t row, double value) const {
  const Parameter& p = rows_[row];
  const bool whole = p.kind == kReal || value == std::floor(value);
  if (std::isfinite(value) && value >= p.lower && value <= p.upper && whole) return {};
  std::string text = p.key + " is " + number(value) + ", but it must be ";
  if (p.kind != kReal) text += "a whole number ";
  // In full where a rounded bound would hold what the bound refuses.
  const bool close = value >= rounded(p.lower) && value <= rounded(p.upper);
  const auto bound = [&](double at) { return close ? text_of(row, at) : format(row, at); };
  text += "between " + bound(p.lower) + " and " + bound(p.upper);
  if (close && p.unit != "-") text += " " + p.unit;
  return Error{text + (p.beyond.empty() ? "" : "; ") + p.beyond};
}

std::string ParameterTable::text_of(std::size_t row, double value) const {
  const Parameter& p = rows_[row];
  if (p.kind == kBoolean) return value != 0 ? "true" : "false";
  const auto index = static_cast<std::size_t>(value);
  if (p.kind == kChoice && value >= 0 && index < p.choices.size()) return p.choices[index];
  return number(value);
}

std::string ParameterTable::format(std::size_t row, double value) const {
  const Parameter& p = rows_[row];
  const bool unit = (p.kind == kReal || p.kind == kInteger) && p.unit != "-";
  return text_of(row, p.kind == kReal ? rounded(value) : value) + (unit ? " " + p.unit : "");
}

std::span<const std::string> scenario_names() {
  static const auto names =
      mapped(kScenarioTables, [](const ScenarioTable& row) { return std::string(row.scenario); });
  return names;
}

Result<const ParameterTable*> parameter_table(std::string_view scenario) {
  for (const ScenarioTable& row : kScenarioTables) {
    if (scenario == row.scenario) return &row.table();
  }
  return Error{"unknown scenario '" + std::string(scenario) +
               "'; known: " + joined(scenario_names())};
}

double decode_gene(const ParameterTable& table, const Gene& gene, double g) {
  g = std::clamp(g, 0.0, 1.0);
  if (table[gene.row].kind != ParameterKind::kReal) {
    const double count = gene.upper - gene.lower + 1;
    return gene.lower + std::min(std::floor(g * count), count - 1);
  }
  if (gene.scale == ParameterScale::kLog) {
    return std::clamp(gene.lower * std::pow(gene.upper / gene.lower, g), gene.lower, gene.upper);
  }
  return gene.lower + (gene.upper - gene.lower) * g;
}

double encode_gene(const ParameterTable& table, const Gene& gene, double value) {
  double g = 0;
  if (table[gene.row].kind != ParameterKind::kReal) {
    g = (value - gene.lower + 0.5) / (gene.upper - gene.lower + 1);
  } else if (gene.scale == ParameterScale::kLog) {
    g = std::log(value / gene.lower) / std::log(gene.upper / gene.lower);
  } else {
    g = (value - gene.lower) / (gene.upper - gene.lower);
  }
  return std::clamp(g, 0.0, 1.0);
}

void decode(const ParameterTable& table, const std::vector<Gene>& genes, const Genome& genome,
            ParameterValues& values) {
  assert(genes.size() == genome.size());
  for (std::size_t i = 0; i < genes.size(); ++i) {
    values[genes[i].row] = decode_gene(table, genes[i], genome[i]);
  }
}

}  // namespace gapfarm
