// [genes]: which rows are searched, and where.
#include <algorithm>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/config/sections.h"
#include "common/trials/text/csv.h"

namespace gapfarm {

std::optional<double> row_value(const toml::node& node, const ParameterTable& table,
                                std::size_t row, TomlErrors& errors) {
  const Parameter& parameter = table[row];
  std::optional<double> value;
  std::string expected = parameter.unit == "-" ? "a number" : "a number in " + parameter.unit;
  switch (parameter.kind) {
    case ParameterKind::kReal:
      if (node.is_number()) value = node.value<double>();
      break;
    case ParameterKind::kInteger:
      expected = "an integer";
      if (node.is_integer()) value = static_cast<double>(node.as_integer()->get());
      break;
    case ParameterKind::kBoolean:
      expected = "true or false";
      if (node.is_boolean()) value = node.as_boolean()->get() ? 1 : 0;
      break;
    case ParameterKind::kChoice:
      return errors.choice(parameter.key, node, parameter.choices);
  }
  if (!value) {
    errors.wrong_type(parameter.key, node, expected);
    return {};
  }
  const Status accepted = table.check(row, *value);
  if (accepted.ok()) return value;
  errors.add(node, accepted.error().message);
  return {};
}

void read_parameters(TomlSection& section, const ParameterTable& table, ParameterValues& values) {
  for (std::size_t row = 0; row < table.size(); ++row) {
    if (!table[row].effect.empty()) {
      // Known, so that it is not "unknown"; but it has its own place.
      if (section.table().contains(table[row].key)) {
        section.find(table[row].key);
        section.fail(table[row].key, table[row].key +
                                         " belongs to an effect; write it in [effects." +
                                         table[row].effect + "]");
      }
      continue;
    }
    const toml::node* node = section.find(table[row].key);
    if (node == nullptr) continue;
    values[row] = row_value(*node, table, row, section.errors()).value_or(values[row]);
  }
}

void for_effect_rows(TomlSection& top, const ParameterTable& table, const EffectRowReader& read) {
  top.within("effects", [&](TomlSection& section) {
    for (std::size_t e = 0; e < table.effects().size(); ++e) {
      const Effect& effect = table.effects()[e];
      section.within(effect.name, [&](TomlSection& own) {
        for (std::size_t i = 0; i < effect.parameters.size(); ++i) {
          read(own, effect.parameters[i].key, table.effect_row(e) + i);
        }
      });
    }
  });
}

void read_effects(TomlSection& top, const ParameterTable& table, ParameterValues& values) {
  for_effect_rows(top, table, [&](TomlSection& own, const std::string& key, std::size_t row) {
    if (const toml::node* node = own.find(key)) {
      values[row] = row_value(*node, table, row, own.errors()).value_or(values[row]);
    }
  });
}

namespace {

const std::vector<std::string> kScaleNames = {"linear", "log"};
constexpr const char* kForms =
    "[lower, upper], {range = [lower, upper], scale = \"log\"} or \"table\"";

// Reads the genes of one scenario.
class GeneReader {
 public:
  GeneReader(const ParameterTable& table, TomlErrors& errors, std::vector<Gene>& genes)
      : table_(table), errors_(errors), genes_(genes) {}

  void read_table(const toml::table& section, const std::string& prefix = "") {
    for (const auto& [key, node] : section) {
      const std::string word = prefix + std::string(key.str());
      if (const auto row = table_.find(word)) {
        read_gene(*row, node);
      } else if (const auto effect = effect_of(word)) {
        read_effect(*effect, node);
      } else if (node.is_table() && begins_a_row(word)) {
        read_table(*node.as_table(), word + ".");
      } else {
        unknown(key, word, mapped(table_.rows(), &Parameter::key));
      }
    }
  }

 private:
  bool begins_a_row(const std::string& word) const {
    return std::any_of(table_.rows().begin(), table_.rows().end(), [&](const Parameter& row) {
      return row.effect.empty() && row.key.rfind(word + ".", 0) == 0;
    });
  }

  std::optional<std::size_t> effect_of(const std::string& name) const {
    for (std::size_t e = 0; e < table_.effects().size(); ++e) {
      if (table_.effects()[e].name == name) return e;
    }
    return {};
  }

  void unknown(const toml::key& key, const std::string& word,
               const std::vector<std::string>& known) {
    errors_.add(key.source().begin, "unknown gene " + quoted_word(word) + suggestion(word, known));
  }

  // [genes.motor_asymmetry] ratio = [...]
  void read_effect(std::size_t e, const toml::node& node) {
    const Effect& effect = table_.effects()[e];
    const toml::table* section = node.as_table();
    if (section == nullptr) {
      errors_.wrong_type(effect.name, node,
                         "the section [genes." + effect.name + "] with its parameters");
      return;
    }
    std::vector<std::string> known = mapped(effect.parameters, &Parameter::key);
    for (const auto& [key, value] : *section) {
      const std::string word(key.str());
      const auto row = table_.find(effect.name + "." + word);
      if (row) {
        read_gene(*row, value);
      } else {
        unknown(key, word, known);
      }
    }
  }

  void read_gene(std::size_t row, const toml::node& node) {
    const Parameter& parameter = table_[row];
    const bool twice = contains(genes_, row, &Gene::row);
    if (twice) {
      errors_.add(node, "gene " + parameter.key + " is written twice; remove one");
      return;
    }
    Gene gene{row, parameter.lower, parameter.upper, parameter.scale};
    if (node.is_string() && node.as_string()->get() == "table") {
      genes_.push_back(gene);
    } else if (node.is_array()) {
      if (read_range(*node.as_array(), gene)) genes_.push_back(gene);
    } else if (const toml::table* table = node.as_table()) {
      TomlSection section(*table, "[genes." + parameter.key + "]", errors_);
      if (read_spelled_out(section, gene)) genes_.push_back(gene);
    } else {
      errors_.wrong_type("gene " + parameter.key, node, kForms);
    }
  }

  bool read_spelled_out(TomlSection& section, Gene& gene) {
    section.read("scale", gene.scale, kScaleNames);
    const toml::node* range = section.find("range");
    section.finish();
    if (range == nullptr) return check_scale(section.table(), gene);
    if (const toml::array* array = range->as_array()) return read_range(*array, gene);
    if (range->is_string() && range->as_string()->get() == "table") {
      return check_scale(*range, gene);
    }
    errors_.wrong_type("range", *range, "[lower, upper]");
    return false;
  }

  bool read_range(const toml::array& range, Gene& gene) {
    const Parameter& parameter = table_[gene.row];
    std::vector<double> ends;
    for (const toml::node& element : range) {
      const auto value = row_value(element, table_, gene.row, errors_);
      if (!value) return false;
      ends.push_back(*value);
    }
    if (parameter.kind == ParameterKind::kChoice) return read_choices(range, std::move(ends), gene);
    if (ends.size() != 2) {
      errors_.add(range, "gene " + parameter.key + " has a range of " +
                             std::to_string(ends.size()) + " values, expected " + kForms);
      return false;
    }
    gene.lower = ends[0];
    gene.upper = ends[1];
    if (gene.lower >= gene.upper) {
      errors_.add(range, "gene " + parameter.key + " has the empty range [" +
                             table_.format(gene.row, gene.lower) + ", " +
                             table_.format(gene.row, gene.upper) + "], expected lower < upper" +
                             (gene.lower > gene.upper ? "; exchange the two"
                                                      : "; fix a value in [parameters] instead"));
      return false;
    }
    return check_scale(range, gene);
  }

  // A gene holds a run of neighbouring choices.
  bool read_choices(const toml::array& range, std::vector<double> ends, Gene& gene) {
    std::sort(ends.begin(), ends.end());
    bool run = ends.size() >= 2;
    for (std::size_t i = 1; i < ends.size(); ++i) run = run && ends[i] == ends[i - 1] + 1;
    if (!run) {
      std::string known = joined(table_[gene.row].choices);
      errors_.add(range,
                  "gene " + table_[gene.row].key +
                      " needs two or more different choices that are neighbours in: " + known);
      return false;
    }
    gene.lower = ends.front();
    gene.upper = ends.back();
    return true;
  }

  bool check_scale(const toml::node& node, const Gene& gene) {
    if (gene.scale == ParameterScale::kLinear || gene.lower > 0) return true;
    errors_.add(node, "gene " + table_[gene.row].key + " begins at " +
                          table_.format(gene.row, gene.lower) +
                          ", which a log scale cannot hold; begin above 0 or write {range = "
                          "[...], scale = \"linear\"}");
    return false;
  }

  const ParameterTable& table_;
  TomlErrors& errors_;
  std::vector<Gene>& genes_;
};

}  // namespace

void read_genes(TomlSection& top, const ParameterTable& table, std::vector<Gene>& genes) {
  auto section = top.section("genes");
  if (!section) return;
  GeneReader(table, section->errors(), genes).read_table(section->table());
  // The order in the file must not matter: the genome's order is part of every result.
  std::ranges::sort(genes, {}, &Gene::row);
}

}  // namespace gapfarm
