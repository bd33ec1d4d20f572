// [parameters] and [effects]: values of table rows.
#include <algorithm>

#include "common/base/suggest.h"
#include "common/config/sections.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

std::string expected_value(const Parameter& row) {
  if (row.kind == ParameterKind::kBoolean) return "true or false";
  if (row.kind == ParameterKind::kInteger) return "an integer";
  if (row.kind == ParameterKind::kReal) {
    return row.unit == "-" ? "a number" : "a number in " + row.unit;
  }
  std::string list;
  for (const std::string& word : row.choices) list += (list.empty() ? "\"" : ", \"") + word + "\"";
  return "one of " + list;
}

}  // namespace

std::optional<double> row_value(const toml::node& node, const ParameterTable& table,
                                std::size_t row, TomlErrors& errors) {
  const Parameter& parameter = table[row];
  std::optional<double> value;
  switch (parameter.kind) {
    case ParameterKind::kReal:
      if (node.is_number()) value = node.value<double>();
      break;
    case ParameterKind::kInteger:
      if (node.is_integer()) value = static_cast<double>(node.as_integer()->get());
      break;
    case ParameterKind::kBoolean:
      if (node.is_boolean()) value = node.as_boolean()->get() ? 1 : 0;
      break;
    case ParameterKind::kChoice:
      if (const auto* word = node.as_string()) {
        const auto& choices = parameter.choices;
        const auto found = std::find(choices.begin(), choices.end(), word->get());
        if (found == choices.end()) {
          errors.add(node, "unknown " + parameter.key + " " + quoted_word(word->get()) +
                               suggestion(word->get(), choices));
          return {};
        }
        value = static_cast<double>(found - choices.begin());
      }
      break;
  }
  if (!value) {
    errors.add(node, parameter.key + " is " + toml_type_name(node) + ", expected " +
                         expected_value(parameter));
    return {};
  }
  const Status accepted = table.check(row, *value);
  if (accepted.ok()) return value;
  errors.add(node, accepted.error().message);
  return {};
}

void read_parameters(TomlSection& top, const ParameterTable& table, ParameterValues& values) {
  auto section = top.section("parameters");
  if (!section) return;
  for (std::size_t row = 0; row < table.size(); ++row) {
    if (!table[row].effect.empty()) {
      // Known, so that it is not "unknown"; but it has its own place.
      if (section->table().contains(table[row].key)) {
        section->find(table[row].key);
        section->fail(table[row].key, table[row].key +
                                          " belongs to an effect; write it in [effects." +
                                          table[row].effect + "]");
      }
      continue;
    }
    const toml::node* node = section->find(table[row].key);
    if (node == nullptr) continue;
    values[row] = row_value(*node, table, row, section->errors()).value_or(values[row]);
  }
  section->finish();
}

void read_effects(TomlSection& top, const ParameterTable& table, ParameterValues& values) {
  auto section = top.section("effects");
  if (!section) return;
  for (std::size_t e = 0; e < table.effects().size(); ++e) {
    const Effect& effect = table.effects()[e];
    auto own = section->section(effect.name);
    if (!own) continue;
    for (std::size_t i = 0; i < effect.parameters.size(); ++i) {
      const std::size_t row = table.effect_row(e) + i;
      const toml::node* node = own->find(effect.parameters[i].key);
      if (node == nullptr) continue;
      values[row] = row_value(*node, table, row, own->errors()).value_or(values[row]);
    }
    own->finish();
  }
  section->finish();
}

}  // namespace gapfarm
