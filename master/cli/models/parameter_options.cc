#include "master/cli/models/parameter_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/trials/text/csv.h"

namespace gapfarm {

std::optional<double> value_of_text(const Parameter& row, const std::string& text) {
  const auto choice = std::ranges::find(row.choices, text);
  if (choice != row.choices.end()) return static_cast<double>(choice - row.choices.begin());
  if (text == "true" || text == "True") return 1;
  if (text == "false" || text == "False") return 0;
  return parse_double(text);
}

Status apply_setting(const std::string& setting, Problem& problem, const std::string& option) {
  const ParameterTable& table = problem.table();
  const std::size_t equals = setting.find('=');
  const std::string key = setting.substr(0, equals);
  const std::vector<std::string> known = mapped(table.rows(), &Parameter::key);
  const auto row = table.find(key);
  if (!row || equals == std::string::npos) {
    return Error{option + " " + setting + ": expected PARAMETER=VALUE" +
                 (row ? "" : ", and there is no parameter '" + key + "'" + suggestion(key, known))};
  }
  const std::string text = setting.substr(equals + 1);
  const auto value = value_of_text(table[*row], text);
  if (!value) {
    const std::vector<std::string>& choices = table[*row].choices;
    return Error{option + " " + setting + ": '" + text + "' is not a number" +
                 (choices.empty() ? "" : suggestion(text, choices))};
  }
  if (Status s = table.check(*row, *value); !s)
    return Error{option + " " + setting + ": " + s.error().message};
  problem.values[*row] = *value;
  return {};
}

Status apply_genes(const std::vector<std::string>& genes, Problem& problem,
                   const std::string& option) {
  const ParameterTable& table = problem.table();
  problem.genes.clear();
  for (const std::string& text : genes) {
    const std::size_t equals = text.find('=');
    const std::string key = text.substr(0, equals);
    const auto row = table.find(key);
    if (!row) {
      return Error{option + " " + text + ": there is no parameter '" + key + "'" +
                   suggestion(key, mapped(table.rows(), &Parameter::key))};
    }
    Gene gene{*row, table[*row].lower, table[*row].upper, table[*row].scale};
    if (equals != std::string::npos) {
      const std::size_t comma = text.find(',', equals);
      const bool read =
          comma != std::string::npos &&
          CLI::detail::lexical_cast(text.substr(equals + 1, comma - equals - 1), gene.lower) &&
          CLI::detail::lexical_cast(text.substr(comma + 1), gene.upper);
      if (!read) return Error{option + " " + text + ": expected KEY or KEY=LOWER,UPPER"};
    }
    for (const double end : {gene.lower, gene.upper}) {
      if (Status s = table.check(*row, end); !s) {
        return Error{option + " " + text + ": " + s.error().message};
      }
    }
    const bool twice = contains(problem.genes, *row, &Gene::row);
    if (twice || gene.lower >= gene.upper) {
      return Error{option + " " + text + ": " + (twice ? "is there twice" : "has an empty range")};
    }
    if (gene.lower <= 0) gene.scale = ParameterScale::kLinear;
    problem.genes.push_back(gene);
  }
  std::ranges::sort(problem.genes, {}, &Gene::row);
  return {};
}

}  // namespace gapfarm
