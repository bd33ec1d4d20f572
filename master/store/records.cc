#include "master/store/records.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>

#include "common/base/hash.h"
#include "common/base/ranges.h"
#include "common/json/fields.h"
#include "common/math/fronts.h"
#include "gapfarm/v1/problem.pb.h"
#include "master/store/answer_store.h"
#include "master/store/run_lock.h"
#include "master/store/run_reader.h"

namespace gapfarm {

const char* run_state_name(RunState state) {
  constexpr const char* kNames[] = {"", "running", "finished", "stopped", "failed"};
  return kNames[static_cast<std::size_t>(state)];
}

namespace {

constexpr RunState kRunStates[] = {RunState::kRunning, RunState::kFinished, RunState::kStopped,
                                   RunState::kFailed};

}  // namespace

RunState run_state_of(const std::string& name) {
  const auto* found = std::ranges::find(kRunStates, name, run_state_name);
  return found == std::end(kRunStates) ? RunState::kUnknown : *found;
}

Json to_json(const FarmTally& tally) {
  Json json = Json::object();
  for (const FarmTally::Row& row : FarmTally::kRows) json[row.key] = tally.*row.count;
  return json;
}

std::string farm_json(const FarmTally& tally, const Progress& progress) {
  Json json = to_json(tally);
  if (!progress.listen.empty()) json["listen"] = progress.listen;
  if (!progress.fleets.empty()) json["fleets"] = fleets_json(progress.fleets);
  return json_text(json);
}

void read_farm(const std::string& text, Progress* progress) {
  const auto json = parse_json(text);
  if (!json.is_object()) return;
  for (const FarmTally::Row& row : FarmTally::kRows) {
    const auto found = json.find(row.key);
    if (found != json.end() && found->is_number_unsigned()) {
      progress->farm.*row.count = found->get<std::uint64_t>();
    }
  }
  FieldReader(json).field("listen", progress->listen);
  progress->fleets = fleets_of(json.value("fleets", Json()));
}

const char* incident_name(IncidentKind kind) {
  if (kind == IncidentKind::kFailure) return "failure";
  return kind == IncidentKind::kAlarm ? "alarm" : "quarantine";
}

std::string readable_values(const Problem& problem, const Genome& genome) {
  const ParameterTable& table = problem.table();
  const ParameterValues values = problem.values_of(genome);
  Json json = Json::object();
  for (const Gene& gene : problem.genes) {
    const Parameter& row = table[gene.row];
    const double value = values[gene.row];
    switch (row.kind) {
      case ParameterKind::kReal:
        json[row.key] = value;
        break;
      case ParameterKind::kInteger:
        json[row.key] = static_cast<std::int64_t>(value);
        break;
      case ParameterKind::kBoolean:
        json[row.key] = value != 0;
        break;
      case ParameterKind::kChoice:
        json[row.key] = row.choices.at(static_cast<std::size_t>(value));
        break;
    }
  }
  return json_text(json);
}

void summarise_fitness(StoredGeneration& generation, bool higher_is_better) {
  auto fitness = filtered(
      generation.individuals, [](auto& individual) { return individual.fitness.has_value(); },
      [](auto& individual) { return *individual.fitness; });
  generation.best = generation.mean = generation.median = generation.worst = std::nullopt;
  if (fitness.empty()) return;
  generation.best = generation.individuals.front().fitness;
  std::ranges::sort(fitness);
  const std::size_t n = fitness.size();
  generation.worst = higher_is_better ? fitness.front() : fitness.back();
  generation.mean = std::accumulate(fitness.begin(), fitness.end(), 0.0) / static_cast<double>(n);
  generation.median = 0.5 * (fitness[(n - 1) / 2] + fitness[n / 2]);
}

std::string generation_digest(const std::string& previous, const StoredGeneration& generation) {
  Hasher hasher;
  hasher.add(std::string_view(previous)).add(generation.generation);
  hasher.add(static_cast<std::uint64_t>(generation.individuals.size()));
  for (const StoredIndividual& individual : generation.individuals) {
    hasher.add(individual.birth_id);
    hasher.add(static_cast<std::uint64_t>(individual.genome.size()));
    for (const double gene : individual.genome) hasher.add(gene);
    hasher.add(std::string_view(individual.outcome));
    hasher.add(static_cast<std::uint64_t>(individual.fitness.has_value()));
    hasher.add(individual.fitness.value_or(0.0));
    hasher.add(static_cast<std::uint64_t>(individual.scores));
    for (const auto& [name, value] : individual.objectives) hasher.add(value);
  }
  return hasher.finish();
}

namespace {

// Members that ended well, with their objectives.
std::vector<StoredIndividual> complete(std::vector<StoredIndividual> members,
                                       std::size_t objectives) {
  std::erase_if(members, [&](const StoredIndividual& member) {
    return member.objectives.size() != objectives;
  });
  return members;
}

std::vector<Costs> all_costs(const RunFront& front, const std::vector<StoredIndividual>& members) {
  return mapped(members, [&](const StoredIndividual& member) { return front.costs(member); });
}

// Costs of the objectives' own senses, and back.
std::vector<double> turned(const RunFront& front, std::vector<double> values) {
  for (std::size_t m = 0; m < values.size(); ++m) {
    if (front.objectives[m].maximise) values[m] = -values[m];
  }
  return values;
}

}  // namespace

std::vector<double> RunFront::costs(const StoredIndividual& member) const {
  return turned(*this, mapped(member.objectives, &NamedValue::second));
}

Result<RunFront> run_front(const RunReader& reader,
                           const std::vector<StoredGeneration>& generations) {
  RunFront front;
  v1::Problem problem;
  if (!problem.ParseFromString(reader.info().problem)) return front;
  for (const v1::SearchedObjective& objective : problem.fitness().objectives()) {
    front.objectives.push_back({objective.name(), objective.maximise()});
  }
  const std::size_t objectives = front.objectives.size();
  if (objectives == 0 || generations.empty()) return front;
  for (const StoredGeneration& generation : generations) {
    std::optional<double>& volume = front.hypervolume.emplace_back();
    for (const auto& [name, value] : generation.operator_probabilities) {
      if (name == "hypervolume") volume = value;
    }
    if (!front.reference.empty()) continue;
    ASSIGN_OR_RETURN(auto members, reader.individuals(generation.generation));
    members = complete(std::move(members), objectives);
    if (members.empty()) continue;
    front.reference = turned(front, greatest_of(all_costs(front, members)));
  }
  ASSIGN_OR_RETURN(auto last, reader.individuals(generations.back().generation));
  last = complete(std::move(last), objectives);
  if (last.empty()) return front;
  const std::uint64_t best = last.front().birth_id;
  for (const std::size_t i : first_front(all_costs(front, last))) front.members.push_back(last[i]);
  std::ranges::stable_sort(front.members, [](const StoredIndividual& a, const StoredIndividual& b) {
    return a.objectives.front().second < b.objectives.front().second;
  });
  for (std::size_t i = 0; i < front.members.size(); ++i) {
    if (front.members[i].birth_id == best) front.knee = i;
  }
  const std::vector<Costs> costs = all_costs(front, front.members);
  front.ideal = turned(front, least_of(costs));
  front.nadir = turned(front, greatest_of(costs));
  return front;
}

Json values_json(const StoredIndividual& member) {
  Json values = parse_json(member.values);
  return values.is_discarded() ? Json(nullptr) : values;
}

Json to_json(const RunFront& front) {
  Json objectives = Json::array(), members = Json::array();
  const auto at = [](const std::vector<double>& values, std::size_t m) {
    return m < values.size() ? Json(values[m]) : Json(nullptr);
  };
  for (std::size_t m = 0; m < front.objectives.size(); ++m) {
    objectives.push_back({{"name", front.objectives[m].name},
                          {"maximise", front.objectives[m].maximise},
                          {"ideal", at(front.ideal, m)},
                          {"nadir", at(front.nadir, m)},
                          {"reference", at(front.reference, m)}});
  }
  for (const StoredIndividual& member : front.members) {
    Json values = Json::object();
    for (const auto& [name, value] : member.objectives) values[name] = value;
    members.push_back({{"birth_id", member.birth_id},
                       {"objectives", std::move(values)},
                       {"fitness", number_or_null(member.fitness)},
                       {"values", values_json(member)}});
  }
  const Json knee =
      front.members.empty() ? Json(nullptr) : Json(front.members[front.knee].birth_id);
  return {{"objectives", std::move(objectives)},
          {"knee", knee},
          {"members", std::move(members)},
          {"hypervolume", mapped(front.hypervolume, number_or_null)}};
}

namespace {

// Commands beat about once a second, less often while they compute themselves.
constexpr double kFreshRecord_s = 120;

// Every object of the record, in the order of its fields.
constexpr auto kStage = [](auto& v, auto& row) {
  FIELDS(name);
  v.field("began", row.began_unix_s);
};
constexpr auto kStageFinding = [](auto& v, auto& row) {
  FIELDS(stage);
  v.field("about", row.found.about);
  v.field("text", row.found.text);
  v.field("columns", row.found.columns);
  v.field("rows", row.found.rows);
};
constexpr auto kWorker = [](auto& v, auto& row) {
  FIELDS(name, state, jobs, host, finished, rate_per_s);
};
constexpr auto kFleet = [](auto& v, auto& row) {
  FIELDS(name, system, host);
  v.field("asked", row.wanted);
  FIELDS(queued, running, lost, why);
};
constexpr auto kRecord = [](auto& v, auto& row) {
  FIELDS(command);
  v.choice("state", row.state, kRunStates, run_state_name);
  FIELDS(stop_reason, stage);
  v.field("stage_number", row.number);
  FIELDS(stages);
  v.list("plan", row.plan, kStage);
  v.list("findings", row.findings, kStageFinding);
  FIELDS(done, total, share, rate_per_s, time_left_s, remembered, simulated, waiting);
  v.list("workers", row.workers, kWorker);
  v.list("fleets", row.fleets, kFleet);
  FIELDS(listen);
  v.field("began", row.began_unix_s);
  v.field("heartbeat", row.heartbeat_unix_s);
  FIELDS(pid, host, arguments);
};

}  // namespace

void LiveStatus::listens(const Farm& farm) {
  for (const std::string& endpoint : farm.endpoints()) {
    if (listen.empty() && endpoint.rfind("tcp://", 0) == 0) listen = endpoint;
  }
}

bool LiveStatus::look_at(const Farm& farm, WorkerWait& wait, double now_s) {
  workers = farm.workers();
  fleets = farm.fleets();
  const auto there = std::ranges::count_if(
      workers, [](const WorkerStatus& worker) { return worker.state != "gone"; });
  const bool waited = !waiting.empty();
  waiting = wait.message(static_cast<std::size_t>(there), now_s).value_or("");
  return waited == waiting.empty();
}

void LiveStatus::leave() {
  waiting.clear();
  workers.clear();
  fleets.clear();
  listen.clear();
}

void LiveStatus::judge(bool lives) {
  if (running() && lives) return;
  if (running()) {
    state = RunState::kStopped;
    stop_reason =
        "crashed: process " + std::to_string(pid) + " on " + host + " is gone without a word";
  }
  time_left_s.reset();
  if (state == RunState::kFinished) time_left_s = 0;
  leave();
}

std::filesystem::path answer_file(const std::filesystem::path& folder) {
  return folder / "simulations.sqlite";
}

Json to_json(const CommandRecord& record) { return FieldWriter::written(record, kRecord); }

CommandRecord command_record_of(const Json& json) {
  return FieldReader::read<CommandRecord>(json, kRecord);
}

Json workers_json(const std::vector<WorkerStatus>& workers) {
  return FieldWriter::list(workers, kWorker);
}

std::vector<WorkerStatus> workers_of(const Json& json) {
  return FieldReader::rows<WorkerStatus>(json, kWorker);
}

Json fleets_json(const std::vector<FleetStatus>& fleets) {
  return FieldWriter::list(fleets, kFleet);
}

std::vector<FleetStatus> fleets_of(const Json& json) {
  return FieldReader::rows<FleetStatus>(json, kFleet);
}

Result<std::optional<CommandRecord>> command_status(const std::filesystem::path& folder,
                                                    double now_unix_s) {
  std::error_code ignored;
  if (!std::filesystem::exists(answer_file(folder), ignored)) {
    return std::optional<CommandRecord>();
  }
  ASSIGN_OR_RETURN(const auto text, read_command(answer_file(folder)));
  if (!text) return std::optional<CommandRecord>();
  CommandRecord record = command_record_of(parse_json(*text));
  const double age_s = now_unix_s - record.heartbeat_unix_s;
  record.judge(holder_lives(folder, record.host, age_s, kFreshRecord_s));
  return std::optional<CommandRecord>(std::move(record));
}

Error no_run_in(const std::filesystem::path& folder) {
  const std::string name = folder.string();
  const auto other = command_status(folder, 0);
  if (other && *other) {
    return {name + ": holds no run, but what this command left, which goes on with it: " +
            (*other)->arguments};
  }
  const bool is_file = std::filesystem::is_regular_file(folder);
  return {name + (is_file ? ": is no folder of a run" : ": holds no run (there is no run.sqlite)") +
          "; give the folder that --out named, or start one with `gapfarm evolve " +
          (is_file ? name + " --out FOLDER`" : "CONFIG --out " + name + "`")};
}

}  // namespace gapfarm
