#include "master/store/run_status.h"

#include <nlohmann/json.hpp>

#include "common/base/host.h"
#include "common/base/try.h"
#include "common/json/fields.h"
#include "common/json/json.h"
#include "master/store/run_lock.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

// Masters beat about once a second; thirty missed ones are more than a slow disk.
constexpr double kFreshHeartbeat_s = 30;

bool master_lives(const RunReader& reader, const Progress& progress, double heartbeat_age_s) {
  if (progress.state != RunState::kRunning) return false;
  // A kept copy of a store has no master of its own.
  if (!std::filesystem::is_directory(reader.run())) return false;
  const std::optional<bool> held = run_lock_held(reader.run());
  if (held.value_or(false)) return true;
  const bool blind = !held || progress.host != host_name();
  return blind && heartbeat_age_s < kFreshHeartbeat_s;
}

Json to_json(const Incident& incident) {
  return {{"kind", incident_name(incident.kind)},
          {"generation", incident.generation},
          {"time", incident.unix_s},
          {"text", incident.text}};
}

}  // namespace

Result<RunStatus> run_status(const RunReader& reader, double now_unix_s) {
  RunStatus status;
  status.info = reader.info();
  ASSIGN_OR_RETURN(Progress progress, reader.progress());
  status.progress = std::move(progress);
  status.heartbeat_age_s = now_unix_s - status.progress.heartbeat_unix_s;

  ASSIGN_OR_RETURN(const std::vector<StoredGeneration> generations, reader.generations());
  for (const StoredGeneration& generation : generations) {
    status.best_by_generation.push_back(generation.best);
    status.wall_s += generation.wall_s;
    status.quarantined += generation.quarantined;
  }
  ASSIGN_OR_RETURN(std::vector<Incident> incidents, reader.incidents());
  status.incidents = std::move(incidents);
  if (!generations.empty()) {
    const StoredGeneration& last = generations.back();
    status.generation = last.generation;
    status.evaluations = last.evaluations;
    status.best = last.best;
    status.mean = last.mean;
    status.worst = last.worst;
    status.digest = last.digest;
  }
  for (const Incident& incident : status.incidents) {
    const bool counted = incident.generation <= status.generation;  // with its generation
    status.quarantined += incident.kind == IncidentKind::kQuarantine && !counted ? 1 : 0;
  }
  // By number, not "the last": another generation may have been committed meanwhile.
  ASSIGN_OR_RETURN(const std::vector<StoredIndividual> members,
                   reader.individuals(status.generation));
  if (!members.empty()) status.best_individual = members.front();

  status.state = status.progress.state;
  status.stop_reason = status.progress.stop_reason;
  if (status.state == RunState::kRunning &&
      !master_lives(reader, status.progress, status.heartbeat_age_s)) {
    status.state = RunState::kStopped;
    status.stop_reason = "crashed: process " + std::to_string(status.progress.pid) + " on " +
                         status.progress.host + " is gone without a word";
  }
  if (status.state == RunState::kRunning) {
    status.rate_per_s = status.progress.rate_per_s;
    status.time_left_s = status.progress.time_left_s;
  } else {
    // Of a run that is over, what it did on the whole.
    const double evaluations = static_cast<double>(status.evaluations);
    status.rate_per_s = status.wall_s > 0 ? evaluations / status.wall_s : 0;
    if (status.state == RunState::kFinished) status.time_left_s = 0;
    status.progress.workers.clear();
    status.progress.fleets.clear();
  }
  return status;
}

Json to_json(const RunStatus& status) {
  Json json;
  json["state"] = run_state_name(status.state);
  json["stop_reason"] = status.stop_reason;
  json["waiting"] = status.state == RunState::kRunning ? status.progress.waiting : "";
  json["generation"] = status.generation;
  json["evaluations"] = status.evaluations;
  json["best_fitness"] = number_or_null(status.best);
  json["mean_fitness"] = number_or_null(status.mean);
  json["worst_fitness"] = number_or_null(status.worst);
  json["rate_per_s"] = status.rate_per_s;
  json["time_left_s"] = number_or_null(status.time_left_s);
  json["digest"] = status.digest;
  json["workers"] = workers_json(status.progress.workers);
  json["quarantined"] = status.quarantined;
  Json& incidents = json["incidents"] = Json::array();
  for (const Incident& incident : status.incidents) incidents.push_back(to_json(incident));
  Json& farm = json["farm"] = Json::object();
  for (const FarmTally::Row& row : FarmTally::kRows) {
    farm[row.key] = status.progress.farm.*row.count;
  }
  json["fleets"] = fleets_json(status.progress.fleets);
  json["fitness"] = status.info.fitness;
  json["fitness_unit"] = status.info.fitness_unit;
  json["higher_is_better"] = status.info.higher_is_better;
  json["wall_s"] = status.wall_s;
  json["seed"] = status.info.seed;
  json["problem"] = status.info.problem_hash;
  json["numeric_class"] = status.info.numeric_class;
  json["program_version"] = status.info.program_version;
  json["fingerprint"] = status.info.fingerprint;
  json["created"] = status.info.created;
  json["config"] = status.info.config_path;
  json["epoch"] = status.progress.epoch;
  json["heartbeat_age_s"] = status.heartbeat_age_s;
  if (status.best_individual) {
    const Json values = parse_json(status.best_individual->values);
    json["best"] = {{"birth_id", status.best_individual->birth_id},
                    {"values", values.is_discarded() ? Json(nullptr) : values}};
  }
  return json;
}

}  // namespace gapfarm
