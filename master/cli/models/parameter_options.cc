#include "master/cli/models/parameter_options.h"

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
  const auto [key, text] = cut_at(setting, '=');
  const std::vector<std::string> known = mapped(table.rows(), &Parameter::key);
  const auto row = table.find(key);
  if (!row || !text) {
    return Error{option + " " + setting + ": expected PARAMETER=VALUE" +
                 (row ? "" : ", and there is no parameter '" + key + "'" + suggestion(key, known))};
  }
  const auto value = value_of_text(table[*row], *text);
  if (!value) {
    const std::vector<std::string>& choices = table[*row].choices;
    return Error{option + " " + setting + ": '" + *text + "' is not a number" +
                 (choices.empty() ? "" : suggestion(*text, choices))};
  }
  RETURN_IF_ERROR(under(option + " " + setting, table.check(*row, *value)));
  problem.values[*row] = *value;
  return {};
}

Status apply_genes(const std::vector<std::string>& genes, Problem& problem,
                   const std::string& option) {
  const ParameterTable& table = problem.table();
  problem.genes.clear();
  for (const std::string& text : genes) {
    const auto [key, range] = cut_at(text, '=');
    const auto row = table.find(key);
    if (!row) {
      return Error{option + " " + text + ": there is no parameter '" + key + "'" +
                   suggestion(key, mapped(table.rows(), &Parameter::key))};
    }
    Gene gene{*row, table[*row].lower, table[*row].upper, table[*row].scale};
    if (range) {
      const auto ends = mapped(parts_of(*range, ','), parse_double);
      if (ends.size() != 2 || !ends[0] || !ends[1]) {
        return Error{option + " " + text + ": expected KEY or KEY=LOWER,UPPER"};
      }
      gene.lower = *ends[0];
      gene.upper = *ends[1];
    }
    for (const double end : {gene.lower, gene.upper}) {
      RETURN_IF_ERROR(under(option + " " + text, table.check(*row, end)));
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
