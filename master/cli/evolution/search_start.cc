#include "master/cli/evolution/search_start.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>

#include "common/base/ranges.h"
#include "common/trials/files.h"
#include "common/trials/text/csv.h"
#include "master/cli/models/parameter_options.h"
#include "master/command/inputs.h"
#include "master/evolve/evolve.h"
#include "master/evolve/optimisers.h"

namespace gapfarm {
namespace {

const std::string& key_of(const Problem& problem, const Gene& gene) {
  return problem.table()[gene.row].key;
}

std::vector<std::string> gene_keys(const Problem& problem) {
  return mapped(problem.genes, [&](const Gene& gene) { return key_of(problem, gene); });
}

// As many as a first population takes, each once.
void keep_first(std::vector<Genome>& genomes, const EvolutionSettings& settings) {
  const std::size_t most = std::max(settings.population, settings.optimiser.population.value_or(0));
  std::set<Genome> known;
  std::erase_if(genomes, [&](const Genome& genome) {
    return known.size() >= most || !known.insert(genome).second;
  });
}

class TableOfGenes {
 public:
  TableOfGenes(const std::string& path, const Config& config) : path_(path), config_(config) {}

  Result<std::vector<Genome>> read(std::string_view text, Console& console) {
    ASSIGN_OR_RETURN(const auto rows, parse_csv(text, path_));
    if (rows.empty()) return text_error(path_, {}, "nothing", "a header and rows of values");
    RETURN_IF_ERROR(read_header(rows.front(), console));
    for (auto row = rows.begin() + 1; row != rows.end(); ++row) {
      RETURN_IF_ERROR(read_row(*row, rows.front().fields.size()));
    }
    if (rows_.empty()) return text_error(path_, rows.front().end, "no rows", "rows of values");
    std::ranges::stable_sort(rows_, [](const Row& a, const Row& b) { return a.cost < b.cost; });
    return mapped(rows_, [](Row& row) { return std::move(row.genome); });
  }

 private:
  struct Row {
    double cost;
    Genome genome;
  };

  Status read_header(const CsvRow& header, Console& console) {
    const std::vector<std::string> keys = gene_keys(config_.problem);
    columns_.assign(keys.size(), std::nullopt);
    std::vector<std::string> ignored, missing;
    for (std::size_t c = 0; c < header.fields.size(); ++c) {
      const CsvField& field = header.fields[c];
      const auto key = std::ranges::find(keys, field.text);
      if (key != keys.end()) {
        auto& column = columns_[static_cast<std::size_t>(key - keys.begin())];
        if (column) return text_error(path_, field.place, field.text + " again", "a gene once");
        column = c;
      } else if (!score_ && (field.text == "fitness" || field.text == "score")) {
        score_ = c;
      } else if (!field.text.empty()) {  // pandas' index
        ignored.push_back(field.text);
      }
    }
    for (std::size_t g = 0; g < keys.size(); ++g) {
      if (!columns_[g]) missing.push_back(keys[g]);
    }
    if (missing.size() == keys.size()) {
      return text_error(path_, {}, fmt::format("columns {}", fmt::join(ignored, ", ")),
                        fmt::format("genes of the config: {}", fmt::join(keys, ", ")));
    }
    if (!missing.empty()) {
      console.note(
          fmt::format("{}: has no {}: as the config has it", path_, fmt::join(missing, ", ")));
    }
    if (!ignored.empty()) {
      console.note(fmt::format("{}: not used: {}", path_, fmt::join(ignored, ", ")));
    }
    return {};
  }

  Status read_row(const CsvRow& row, std::size_t width) {
    if (row.fields.size() != width) {
      return text_error(path_, row.end, std::to_string(row.fields.size()) + " fields",
                        std::to_string(width) + ", as the header has");
    }
    const Problem& problem = config_.problem;
    Row read{-std::numeric_limits<double>::infinity(), {}};
    if (score_) {
      const auto score = parse_double(row.fields[*score_].text);
      const bool known = score && std::isfinite(*score);
      read.cost = known ? cost_of_fitness(problem.fitness.kind, *score)
                        : std::numeric_limits<double>::infinity();
    }
    for (std::size_t g = 0; g < columns_.size(); ++g) {
      const Gene& gene = problem.genes[g];
      double value = problem.values[gene.row];
      if (columns_[g]) {
        const CsvField& field = row.fields[*columns_[g]];
        const auto found = value_of_text(problem.table()[gene.row], field.text);
        if (!found || !(*found >= gene.lower && *found <= gene.upper)) {
          return text_error(path_, field.place,
                            key_of(problem, gene) + " " + quoted_word(field.text),
                            fmt::format("its range in [genes], {} to {}", gene.lower, gene.upper),
                            "widen the range, or leave the row out");
        }
        value = *found;
      }
      read.genome.push_back(encode_gene(problem.table(), gene, value));
    }
    rows_.push_back(std::move(read));
    return {};
  }

  const std::string& path_;
  const Config& config_;
  std::vector<std::optional<std::size_t>> columns_;  // of the genes
  std::optional<std::size_t> score_;
  std::vector<Row> rows_;
};

Result<Genome> genome_of_model(const Model& model, const std::string& from, const Config& config) {
  Genome genome;
  for (const Gene& gene : config.problem.genes) {
    const std::string& key = key_of(config.problem, gene);
    const auto row = model.table().find(key);
    if (!row) return Error{from + ": has no " + key + ", which is a gene"};
    const double value = model.values[*row];
    if (value < gene.lower || value > gene.upper) {
      return Error{fmt::format("{}: {} is {}, outside of its range in [genes], {} to {}; widen it",
                               from, key, value, gene.lower, gene.upper)};
    }
    genome.push_back(encode_gene(config.problem.table(), gene, value));
  }
  return genome;
}

// The genes of a branch: those of the run without what is fixed, with what is freed.
Status change_genes(const BranchOptions& options, const std::string& run, Config& config) {
  Problem& problem = config.problem;
  const std::vector<std::string> keys = gene_keys(problem);
  for (const std::string& setting : options.fixed) {
    const std::string key = setting.substr(0, setting.find('='));
    RETURN_IF_ERROR(apply_setting(setting, problem, "--fix"));
    const std::size_t removed = std::erase_if(
        problem.genes, [&](const Gene& gene) { return key_of(problem, gene) == key; });
    if (removed == 0) {
      return Error{fmt::format("--fix {}: {} is no gene of {}; its genes: {}", setting, key, run,
                               fmt::join(keys, ", "))};
    }
  }
  // A gene that was fixed before has the config's range.
  ASSIGN_OR_RETURN(const Config first,
                   parse_config(config.text, config.path, start_no_program, &config.problem));
  for (const std::string& text : options.freed) {
    Problem freed = problem;
    RETURN_IF_ERROR(apply_genes({text}, freed, "--free"));
    Gene gene = freed.genes.front();
    const std::string key = key_of(problem, gene);
    for (const Gene& before : first.problem.genes) {
      if (before.row == gene.row && text == key) gene = before;
    }
    const double value = problem.values[gene.row];
    if (contains(keys, key)) {
      return Error{fmt::format("--free {}: {} is a gene of {} already", text, key, run)};
    }
    if (value < gene.lower || value > gene.upper) {
      return Error{
          fmt::format("--free {}: {} is {} in {}, outside of {} to {}; give a range that "
                      "holds it: --free {}=LOWER,UPPER",
                      text, key, value, run, gene.lower, gene.upper, key)};
    }
    problem.genes.push_back(gene);
  }
  std::ranges::sort(problem.genes, {}, &Gene::row);
  return {};
}

// The same genes, and for what was no gene its value in `after`.
Genome changed_genome(const Genome& genome, const Problem& before, const Problem& after) {
  Genome changed;
  for (const Gene& gene : after.genes) {
    const auto old = std::ranges::find(before.genes, gene);
    changed.push_back(old == before.genes.end()
                          ? encode_gene(after.table(), gene, after.values[gene.row])
                          : genome[static_cast<std::size_t>(old - before.genes.begin())]);
  }
  return changed;
}

}  // namespace

Status begin_at(const std::string& from, Config& config, const std::string& config_path,
                Console& console) {
  SearchStart& start = config.evolution.start;
  start.from = from;
  const std::filesystem::path path(from);
  std::error_code ignored;
  const bool table = std::filesystem::is_regular_file(path, ignored) &&
                     path.extension() != ".toml" && path.extension() != ".sqlite";
  if (!table) {
    ASSIGN_OR_RETURN(const Model model, find_model(from, console));
    RETURN_IF_ERROR(check_same_robot(model, from, config, config_path));
    ASSIGN_OR_RETURN(auto genome, genome_of_model(model, from, config));
    start.genomes = {std::move(genome)};
    return {};
  }
  ASSIGN_OR_RETURN(const std::string text, read_text_file(from));
  ASSIGN_OR_RETURN(start.genomes, TableOfGenes(from, config).read(text, console));
  const std::size_t rows = start.genomes.size();
  keep_first(start.genomes, config.evolution);
  console.note(fmt::format("{}: begins at {} of {} rows", from, start.genomes.size(), rows));
  return {};
}

Status branch_off(const RunReader& run, const BranchOptions& options, Config& config) {
  const std::string name = run.run().string();
  ASSIGN_OR_RETURN(const auto plan, read_stages(config));
  if (!plan.stages.empty()) {
    return Error{name +
                 ": searches in [[stages]], which name genes; change the config and use "
                 "evolve --from"};
  }
  ASSIGN_OR_RETURN(const auto generations, run.generations());
  const std::uint64_t last = generations.empty() ? 0 : generations.back().generation;
  const std::uint64_t at = options.generation.value_or(last);
  if (at == 0 || at > last) {
    return Error{
        fmt::format("{}: has no generation {} to branch off; {}", name, at,
                    last == 0 ? "let it complete one" : "its last is " + std::to_string(last))};
  }
  const Problem before = config.problem;
  RETURN_IF_ERROR(change_genes(options, name, config));
  ASSIGN_OR_RETURN(const auto members, run.individuals(at));
  SearchStart start;
  start.from = name;
  start.generation = at;
  start.digest = generations[at - 1].digest;
  start.fixed = options.fixed;
  start.freed = options.freed;
  for (const StoredIndividual& member : members) {
    if (member.genome.size() != before.genes.size()) continue;
    start.genomes.push_back(changed_genome(member.genome, before, config.problem));
  }
  if (start.genomes.empty()) {
    return Error{fmt::format("{}: generation {} has no best; the store is damaged", name, at)};
  }
  keep_first(start.genomes, config.evolution);
  config.evolution.start = std::move(start);
  return {};
}

}  // namespace gapfarm
