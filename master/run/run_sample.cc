#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/json/json.h"
#include "common/math/rank_tests.h"
#include "common/math/statistics.h"
#include "common/trials/text/csv.h"
#include "master/report/html.h"
#include "master/run/run_page.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMostEvaluated = 1000;
constexpr std::size_t kMostElite = 30;
constexpr std::size_t kMostFront = 100;  // of its lines over all genes

// Columns of numbers, one each of the outputs.
std::vector<std::vector<double>> ranks_of(const std::vector<const StoredIndividual*>& members,
                                          std::size_t objectives) {
  std::vector<std::vector<double>> columns(std::max<std::size_t>(1, objectives));
  for (std::size_t m = 0; m < columns.size(); ++m) {
    columns[m] = mean_ranks(mapped(members, [&](const StoredIndividual* one) {
      return objectives > 0 ? one->objectives[m].second : *one->fitness;
    }));
  }
  return columns;
}

// Of an objective over the members that have it.
std::pair<double, double> limits_of(const std::vector<StoredIndividual>& members, std::size_t m) {
  std::pair limits{std::numeric_limits<double>::infinity(),
                   -std::numeric_limits<double>::infinity()};
  for (const StoredIndividual& one : members) {
    if (one.objectives.size() <= m) continue;
    limits.first = std::min(limits.first, one.objectives[m].second);
    limits.second = std::max(limits.second, one.objectives[m].second);
  }
  return limits;
}

// Several objectives come before the genes; says how many.
std::size_t add_objective_axes(const Problem& problem, const std::vector<StoredIndividual>& last,
                               RunElite* elite) {
  const auto& objectives = problem.fitness.objectives;
  for (std::size_t m = 0; m < objectives.size(); ++m) {
    const auto [lower, upper] = limits_of(last, m);
    elite->axes.push_back({objectives[m].name, "", number_text(lower, 4), number_text(upper, 4)});
  }
  return objectives.size();
}

}  // namespace

// Searched by its logarithm, a gene's share of the range is that of the logarithm.
RunElite run_elite(const Problem& problem, const std::vector<StoredIndividual>& last) {
  RunElite elite;
  const ParameterTable& table = problem.table();
  const std::size_t objectives = add_objective_axes(problem, last, &elite);
  const auto value = [&](const Gene& gene, double share) {
    const Parameter& p = table[gene.row];
    const double v = decode_gene(table, gene, share);
    return p.choices.empty() ? number_text(v, 4) : p.choices[static_cast<std::size_t>(v)];
  };
  for (const Gene& gene : problem.genes) {
    const Parameter& p = table[gene.row];
    elite.axes.push_back({p.key, p.unit, value(gene, 0), value(gene, 1)});
  }
  for (const StoredIndividual& one : last) {
    if (elite.lines.size() == (objectives > 0 ? kMostFront : kMostElite)) break;
    if (one.objectives.size() != objectives) continue;
    if (one.outcome != "OK" || one.genome.size() != problem.genes.size()) continue;
    RunElite::Line& line = elite.lines.emplace_back();
    line.birth_id = one.birth_id;
    line.fitness = one.fitness;
    for (std::size_t m = 0; m < objectives; ++m) {
      const auto [lower, upper] = limits_of(last, m);
      const double v = one.objectives[m].second;
      line.shares.push_back(upper > lower ? (v - lower) / (upper - lower) : 0.5);
      line.values.push_back(number_text(v, 5));
    }
    for (std::size_t g = 0; g < one.genome.size(); ++g) {
      line.shares.push_back(std::clamp(one.genome[g], 0.0, 1.0));
      line.values.push_back(value(problem.genes[g], line.shares.back()));
    }
  }
  return elite;
}

Result<std::string> history_csv(const RunReader& reader) {
  ASSIGN_OR_RETURN(const auto generations, reader.generations());
  std::map<std::uint64_t, std::vector<std::string>> rows;  // by birth
  std::vector<std::string> columns;
  double wall_s = 0;
  for (const StoredGeneration& generation : generations) {
    wall_s += generation.wall_s;
    ASSIGN_OR_RETURN(const auto members, reader.individuals(generation.generation));
    for (const StoredIndividual& one : members) {
      if (rows.contains(one.birth_id)) continue;
      std::vector<std::string> names = {"birth_id", "generation", "evaluations", "wall_s",
                                        "outcome",  "fitness",    "scores",      "operators"};
      std::vector<std::string>& row = rows[one.birth_id];
      row = {std::to_string(one.birth_id),
             std::to_string(generation.generation),
             std::to_string(generation.evaluations),
             fmt::format("{}", wall_s),
             one.outcome,
             one.fitness ? fmt::format("{}", *one.fitness) : "",
             std::to_string(one.scores),
             one.operators};
      const auto values = parse_json(one.values);
      for (const auto& [key, value] : values.items()) {
        names.push_back(key);
        row.push_back(value.is_string() ? value.get<std::string>() : json_text(value));
      }
      for (const auto& [name, value] : one.objectives) {  // whoever failed has none
        names.push_back("objective." + name);
        row.push_back(fmt::format("{}", value));
      }
      if (names.size() > columns.size()) columns = std::move(names);
    }
  }
  std::string text;
  const auto add = [&](const std::vector<std::string>& row) {
    for (std::size_t k = 0; k < columns.size(); ++k) {
      text += (k > 0 ? "," : "") + (k < row.size() ? csv_field(row[k]) : "");
    }
    text += "\n";
  };
  add(columns);
  for (const auto& [birth_id, row] : rows) add(row);
  return text;
}

RunSample run_sample(const Problem& problem, const std::vector<StoredIndividual>& members) {
  const auto& objectives = problem.fitness.objectives;
  RunSample sample;
  for (const SearchedObjective& objective : objectives) sample.outputs.push_back(objective.name);
  if (objectives.empty()) sample.outputs.emplace_back(fitness_name(problem.fitness.kind));
  std::vector<const StoredIndividual*> whole;
  for (const StoredIndividual& one : members) {
    const bool complete = one.fitness && one.genome.size() == problem.genes.size() &&
                          one.objectives.size() == objectives.size();
    if (complete) whole.push_back(&one);
  }
  const auto ranks = ranks_of(whole, objectives.size());
  for (std::size_t g = 0; g < problem.genes.size(); ++g) {
    const Gene& gene = problem.genes[g];
    const Parameter& p = problem.table()[gene.row];
    RunSample::GeneShare& share = sample.genes.emplace_back(RunSample::GeneShare{
        p.key, p.unit, gene.lower, gene.upper, gene.scale == ParameterScale::kLog, {}});
    const auto values = mapped(whole, [&](const auto* one) { return one->genome[g]; });
    if (whole.size() < kLeastForImportance) continue;
    share.importance =
        mapped(ranks, [&](const auto& output) { return first_order_index(values, output); });
  }
  const std::size_t each = whole.size() / kMostEvaluated + 1;
  for (std::size_t i = 0; i < whole.size(); i += each) sample.evaluated.push_back(*whole[i]);
  return sample;
}

}  // namespace gapfarm
