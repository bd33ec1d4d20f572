#include "master/run/evolution_farm.h"

#include <unordered_map>
#include <utility>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "master/evolve/individual.h"

namespace gapfarm {
namespace {

constexpr unsigned kMostAlarms = 100;
constexpr unsigned kMostFailureNotes = 100;
constexpr std::size_t kMostWorkerEvents = 20000;  // of a master
constexpr double kWriteInterval_s = 1;            // each costs a disk write

std::optional<IncidentKind> incident_of(FarmEvent::Kind kind) {
  if (kind == FarmEvent::kQuarantined) return IncidentKind::kQuarantine;
  if (kind == FarmEvent::kDisagreement) return IncidentKind::kAlarm;
  return std::nullopt;
}

using FarmKindName = std::pair<FarmEvent::Kind, const char*>;

// Who came or went, as the store names it.
constexpr FarmKindName kComingsAndGoings[] = {
    {FarmEvent::kJoined, "joined"},     {FarmEvent::kReturned, "returned"},
    {FarmEvent::kRefused, "refused"},   {FarmEvent::kLeft, "left"},
    {FarmEvent::kSilent, "silent"},     {FarmEvent::kDied, "died"},
    {FarmEvent::kBadMessage, "refused"}};

// What a user's program had no answer to since the last note, and the last that was asked of that.
class FailureNotes {
 public:
  // One note for `at_once` answers.
  FailureNotes(const Problem& problem, FarmProgressWriter& progress, std::size_t at_once)
      : problem_(problem), progress_(progress), at_once_(at_once) {}

  void asked(const std::vector<v1::Task>& tasks) {
    if (!problem_.external) return;
    for (const v1::Task& task : tasks) out_[next_place_++] = task;
  }

  void answered(std::size_t place, const v1::TaskResult& result) {
    if (!problem_.external) return;
    const v1::Task task = std::move(out_.extract(place).mapped());
    ++answered_;
    if (result.outcome() == v1::DIVERGED) {
      ++failed_;
      if (place >= last_place_) {
        last_place_ = place;
        last_ = task_label(task) + ": " +
                (result.message().empty() ? "diverged" : result.message()) + "; " +
                point_settings(problem_, task);
      }
    }
    if (answered_ >= at_once_) note();
  }

  void note() {
    if (failed_ > 0) {
      progress_.on_failures(std::to_string(failed_) + " of " + std::to_string(answered_) +
                            " evaluations failed: " + last_);
    }
    answered_ = failed_ = last_place_ = 0;
  }

 private:
  const Problem& problem_;
  FarmProgressWriter& progress_;
  std::size_t at_once_;
  std::unordered_map<std::size_t, v1::Task> out_;  // by place
  std::size_t next_place_ = 0;
  std::size_t answered_ = 0, failed_ = 0, last_place_ = 0;
  std::string last_;
};

}  // namespace

void FarmEventKeeper::keep(const FarmEvent& event) {
  const std::optional<IncidentKind> kind = incident_of(event.kind);
  if (kind && (*kind != IncidentKind::kAlarm || alarms_++ < kMostAlarms)) {
    // The run goes on when it cannot be written, as with the live row.
    if (Status s = store_.add_incident(*kind, event.text); !s) watcher_.error(s.error());
  }
  const auto* name = find_by(kComingsAndGoings, event.kind, &FarmKindName::first);
  // Whoever comes and is refused again and again is not to fill the disk.
  if (name == nullptr || kept_ >= kMostWorkerEvents) return;
  ++kept_;
  std::string host = event.host;
  if (event.kind == FarmEvent::kJoined || event.kind == FarmEvent::kReturned) {
    hosts_[event.worker] = host;
  } else if (const auto known = hosts_.find(event.worker); known != hosts_.end()) {
    host = known->second;
    hosts_.erase(known);
  }
  waiting_.push_back({unix_now_s(), name->second, event.worker, std::move(host), event.text});
}

void FarmEventKeeper::flush() {
  if (Status s = store_.add_worker_events(waiting_); !s) watcher_.error(s.error());
  waiting_.clear();
}

FarmProgressWriter::FarmProgressWriter(RunStore& store, Farm& farm,
                                       const EvolutionSettings& settings,
                                       const std::optional<Checkpoint>& resumed, double spent_s,
                                       const EvolveClock& clock, RunWatcher& watcher)
    : store_(store),
      farm_(farm),
      settings_(settings),
      clock_(clock),
      watcher_(watcher),
      began_s_(clock()),
      spent_before_s_(spent_s),
      wait_(farm.endpoints()) {
  last_.listens(farm);
  if (!resumed) return;
  generation_ = resumed->generation;
  evaluations_of_others_ = resumed->evaluations;
}

Progress FarmProgressWriter::now() const {
  Progress progress = last_;
  progress.farm = farm_.tally();
  return progress;
}

void FarmProgressWriter::on_progress(const FarmProgress& progress,
                                     std::uint64_t evaluations_before) {
  const std::uint64_t committed = evaluations_before_ - evaluations_before;
  last_.done = progress.done - committed;
  last_.total = progress.total - committed;
  refresh(clock_());
}

void FarmProgressWriter::watch(Log* log, FarmEventKeeper* events) {
  log_ = log;
  events_ = events;
}

void FarmProgressWriter::on_generation(const GenerationRecord& record, std::optional<double> best) {
  evaluations_before_ += last_.done;
  last_.done = last_.total = 0;
  ++generations_;
  generation_ = record.generation;
  best_ = format_number(best);
  if (log_ != nullptr) {
    log_->set({"generation", record.generation});
    std::vector<LogField> fields = {{"evaluations", record.evaluations}};
    if (best) fields.push_back({"best", *best});
    if (!record.members.empty() && record.members.front().standing.outcome == v1::INFEASIBLE) {
      fields.push_back({"violation", record.members.front().standing.cost});
    }
    log_->write(LogLevel::kInfo, "generation committed", fields);
  }
  refresh(clock_());
}

void FarmProgressWriter::on_failures(const std::string& text) {
  failure_ = text;
  if (failures_++ == 0) {
    watcher_.note(text);
  } else if (log_ != nullptr) {
    log_->write(LogLevel::kInfo, text);
  }
  if (failures_ > kMostFailureNotes) return;
  if (Status s = store_.add_incident(IncidentKind::kFailure, text); !s) watcher_.error(s.error());
}

std::string FarmProgressWriter::message(const Pace& pace) const {
  std::string text = "generation " + std::to_string(generation_ + 1) + " of " +
                     std::to_string(settings_.generations) +
                     (best_.empty() ? "" : ", best " + best_);
  if (last_.time_left_s && pace.wall_s > 0) {
    text += ", " + format_share(pace.wall_s / (pace.wall_s + *last_.time_left_s)) + " done";
  }
  return progress_text(text, last_.rate_per_s, last_.time_left_s);
}

void FarmProgressWriter::refresh(double now_s) {
  const double spent_s = now_s - began_s_;
  const std::uint64_t done = evaluations_before_ + last_.done;
  last_.rate_per_s = spent_s > 0 ? static_cast<double>(done) / spent_s : 0;
  Pace pace;
  pace.generation = generation_;
  pace.evaluations = evaluations_of_others_ + done;
  pace.wall_s = spent_before_s_ + spent_s;
  if (last_.total > 0) {
    pace.share = static_cast<double>(last_.done) / static_cast<double>(last_.total);
  }
  pace.generations_here = generations_;
  pace.evaluations_here = done;
  pace.wall_here_s = spent_s;
  last_.time_left_s = time_left_s(settings_, pace);
  const bool news = last_.look_at(farm_, wait_, now_s);
  watcher_.progress("evolve: " + (last_.waiting.empty() ? message(pace) : last_.waiting), news);
  if (now_s - written_s_ < kWriteInterval_s) return;
  written_s_ = now_s;
  if (events_ != nullptr) events_->flush();
  last_.farm = farm_.tally();
  // The live row is a courtesy: a run goes on when it cannot be written, and a commit that cannot
  // be written stops it with the reason.
  if (Status s = store_.set_progress(last_); !s) watcher_.error(s.error());
}

ScoreCandidates farm_scores(Farm& farm, const Problem& problem, std::uint64_t seed,
                            FarmProgressWriter& progress) {
  const std::string hash = farm.add_problem(to_proto(problem));
  return [&farm, &problem, &progress, seed, hash](std::vector<Candidate> candidates,
                                                  const TakeScore& take) {
    FailureNotes failures(problem, progress, candidates.size());
    const std::uint64_t before = progress.evaluations_before();
    const auto sent = [&](std::span<const Candidate> all) {
      std::vector<v1::Task> tasks =
          mapped(all, [&](const Candidate& candidate) { return evaluation_task(candidate, seed); });
      failures.asked(tasks);
      return tasks;
    };
    const auto on_answer = [&](std::size_t place,
                               const v1::TaskResult& result) -> Result<std::vector<v1::Task>> {
      failures.answered(place, result);
      ASSIGN_OR_RETURN(const Score score, score_of(result, problem.fitness));
      ASSIGN_OR_RETURN(const auto next, take(place, score));
      return sent(next);
    };
    const Status status =
        farm.stream(hash, sent(candidates), on_answer,
                    [&](const FarmProgress& done) { progress.on_progress(done, before); });
    failures.note();
    return status;
  };
}

Status StoreSink::commit(const GenerationRecord& record) {
  RETURN_IF_ERROR(store_.set_numeric_class(farm_.numeric_class()));
  StoredGeneration stored;
  stored.generation = record.generation;
  stored.diversity = record.diversity;
  stored.operator_probabilities = mapped(record.operator_probabilities, [](const NamedNumber& p) {
    return NamedValue{p.name, p.value};
  });
  stored.evaluations = record.evaluations;
  stored.wall_s = record.wall_s;
  stored.quarantined = static_cast<unsigned>(farm_.given_up() - quarantined_);
  quarantined_ = farm_.given_up();
  stored.optimiser_state = record.optimiser_state;
  const FitnessKind kind = problem_.fitness.kind;
  for (const Individual& member : record.members) {
    StoredIndividual individual;
    individual.birth_id = member.birth_id;
    individual.genome = member.genome;
    individual.values = readable_values(problem_, member.genome);
    individual.outcome = v1::Outcome_Name(member.standing.outcome);
    if (member.standing.outcome == v1::OK)
      individual.fitness = fitness_of_cost(kind, member.standing.cost);
    individual.scores = member.standing.scores;
    individual.parents = member.parents;
    individual.operators = origin_name(member.origin);
    for (std::size_t m = 0; m < member.standing.costs.size(); ++m) {
      const auto& [name, maximise] = problem_.fitness.objectives[m];
      individual.objectives.emplace_back(
          name, maximise ? -member.standing.costs[m] : member.standing.costs[m]);
    }
    stored.individuals.push_back(std::move(individual));
  }
  summarise_fitness(stored, higher_is_better(kind));
  ASSIGN_OR_RETURN(const std::string digest, store_.commit(stored));
  progress_.on_generation(record, stored.best);
  return {};
}

}  // namespace gapfarm
