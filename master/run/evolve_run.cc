#include <spdlog/fmt/fmt.h>

#include <unordered_map>
#include <utility>

#include "common/base/clock.h"
#include "common/base/ranges.h"
#include "common/base/text.h"
#include "master/evolve/individual.h"
#include "master/evolve/optimisers.h"
#include "master/run/run_page.h"

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

// Keeps what a farm reports in the store: at once what was lost or is contradictory (of the alarms
// only the first hundred: each costs a disk write, and a machine that computes wrongly raises one
// after the other), at the next flush() who came and went.
class FarmEventKeeper {
 public:
  FarmEventKeeper(RunStore& store, RunWatcher& watcher) : store_(store), watcher_(watcher) {}

  void keep(const FarmEvent& event) {
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
    } else if (auto known = hosts_.extract(event.worker)) {
      host = std::move(known.mapped());
    }
    waiting_.push_back({unix_now_s(), name->second, event.worker, std::move(host), event.text});
  }
  void flush() {
    if (Status s = store_.add_worker_events(waiting_); !s) watcher_.error(s.error());
    waiting_.clear();
  }

 private:
  RunStore& store_;
  RunWatcher& watcher_;
  unsigned alarms_ = 0;
  std::size_t kept_ = 0;                                // of who came and went
  std::unordered_map<std::string, std::string> hosts_;  // of workers that are there
  std::vector<StoredWorkerEvent> waiting_;
};

// Keeps the store's live row and the watcher's progress line fresh, about once a second.
class ProgressWriter {
 public:
  // `resumed`: where the run goes on; none at its start.  `spent_s`: wall time of the run until
  // now.
  ProgressWriter(RunStore& store, Farm& farm, const RunRequest& run,
                 const std::optional<Checkpoint>& resumed, double spent_s, FarmEventKeeper& events,
                 RunWatcher& watcher)
      : store_(store),
        farm_(farm),
        run_(run),
        events_(events),
        watcher_(watcher),
        spent_before_s_(spent_s),
        wait_(farm.endpoints()) {
    last_.listens(farm);
    if (!resumed) return;
    generation_ = resumed->generation;
    evaluations_of_others_ = resumed->evaluations;
  }

  // Evaluations of the generations that this life of the master has committed.
  std::uint64_t evaluations_before() const { return evaluations_before_; }
  const std::string& failure() const { return failure_; }  // the last on_failures(); empty: none

  // As last shown, with the farm's counts as they are now.
  Progress now() const {
    Progress progress = last_;
    progress.farm = farm_.tally();
    return progress;
  }

  // Of what was asked when there were so many evaluations_before().
  void on_progress(const FarmProgress& progress, std::uint64_t before) {
    const std::uint64_t committed = evaluations_before_ - before;
    last_.done = progress.done - committed;
    last_.total = progress.total - committed;
    refresh();
  }

  void on_generation(const GenerationRecord& record, std::optional<double> best) {
    evaluations_before_ += last_.done;
    last_.done = last_.total = 0;
    ++generations_;
    generation_ = record.generation;
    best_ = format_number(best);
    run_.log.set({"generation", record.generation});
    std::vector<LogField> fields = {{"evaluations", record.evaluations}};
    if (best) fields.push_back({"best", *best});
    if (!record.members.empty() && record.members.front().standing.outcome == v1::INFEASIBLE) {
      fields.push_back({"violation", record.members.front().standing.cost});
    }
    run_.log.write(LogLevel::kInfo, "generation committed", fields);
    refresh();
  }

  // Evaluations of the generation in work that a user's program had no answer to, in a sentence.
  void on_failures(const std::string& text) {
    failure_ = text;
    if (failures_++ == 0) {
      watcher_.note(text);
    } else {
      run_.log.write(LogLevel::kInfo, text);
    }
    if (failures_ > kMostFailureNotes) return;
    if (Status s = store_.add_incident(IncidentKind::kFailure, text); !s) watcher_.error(s.error());
  }

 private:
  std::string message(const Pace& pace) const {
    std::string text = "generation " + std::to_string(generation_ + 1) + " of " +
                       std::to_string(run_.config.evolution.generations) +
                       (best_.empty() ? "" : ", best " + best_);
    if (last_.time_left_s && pace.wall_s > 0) {
      text += ", " + format_share(pace.wall_s / (pace.wall_s + *last_.time_left_s)) + " done";
    }
    return progress_text(text, last_.rate_per_s, last_.time_left_s);
  }

  void refresh() {
    const double now_s = monotonic_seconds(), spent_s = now_s - began_s_;
    const std::uint64_t done = evaluations_before_ + last_.done;
    last_.rate_per_s = spent_s > 0 ? static_cast<double>(done) / spent_s : 0;
    Pace pace{generation_, evaluations_of_others_ + done, spent_before_s_ + spent_s};
    if (last_.total > 0) {
      pace.share = static_cast<double>(last_.done) / static_cast<double>(last_.total);
    }
    pace.generations_here = generations_;
    pace.evaluations_here = done;
    pace.wall_here_s = spent_s;
    last_.time_left_s = time_left_s(run_.config.evolution, pace);
    const bool news = last_.look_at(farm_, wait_, now_s);
    watcher_.progress("evolve: " + (last_.waiting.empty() ? message(pace) : last_.waiting), news);
    if (now_s - written_s_ < kWriteInterval_s) return;
    written_s_ = now_s;
    events_.flush();
    last_.farm = farm_.tally();
    // The live row is a courtesy: a run goes on when it cannot be written, and a commit that cannot
    // be written stops it with the reason.
    if (Status s = store_.set_progress(last_); !s) watcher_.error(s.error());
  }

  RunStore& store_;
  Farm& farm_;
  const RunRequest& run_;
  FarmEventKeeper& events_;
  RunWatcher& watcher_;
  double began_s_ = monotonic_seconds(), spent_before_s_, written_s_ = -1e9;
  std::uint64_t evaluations_before_ = 0, generations_ = 0;  // of this life of the master
  std::uint64_t generation_ = 0;                            // of the run
  std::uint64_t evaluations_of_others_ = 0;                 // of earlier masters
  std::string best_;
  Progress last_;
  unsigned failures_ = 0;  // generations with some
  std::string failure_;
  WorkerWait wait_;
};

// What a user's program had no answer to since the last note, and the last that was asked of that.
class FailureNotes {
 public:
  // One note for `at_once` answers.
  FailureNotes(const Problem& problem, ProgressWriter& progress, std::size_t at_once)
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
  ProgressWriter& progress_;
  std::size_t at_once_;
  std::unordered_map<std::size_t, v1::Task> out_;  // by place
  std::size_t next_place_ = 0;
  std::size_t answered_ = 0, failed_ = 0, last_place_ = 0;
  std::string last_;
};

// Candidates to EvaluateTasks and back.  The arguments outlive it.
ScoreCandidates farm_scores(Farm& farm, const Problem& problem, std::uint64_t seed,
                            ProgressWriter& progress) {
  const std::string hash = farm.add_problem(to_proto(problem));
  return [&farm, &problem, &progress, seed, hash](std::vector<Candidate> candidates,
                                                  const TakeScore& take) {
    FailureNotes failures(problem, progress, candidates.size());
    const std::uint64_t before = progress.evaluations_before();
    const auto sent = [&](std::span<const Candidate> all) {
      auto tasks = mapped(all, [&](const Candidate& one) { return evaluation_task(one, seed); });
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

StoredGeneration stored_generation(const GenerationRecord& record, const Problem& problem) {
  StoredGeneration stored;
  stored.generation = record.generation;
  stored.diversity = record.diversity;
  stored.operator_probabilities = mapped(record.operator_probabilities, [](const NamedNumber& p) {
    return NamedValue{p.name, p.value};
  });
  stored.evaluations = record.evaluations;
  stored.wall_s = record.wall_s;
  stored.optimiser_state = record.optimiser_state;
  const FitnessKind kind = problem.fitness.kind;
  for (const auto& [birth_id, genome, standing, parents, origin] : record.members) {
    StoredIndividual& individual = stored.individuals.emplace_back();
    individual.birth_id = birth_id;
    individual.genome = genome;
    individual.values = readable_values(problem, genome);
    individual.outcome = v1::Outcome_Name(standing.outcome);
    if (standing.outcome == v1::OK) individual.fitness = fitness_of_cost(kind, standing.cost);
    individual.scores = standing.scores;
    individual.parents = parents;
    individual.operators = origin_name(origin);
    for (std::size_t m = 0; m < standing.costs.size(); ++m) {
      const auto& [name, maximise] = problem.fitness.objectives[m];
      individual.objectives.emplace_back(name, maximise ? -standing.costs[m] : standing.costs[m]);
    }
  }
  summarise_fitness(stored, higher_is_better(kind));
  return stored;
}

// What a run without a best to leave has to say.
std::string without_best(const EvolveSummary& evolved) {
  if (!evolved.best || evolved.best->standing.outcome == v1::OK) return {};
  if (evolved.best->standing.outcome != v1::INFEASIBLE) return "; no evaluation ended well";
  return fmt::format("; nothing feasible was found, violations sum to {:.6g} at least",
                     evolved.best->standing.cost);
}

Status write_end(RunStore& store, Progress progress, RunState state, const std::string& reason) {
  progress.state = state;
  progress.stop_reason = reason;
  progress.rate_per_s = 0;
  progress.time_left_s.reset();
  return store.set_progress(progress);
}

}  // namespace

Error stopped_by(RunStore& store, Error error, const Progress& last) {
  // Where even that cannot be written, status finds the master gone, and the error is reported.
  static_cast<void>(write_end(store, last, RunState::kStopped, error.message));
  return error;
}

Result<RunSummary> evolve_run(RunStore& store, const RunRequest& request, RunWatcher& watcher) {
  const auto checkpoint = store.checkpoint();
  if (!checkpoint) return stopped_by(store, checkpoint.error());
  const auto plan = read_stages(request.config);
  if (!plan) return stopped_by(store, plan.error());
  const auto held_out = read_validation(*plan, request.config);
  if (!held_out) return stopped_by(store, held_out.error());
  EvolveOptions options;
  options.settings = request.config.evolution;
  options.fitness = request.problem.fitness.kind;
  options.spent_s = *checkpoint ? (*checkpoint)->wall_s : 0;
  options.began_s = monotonic_seconds();
  FarmEventKeeper events(store, watcher);
  auto farm = request.open_farm([&](const FarmEvent& event) { events.keep(event); });
  if (!farm) return stopped_by(store, farm.error());
  auto optimiser = optimiser_of(request, *plan, *checkpoint, **farm, watcher);
  if (!optimiser) {
    events.flush();
    Progress last;
    last.farm = (*farm)->tally();
    return stopped_by(store, optimiser.error(), last);
  }
  ProgressWriter progress(store, **farm, request, *checkpoint,
                          options.spent_s + monotonic_seconds() - *options.began_s, events,
                          watcher);
  std::uint64_t given_up = 0;  // by this master's farm, in the generations that are committed
  const auto commit = [&](const GenerationRecord& record) -> Status {
    RETURN_IF_ERROR(store.set_numeric_class((*farm)->numeric_class()));
    StoredGeneration stored = stored_generation(record, request.problem);
    stored.quarantined = static_cast<unsigned>((*farm)->given_up() - given_up);
    given_up = (*farm)->given_up();
    RETURN_IF_ERROR(store.commit(stored));
    progress.on_generation(record, stored.best);
    return {};
  };
  auto evolved =
      evolve(**optimiser, farm_scores(**farm, request.problem, request.config.seed, progress),
             commit, monotonic_seconds, options, request.stop_requested);
  watcher.progress("", false);
  events.flush();
  if (!evolved) return stopped_by(store, evolved.error(), progress.now());
  RunSummary summary;
  summary.evolved = *std::move(evolved);
  summary.failure = progress.failure();
  summary.evolved.text += without_best(summary.evolved);
  const RunState state = summary.stopped() ? RunState::kStopped : RunState::kFinished;
  RETURN_IF_ERROR(write_end(store, progress.now(), state, summary.evolved.text));
  if (summary.stopped()) return summary;
  if (summary.evolved.best && summary.evolved.best->standing.outcome == v1::OK) {
    const Status left = write_outputs(store, request, *held_out, **farm, watcher, &summary);
    // Finished is what has its model; resumed, it only leaves that behind.
    if (!left) return stopped_by(store, left.error(), progress.now());
  }
  // Of earlier masters' generations too, and of what was done after the last one.
  ASSIGN_OR_RETURN(const auto quarantined, store.quarantined());
  summary.given_up = quarantined + (*farm)->given_up() - given_up;
  return summary;
}

}  // namespace gapfarm
