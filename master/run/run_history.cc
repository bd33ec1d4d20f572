#include "master/run/run_history.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "common/base/try.h"
#include "master/report/html.h"
#include "master/run/run_farm_history.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMostColumns = 48;    // of a density
constexpr std::size_t kMostMembers = 6000;  // that are read for them
constexpr std::size_t kBins = 20;
constexpr std::size_t kMostDensities = 16;  // genes
constexpr std::size_t kMostSteps = 400;     // of operators' probabilities
constexpr std::size_t kMostGenomes = 10;
constexpr std::size_t kMostElite = 30;

// About `most` of `count` indices, evenly, the last among them.
std::vector<std::size_t> some_of(std::size_t count, std::size_t most) {
  std::vector<std::size_t> some;
  const std::size_t each = std::max<std::size_t>(1, (count + most - 1) / most);
  for (std::size_t i = count; i > 0; i -= std::min(i, each)) some.push_back(i - 1);
  std::reverse(some.begin(), some.end());
  return some;
}

void add_operators(const std::vector<StoredGeneration>& generations, RunReport* report) {
  for (const auto& [name, share] : generations.back().operator_probabilities) {
    report->operators.push_back(name);
  }
  if (report->operators.empty()) return;
  for (const std::size_t i : some_of(generations.size(), kMostSteps)) {
    const StoredGeneration& g = generations[i];
    if (g.operator_probabilities.size() != report->operators.size()) continue;
    std::vector<double>& shares = report->probabilities.emplace_back();
    for (const auto& [name, share] : g.operator_probabilities) shares.push_back(share);
    report->probability_generations.push_back(g.generation);
  }
}

std::vector<GeneDensity> empty_densities(const Problem& problem, std::vector<std::size_t>* genes) {
  std::vector<GeneDensity> densities;
  for (std::size_t g = 0; g < problem.genes.size() && genes->size() < kMostDensities; ++g) {
    const Gene& gene = problem.genes[g];
    const Parameter& p = problem.table()[gene.row];
    if (p.kind != ParameterKind::kReal || !(gene.lower < gene.upper)) continue;
    GeneDensity& density = densities.emplace_back(GeneDensity{p.key, p.unit, {}, {}, {}, {}});
    for (std::size_t k = 0; k <= kBins; ++k) {
      density.edges.push_back(
          decode_gene(problem.table(), gene, static_cast<double>(k) / static_cast<double>(kBins)));
    }
    genes->push_back(g);
  }
  return densities;
}

void add_column(const Problem& problem, std::uint64_t generation,
                const std::vector<StoredIndividual>& individuals, std::size_t gene,
                GeneDensity* density) {
  std::vector<unsigned> bins(kBins);
  const StoredIndividual* best = nullptr;
  for (const StoredIndividual& one : individuals) {
    if (one.genome.size() != problem.genes.size()) continue;
    const double at = std::clamp(one.genome[gene], 0.0, 1.0) * static_cast<double>(kBins);
    ++bins[std::min(static_cast<std::size_t>(at), kBins - 1)];
    if (best == nullptr) best = &one;
  }
  if (best == nullptr) return;
  density->generations.push_back(generation);
  density->counts.push_back(std::move(bins));
  density->best.push_back(
      decode_gene(problem.table(), problem.genes[gene], std::clamp(best->genome[gene], 0.0, 1.0)));
}

// Searched by its logarithm, a gene's share of the range is that of the logarithm.
void add_elite(const Problem& problem, const std::vector<StoredIndividual>& last, RunElite* elite) {
  const ParameterTable& table = problem.table();
  const auto value = [&](const Gene& gene, double share) {
    const Parameter& p = table[gene.row];
    const double v = decode_gene(table, gene, share);
    return p.choices.empty() ? number_text(v, 4) : p.choices[static_cast<std::size_t>(v)];
  };
  for (const Gene& gene : problem.genes) {
    const Parameter& p = table[gene.row];
    elite->axes.push_back({p.key, p.unit, value(gene, 0), value(gene, 1)});
  }
  for (const StoredIndividual& one : last) {
    if (elite->lines.size() == kMostElite) break;
    if (one.outcome != "OK" || one.genome.size() != problem.genes.size()) continue;
    RunElite::Line& line = elite->lines.emplace_back();
    line.birth_id = one.birth_id;
    line.fitness = one.fitness;
    for (std::size_t g = 0; g < one.genome.size(); ++g) {
      line.shares.push_back(std::clamp(one.genome[g], 0.0, 1.0));
      line.values.push_back(value(problem.genes[g], line.shares.back()));
    }
  }
}

Status add_densities(const RunReader& reader, const Problem& problem,
                     const std::vector<StoredGeneration>& generations, RunReport* report) {
  std::vector<std::size_t> genes;
  report->densities = empty_densities(problem, &genes);
  ASSIGN_OR_RETURN(const auto last, reader.individuals(generations.back().generation));
  const std::size_t columns = std::clamp<std::size_t>(
      kMostMembers / std::max<std::size_t>(1, last.size()), 2, kMostColumns);
  for (const std::size_t i : some_of(generations.size(), columns)) {
    ASSIGN_OR_RETURN(const auto individuals, reader.individuals(generations[i].generation));
    for (std::size_t d = 0; d < genes.size(); ++d) {
      add_column(problem, generations[i].generation, individuals, genes[d], &report->densities[d]);
    }
  }
  std::erase_if(report->densities, [](const GeneDensity& d) { return d.generations.empty(); });
  add_elite(problem, last, &report->elite);
  return {};
}

RunGenome genome_of_member(const RunReader::Member& member) {
  const StoredIndividual& one = member.individual;
  return {one.birth_id,  member.generation, one.fitness, one.outcome,
          one.operators, one.parents,       {}};
}

Status add_genomes(const RunReader& reader, std::uint64_t generation, RunReport* report) {
  ASSIGN_OR_RETURN(const auto members, reader.individuals(generation));
  report->genomes_of = generation;
  for (const StoredIndividual& one : members) {
    if (report->genomes.size() == kMostGenomes) break;
    report->genomes.push_back(genome_of_member({generation, one}));
  }
  return {};
}

Status look_up(const RunReader& reader, const Problem& problem, std::uint64_t birth_id,
               RunReport* report) {
  ASSIGN_OR_RETURN(const auto member, reader.member(birth_id));
  if (!member) {
    report->without_looked_up =
        fmt::format("No member of a committed generation is genome {}.", birth_id);
    return {};
  }
  report->looked_up = genome_of_member(*member);
  const std::vector<double>& genome = member->individual.genome;
  if (genome.size() != problem.genes.size()) return {};
  for (std::size_t g = 0; g < genome.size(); ++g) {
    const Parameter& p = problem.table()[problem.genes[g].row];
    const double v =
        decode_gene(problem.table(), problem.genes[g], std::clamp(genome[g], 0.0, 1.0));
    const std::string text =
        p.choices.empty() ? number_text(v, 6) : p.choices[static_cast<std::size_t>(v)];
    report->looked_up->values.emplace_back(p.key, text + (p.unit == "-" ? "" : " " + p.unit));
  }
  return {};
}

}  // namespace

Status add_history(const RunReader& reader, const Problem& problem,
                   const std::vector<StoredGeneration>& generations, const RunQuestion& question,
                   RunReport* report) {
  report->trials = problem.log.trials.size();
  RETURN_IF_ERROR(add_farm(reader, report));
  if (question.genome) {
    RETURN_IF_ERROR(look_up(reader, problem, *question.genome, report));
  }
  if (generations.empty()) return {};
  const std::uint64_t last = generations.back().generation;
  const std::uint64_t asked = question.generation.value_or(last);
  RETURN_IF_ERROR(add_genomes(reader, asked >= 1 && asked <= last ? asked : last, report));
  add_operators(generations, report);
  return add_densities(reader, problem, generations, report);
}

}  // namespace gapfarm
