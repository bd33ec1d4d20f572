#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <set>
#include <utility>

#include "common/base/text.h"
#include "master/evolve/individual.h"
#include "master/report/html.h"
#include "master/run/run_page.h"
#include "master/store/run_lock.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMostColumns = 48;    // of a density
constexpr std::size_t kMostMembers = 6000;  // that are read for them
constexpr std::size_t kBins = 20;
constexpr std::size_t kMostDensities = 16;  // genes
constexpr std::size_t kMostSteps = 400;     // of operators' probabilities
constexpr std::size_t kMostGenomes = 10;

// About `most` of `count` indices, evenly, the last among them.
std::vector<std::size_t> some_of(std::size_t count, std::size_t most) {
  std::vector<std::size_t> some;
  const std::size_t each = std::max<std::size_t>(1, (count + most - 1) / most);
  for (std::size_t i = count; i > 0; i -= std::min(i, each)) some.push_back(i - 1);
  std::ranges::reverse(some);
  return some;
}

void add_operators(const std::vector<StoredGeneration>& generations, RunReport* report) {
  const auto drawn = [](const StoredGeneration& g) {
    auto operators = g.operator_probabilities;
    std::erase_if(operators, [](const auto& figure) { return !is_operator(figure.first); });
    return operators;
  };
  for (const auto& [name, share] : drawn(generations.back())) report->operators.push_back(name);
  if (report->operators.empty()) return;
  for (const std::size_t i : some_of(generations.size(), kMostSteps)) {
    const StoredGeneration& g = generations[i];
    const auto operators = drawn(g);
    if (operators.size() != report->operators.size()) continue;
    std::vector<double>& shares = report->probabilities.emplace_back();
    for (const auto& [name, share] : operators) shares.push_back(share);
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
  ASSIGN_OR_RETURN(const auto last, reader.individuals(generations.back().generation));
  const std::size_t columns = std::clamp<std::size_t>(
      kMostMembers / std::max<std::size_t>(1, last.size()), 2, kMostColumns);
  std::vector<StoredIndividual> sample;
  std::set<std::uint64_t> known;
  for (const std::size_t i : some_of(generations.size(), columns)) {
    ASSIGN_OR_RETURN(const auto individuals, reader.individuals(generations[i].generation));
    for (const StoredIndividual& one : individuals) {
      if (one.fitness && known.insert(one.birth_id).second) sample.push_back(one);
    }
    for (std::size_t d = 0; d < genes.size(); ++d) {
      add_column(problem, generations[i].generation, individuals, genes[d], &report->densities[d]);
    }
  }
  std::erase_if(report->densities, [](const GeneDensity& d) { return d.generations.empty(); });
  // A front is shown as one.
  std::vector<StoredIndividual> elite = last;
  ASSIGN_OR_RETURN(report->front, run_front(reader, generations));
  const RunFront& front = report->front;
  if (!front.objectives.empty()) report->fitness = front.objectives.front().name;
  if (!front.members.empty()) {
    elite = front.members;
    std::swap(elite.front(), elite[front.knee]);
  }
  report->elite = run_elite(problem, elite);
  report->sample = run_sample(problem, sample);
  return {};
}

Status add_genomes(const RunReader& reader, std::uint64_t generation, RunReport* report) {
  ASSIGN_OR_RETURN(const auto members, reader.individuals(generation));
  report->genomes_of = generation;
  for (const StoredIndividual& one : members) {
    if (report->genomes.size() == kMostGenomes) break;
    report->genomes.push_back({generation, one});
  }
  return {};
}

Status look_up(const RunReader& reader, const Problem& problem, std::uint64_t birth_id,
               RunReport* report) {
  ASSIGN_OR_RETURN(report->looked_up, reader.member(birth_id));
  if (!report->looked_up) {
    report->without_looked_up =
        fmt::format("No member of a committed generation is genome {}.", birth_id);
    return {};
  }
  const std::vector<double>& genome = report->looked_up->individual.genome;
  if (genome.size() != problem.genes.size()) return {};
  for (std::size_t g = 0; g < genome.size(); ++g) {
    const Parameter& p = problem.table()[problem.genes[g].row];
    const double v =
        decode_gene(problem.table(), problem.genes[g], std::clamp(genome[g], 0.0, 1.0));
    const std::string text =
        p.choices.empty() ? number_text(v, 6) : p.choices[static_cast<std::size_t>(v)];
    report->looked_up_values.emplace_back(p.key, with_unit(text, p.unit));
  }
  return {};
}

constexpr std::size_t kMostIncidents = 50;
constexpr std::size_t kMostFailures = 30;
constexpr std::size_t kMostGivenUp = 30;
constexpr std::size_t kMostLogLines = 20;
constexpr std::streamoff kLogTail = 8192;
constexpr std::size_t kMostEvents = 20000;  // that are read
constexpr std::size_t kMostCounts = 2000;
constexpr std::size_t kMostMarks = 300;
constexpr std::size_t kMostSpans = 40;
constexpr std::size_t kMostRows = 200;  // in the table

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

std::string day_and_time(double unix_s) { return utc_text(unix_s, "%m-%d %H:%M UTC"); }

void add_facts(const RunStatus& status, RunFarm* farm) {
  const auto add = [&](const std::string& label, const std::string& value) {
    farm->facts.emplace_back(label, value);
  };
  if (const std::string start = search_start_text(status.info); !start.empty()) {
    add("began at", start);
  }
  add("evaluations", std::to_string(status.last.evaluations));
  if (status.running()) {
    add("rate", fmt::format("{:.3g} evaluations/s", status.rate_per_s));
    add("tasks of this generation", fmt::format("{} of {}", status.done, status.total));
    if (status.time_left_s) add("time left", "about " + format_duration(*status.time_left_s));
  }
  add("last heard of", day_and_time(status.heartbeat_unix_s) + " on " + status.host);
  if (status.epoch > 1) add("masters so far", std::to_string(status.epoch));
  if (status.quarantined > 0) add("tasks given up", std::to_string(status.quarantined));
  for (const FarmTally::Row& row : FarmTally::kRows) {
    farm->tally.emplace_back(row.label, std::to_string(status.farm.*row.count));
  }
}

bool is_failure(const StoredWorkerEvent& event) {
  return event.kind == "died" || event.kind == "silent" || event.kind == "refused";
}

std::string sentence_of(const StoredWorkerEvent& event) {
  return day_and_time(event.unix_s) + ": " + (event.worker.empty() ? "" : event.worker + " ") +
         (event.host.empty() ? "" : "(" + event.host + ") ") + event.text;
}

// Whoever came and has not gone yet.
class Present {
 public:
  explicit Present(RunTimeline* timeline) : timeline_(timeline) {}

  void take(const StoredWorkerEvent& event) {
    if (event.kind == "master" || event.kind == "end") return leave_all(event);
    if (event.kind == "joined" || event.kind == "returned") {
      if (there_.contains(event.worker)) return;
      there_[event.worker] = timeline_->spans.size();
      timeline_->spans.push_back({event.worker, event.host, event.unix_s, event.unix_s, ""});
      return count(event, "joined");
    }
    const auto one = there_.find(event.worker);
    if (one != there_.end()) {
      leave(one->second, event.unix_s, is_failure(event) ? event.text : "");
      there_.erase(one);
    }
    count(event, is_failure(event) ? "failed" : "left");
  }
  void end_at(double unix_s) {
    for (const auto& [name, span] : there_) leave(span, unix_s, "");
  }
  std::size_t size() const { return there_.size(); }

 private:
  void leave(std::size_t span, double unix_s, const std::string& how) {
    timeline_->spans[span].to_unix_s = unix_s;
    timeline_->spans[span].end = how;
  }
  // With a master its workers go, or stay away from the next until they join it.
  void leave_all(const StoredWorkerEvent& event) {
    end_at(event.unix_s);
    there_.clear();
    count(event, "master");
  }
  void count(const StoredWorkerEvent& event, const char* kind) {
    const auto workers = static_cast<unsigned>(there_.size());
    timeline_->counts.push_back({event.unix_s, workers});
    timeline_->marks.push_back({event.unix_s, workers, kind, sentence_of(event)});
  }

  RunTimeline* timeline_;
  std::map<std::string, std::size_t> there_;  // place among the spans
};

Status add_workers(const RunReader& reader, bool running, RunFarm* farm) {
  ASSIGN_OR_RETURN(const auto progress, reader.progress());
  ASSIGN_OR_RETURN(const auto events, reader.worker_events(kMostEvents));
  std::map<std::string, std::string> failures;  // the last of each
  for (const StoredWorkerEvent& event : events) {
    if (!is_failure(event)) continue;
    failures[event.worker] = day_and_time(event.unix_s) + ": " + event.text;
  }
  for (auto it = events.rbegin(); it != events.rend(); ++it) {
    if (farm->failures.size() == kMostFailures) break;
    if (is_failure(*it)) farm->failures.push_back(sentence_of(*it));
  }
  for (const WorkerStatus& w : progress.workers) {
    if (farm->workers.size() == kMostRows) break;
    const auto failure = failures.find(w.name);
    RunWorker& worker = farm->workers.emplace_back(RunWorker{w, ""});
    // Whoever is not watched any more is neither busy nor idle.
    if (!running && w.state != "gone") worker.state = "was " + w.state;
    if (failure != failures.end()) worker.failure = failure->second;
  }
  farm->timeline = timeline_of(events, progress.heartbeat_unix_s, running);
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

RunTimeline timeline_of(const std::vector<StoredWorkerEvent>& events, double heartbeat_unix_s,
                        bool alive) {
  RunTimeline timeline;
  if (events.empty()) return timeline;
  Present present(&timeline);
  for (const StoredWorkerEvent& event : events) present.take(event);
  timeline.end_unix_s = std::max(heartbeat_unix_s, events.back().unix_s);
  present.end_at(timeline.end_unix_s);
  const unsigned left = alive ? static_cast<unsigned>(present.size()) : 0;
  timeline.counts.push_back({timeline.end_unix_s, left});
  timeline.counts = decimated(timeline.counts, kMostCounts, [](const RunTimeline::Count& count) {
    return static_cast<double>(count.workers);
  });
  if (timeline.marks.size() > kMostMarks) {
    timeline.marks.erase(timeline.marks.begin(),
                         timeline.marks.end() - static_cast<std::ptrdiff_t>(kMostMarks));
  }
  for (const RunTimeline::Span& span : timeline.spans) {
    timeline.worker_s += span.to_unix_s - span.from_unix_s;
  }
  if (timeline.spans.size() > kMostSpans) timeline.spans.clear();
  return timeline;
}

Status add_farm(const RunReader& reader, RunReport* report) {
  ASSIGN_OR_RETURN(const auto status, run_status(reader, unix_now_s()));
  RunFarm& farm = report->farm;
  farm.state = run_state_name(status.state);
  farm.message = status.running() ? status.waiting : status.stop_reason;
  add_facts(status, &farm);
  RETURN_IF_ERROR(add_workers(reader, status.running(), &farm));
  farm.facts.emplace_back("wall time", format_duration(status.wall_s));
  if (farm.timeline.worker_s > 0) {
    farm.facts.emplace_back("all workers' time together", format_duration(farm.timeline.worker_s));
  }
  for (auto it = status.incidents.rbegin(); it != status.incidents.rend(); ++it) {
    if (farm.incidents.size() == kMostIncidents) break;
    farm.incidents.push_back(fmt::format("{}, generation {}, {}: {}", day_and_time(it->unix_s),
                                         it->generation, incident_name(it->kind), it->text));
  }
  ASSIGN_OR_RETURN(farm.given_up, reader.given_up(kMostGivenUp));
  farm.log = log_tail(reader.run());
  return {};
}

}  // namespace gapfarm
