#include "master/cli/run_history.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <fstream>

#include "master/progress/words.h"
#include "master/store/run_status.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMostColumns = 48;    // of a density
constexpr std::size_t kMostMembers = 6000;  // that are read for them
constexpr std::size_t kBins = 20;
constexpr std::size_t kMostDensities = 16;  // genes
constexpr std::size_t kMostSteps = 400;     // of operators' probabilities
constexpr std::size_t kMostGenomes = 10;
constexpr std::size_t kMostIncidents = 50;
constexpr std::size_t kMostLogLines = 20;
constexpr std::streamoff kLogTail = 8192;

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

Status add_densities(const RunReader& reader, const Problem& problem,
                     const std::vector<StoredGeneration>& generations, RunReport* report) {
  std::vector<std::size_t> genes;
  report->densities = empty_densities(problem, &genes);
  const auto last = reader.individuals(generations.back().generation);
  if (!last) return last.error();
  const std::size_t columns = std::clamp<std::size_t>(
      kMostMembers / std::max<std::size_t>(1, last->size()), 2, kMostColumns);
  for (const std::size_t i : some_of(generations.size(), columns)) {
    const auto individuals = reader.individuals(generations[i].generation);
    if (!individuals) return individuals.error();
    for (std::size_t d = 0; d < genes.size(); ++d) {
      add_column(problem, generations[i].generation, *individuals, genes[d], &report->densities[d]);
    }
  }
  std::erase_if(report->densities, [](const GeneDensity& d) { return d.generations.empty(); });
  for (const StoredIndividual& one : *last) {
    if (report->genomes.size() == kMostGenomes) break;
    report->genomes.push_back({one.birth_id, one.fitness, one.outcome, one.operators, one.parents});
  }
  return {};
}

std::vector<std::string> log_tail(const std::filesystem::path& run) {
  std::ifstream file(run / "log.txt", std::ios::binary | std::ios::ate);
  if (!file) return {};
  const std::streamoff size = file.tellg();
  const std::streamoff from = std::max<std::streamoff>(0, size - kLogTail);
  file.seekg(from);
  std::vector<std::string> lines;
  std::string line;
  if (from > 0) std::getline(file, line);  // a part of one
  while (std::getline(file, line)) lines.push_back(line);
  if (lines.size() > kMostLogLines) {
    lines.erase(lines.begin(), lines.end() - static_cast<std::ptrdiff_t>(kMostLogLines));
  }
  return lines;
}

std::string time_of_day(double unix_s) {
  const auto seconds = static_cast<std::time_t>(unix_s);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  return fmt::format("{:02}-{:02} {:02}:{:02} UTC", utc.tm_mon + 1, utc.tm_mday, utc.tm_hour,
                     utc.tm_min);
}

void add_facts(const RunStatus& status, RunFarm* farm) {
  const auto add = [&](const std::string& label, const std::string& value) {
    farm->facts.emplace_back(label, value);
  };
  const Progress& progress = status.progress;
  add("evaluations", std::to_string(status.evaluations));
  if (status.state == RunState::kRunning) {
    add("rate", fmt::format("{:.3g} evaluations/s", status.rate_per_s));
    add("tasks of this generation", fmt::format("{} of {}", progress.done, progress.total));
    if (status.time_left_s) add("time left", "about " + format_duration(*status.time_left_s));
  }
  add("last heard of", time_of_day(progress.heartbeat_unix_s) + " on " + progress.host);
  if (progress.epoch > 1) add("masters so far", std::to_string(progress.epoch));
  if (status.quarantined > 0) add("tasks given up", std::to_string(status.quarantined));
  for (const FarmTally::Row& row : FarmTally::kRows) {
    std::string label = row.key;
    std::replace(label.begin(), label.end(), '_', ' ');
    farm->tally.emplace_back(std::move(label), std::to_string(progress.farm.*row.count));
  }
}

Status add_farm(const RunReader& reader, RunReport* report) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto status = run_status(reader, std::chrono::duration<double>(now).count());
  if (!status) return status.error();
  RunFarm& farm = report->farm;
  farm.state = run_state_name(status->state);
  const bool running = status->state == RunState::kRunning;
  farm.told = running ? status->progress.waiting : status->stop_reason;
  add_facts(*status, &farm);
  for (const StoredWorker& w : status->progress.workers) {
    // Whoever is not watched any more is neither busy nor idle.
    farm.workers.push_back(
        {w.name, w.host, running ? w.state : "was " + w.state, w.jobs, w.finished, w.rate_per_s});
  }
  for (auto it = status->incidents.rbegin(); it != status->incidents.rend(); ++it) {
    if (farm.incidents.size() == kMostIncidents) break;
    farm.incidents.push_back(fmt::format("{}, generation {}, {}: {}", time_of_day(it->unix_s),
                                         it->generation, incident_name(it->kind), it->text));
  }
  farm.log = log_tail(reader.run());
  return {};
}

}  // namespace

Status add_history(const RunReader& reader, const Problem& problem,
                   const std::vector<StoredGeneration>& generations, RunReport* report) {
  report->trials = problem.log.trials.size();
  if (Status s = add_farm(reader, report); !s) return s;
  if (generations.empty()) return {};
  add_operators(generations, report);
  return add_densities(reader, problem, generations, report);
}

}  // namespace gapfarm
