#include "master/cli/data/idle_genes.h"

#include <algorithm>

#include "common/random/stream.h"
#include "master/evolve/evolve.h"

namespace gapfarm {
namespace {

constexpr int kPoints = 3;

const std::vector<std::vector<ExternalCondition>>& when_of(const Problem& problem) {
  return problem.external->table.declaration().when;
}

// The config's own values, then draws.
Genome point_of(const Problem& problem, int point, std::uint64_t seed) {
  Stream stream({seed, Purpose::kStatistics, 5, static_cast<std::uint64_t>(point), 0});
  Genome genome;
  for (const Gene& gene : problem.genes) {
    const double drawn = stream.uniform();
    genome.push_back(point == 0 ? encode_gene(problem.table(), gene, problem.values[gene.row])
                                : drawn);
  }
  return genome;
}

// Of each gene whether moving it changes the score at a point; nothing where the point itself has
// none.
Result<std::vector<char>> moving(Farm& farm, const Config& config, const Problem& problem,
                                 const std::vector<std::size_t>& genes, int point,
                                 std::vector<char> known) {
  const std::string hash = farm.add_problem(to_proto(problem));
  const Genome base = point_of(problem, point, config.seed);
  std::vector<v1::Task> tasks = {evaluation_task({0, 0, base}, config.seed)};
  for (const std::size_t gene : genes) {
    Genome moved = base;
    moved[gene] = moved[gene] < 0.5 ? moved[gene] + 0.5 : moved[gene] - 0.5;
    tasks.push_back(evaluation_task({0, 0, moved}, config.seed));
  }
  ASSIGN_OR_RETURN(const auto results, farm.run(hash, tasks));
  const v1::TaskResult& there = results.front();
  const bool scored = there.outcome() == v1::OK;
  // Of several objectives the fitness is the first.
  const auto same = [](const v1::EvaluateResult& a, const v1::EvaluateResult& b) {
    return a.fitness() == b.fitness() && std::ranges::equal(a.objectives(), b.objectives());
  };
  for (std::size_t k = 0; k < genes.size(); ++k) {
    const v1::TaskResult& moved = results[k + 1];
    if (!scored || moved.outcome() != v1::OK || !same(moved.evaluate(), there.evaluate())) {
      known[genes[k]] = 1;
    }
  }
  return known;
}

// Those of `genes` that stay idle at all points.
Result<std::vector<std::size_t>> idle_of(Farm& farm, const Config& config, const Problem& problem,
                                         std::vector<std::size_t> genes) {
  std::vector<char> known(problem.genes.size(), 0);
  for (int point = 0; point < kPoints && !genes.empty(); ++point) {
    ASSIGN_OR_RETURN(known, moving(farm, config, problem, genes, point, known));
    std::erase_if(genes, [&](std::size_t gene) { return known[gene] != 0; });
  }
  return genes;
}

// Turns on the gene's effect by those of its values that do so alone and that no gene moves,
// halfway to the end that is farther from neutral; their names.
std::string turn_on(Problem* problem, std::size_t gene) {
  const ParameterTable& table = problem->table();
  const std::string& effect = table[problem->genes[gene].row].effect;
  std::string names;
  for (std::size_t e = 0; e < table.effects().size(); ++e) {
    if (table.effects()[e].name != effect) continue;
    const std::size_t first = table.effect_row(e);
    for (std::size_t row = first; row < first + table.effects()[e].parameters.size(); ++row) {
      const bool searched =
          std::ranges::any_of(problem->genes, [&](const Gene& g) { return g.row == row; });
      const Parameter& of = table[row];
      const double end = of.upper - of.nominal >= of.nominal - of.lower ? of.upper : of.lower;
      ParameterValues on = problem->values;
      on[row] = of.kind == ParameterKind::kReal ? (end + of.nominal) / 2 : end;
      if (searched || !table.is_neutral(e, problem->values) || table.is_neutral(e, on)) continue;
      problem->values = on;
      names += (names.empty() ? "" : ", ") + of.key;
    }
  }
  return names;
}

Result<std::string> remedy_of(Farm& farm, const Config& config, std::size_t gene) {
  Problem problem = config.problem;
  if (const std::string names = turn_on(&problem, gene); !names.empty()) {
    ASSIGN_OR_RETURN(const auto idle, idle_of(farm, config, problem, {gene}));
    return "its effect is off: make a gene of " + names + ", or set it off neutral" +
           (idle.empty() ? "" : "; where its other values stand, no trial meets it even then");
  }
  problem = config.problem;
  const FitnessKind kind = problem.fitness.kind;
  if (kind != FitnessKind::kLogScore && !is_value(kind) && !problem.log.trials.empty()) {
    problem.fitness.kind = FitnessKind::kLogScore;
    ASSIGN_OR_RETURN(const auto idle, idle_of(farm, config, problem, {gene}));
    if (idle.empty()) {
      return "fitness " + std::string(fitness_name(kind)) +
             " does not show it, log_score does: [fitness] kind = \"log_score\"";
    }
  }
  return std::string(is_value(kind)
                         ? "the program's answer does not depend on it: leave it out of [genes]"
                         : "nothing in this log depends on it: leave it out of [genes], or drive "
                           "what does");
}

}  // namespace

Result<std::vector<IdleGene>> idle_genes(Farm& farm, const Config& config) {
  const Problem& problem = config.problem;
  std::vector<std::size_t> genes;
  for (std::size_t k = 0; k < problem.genes.size(); ++k) {
    const std::size_t row = problem.genes[k].row;
    const bool sometimes =
        problem.external && row < when_of(problem).size() && !when_of(problem)[row].empty();
    if (!sometimes) genes.push_back(k);
  }
  ASSIGN_OR_RETURN(const auto idle, idle_of(farm, config, problem, genes));
  std::vector<IdleGene> found;
  for (const std::size_t gene : idle) {
    ASSIGN_OR_RETURN(const std::string remedy, remedy_of(farm, config, gene));
    found.push_back({problem.table()[problem.genes[gene].row].key, remedy});
  }
  return found;
}

}  // namespace gapfarm
