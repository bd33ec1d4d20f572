#include "master/store/run_reader.h"

#include <cstring>
#include <nlohmann/json.hpp>

#include "common/json/fields.h"
#include "master/store/run_lock.h"
#include "master/store/schema.h"

namespace gapfarm {
namespace {

constexpr std::int64_t kSchemaWithIncidents = 2;
constexpr std::int64_t kSchemaWithDocuments = 3;
constexpr std::int64_t kSchemaWithWorkerEvents = 4;
constexpr std::int64_t kSchemaWithObjectives = 5;

std::vector<double> genome_of(const std::string& blob) {
  std::vector<double> genome(blob.size() / sizeof(double));
  std::memcpy(genome.data(), blob.data(), genome.size() * sizeof(double));
  return genome;
}

// Of member_columns(), the first being column `at`.
StoredIndividual individual_of(const SqlStatement& row, int at) {
  StoredIndividual individual;
  std::string genome, parents, objectives;
  row.read_from(at, individual.birth_id, genome, individual.values, individual.outcome,
                individual.fitness, individual.scores, parents, individual.operators, objectives);
  if (!objectives.empty()) {
    const Json values = parse_json(objectives);
    for (const auto& [name, value] : values.items()) {
      if (value.is_number()) individual.objectives.emplace_back(name, value.get<double>());
    }
  }
  individual.genome = genome_of(genome);
  for (const Json& parent : parse_json(parents)) {
    if (parent.is_number_unsigned()) individual.parents.push_back(parent.get<std::uint64_t>());
  }
  return individual;
}

// The first of these, which are best first, unless not even that one ended well.
std::optional<StoredIndividual> best_of(std::vector<StoredIndividual> members) {
  if (members.empty()) return {};
  StoredIndividual& best = members.front();
  if (best.outcome != "OK" && best.outcome != "INFEASIBLE") return {};
  return std::move(best);
}

StoredGeneration generation_of(const SqlStatement& row) {
  StoredGeneration g;
  std::string operators;
  row.read_all(g.generation, g.best, g.mean, g.median, g.worst, g.diversity, operators,
               g.evaluations, g.wall_s, g.quarantined, g.digest);
  const Json probabilities = parse_json(operators);
  for (const auto& [name, probability] : probabilities.items()) {
    if (!probability.is_number()) continue;
    g.operator_probabilities.emplace_back(name, probability.get<double>());
  }
  return g;
}

// Masters beat about once a second; thirty missed ones are more than a slow disk.
constexpr double kFreshHeartbeat_s = 30;

bool master_lives(const RunReader& reader, const std::string& host, double heartbeat_age_s) {
  // A kept copy of a store has no master of its own.
  if (!std::filesystem::is_directory(reader.run())) return false;
  return holder_lives(reader.run(), host, heartbeat_age_s, kFreshHeartbeat_s);
}

Json to_json(const Incident& incident) {
  return {{"kind", incident_name(incident.kind)},
          {"generation", incident.generation},
          {"time", incident.unix_s},
          {"text", incident.text}};
}

}  // namespace

Result<RunReader> RunReader::open(const std::filesystem::path& run) {
  const std::filesystem::path file = run_store_file(run);
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return no_run_in(run);
  ASSIGN_OR_RETURN(Database database, Database::open(file, Database::Mode::kQueryOnly));
  RETURN_IF_ERROR(check_run_store(database));
  ASSIGN_OR_RETURN(RunInfo info, load_run_info(database));
  ASSIGN_OR_RETURN(const std::int64_t schema, run_store_schema(database));
  RunReader reader(run, std::move(database));
  reader.schema_ = schema;
  reader.info_ = std::move(info);
  return reader;
}

Result<std::vector<StoredGeneration>> RunReader::generations() const {
  return database_.rows(
      "read the generations",
      "SELECT generation, best, mean, median, worst, diversity, operator_probabilities, "
      "evaluations, wall_s, quarantined, digest FROM generations ORDER BY generation",
      generation_of);
}

Result<std::string> RunReader::optimiser_state(std::uint64_t generation) const {
  ASSIGN_OR_RETURN(
      const auto state,
      database_.row(
          "read the search's state", "SELECT optimiser_state FROM generations WHERE generation = ?",
          [](const SqlStatement& row) { return row.text(0); }, generation));
  return state.value_or(std::string());
}

std::string RunReader::member_columns() const {
  return std::string(
             "birth_id, genome, parameters, outcome, fitness, scores, parents, operators, ") +
         (schema_ < kSchemaWithObjectives ? "''" : "objectives");
}

Result<std::vector<StoredIndividual>> RunReader::individuals(std::uint64_t generation) const {
  return database_.rows(
      "read the individuals",
      "SELECT " + member_columns() + " FROM individuals WHERE generation = ? ORDER BY rank",
      [](const SqlStatement& row) { return individual_of(row, 0); }, generation);
}

Result<std::vector<RunReader::Member>> RunReader::members(const std::string& where,
                                                          std::int64_t bound) const {
  return database_.rows(
      "read the individuals",
      "SELECT generation, " + member_columns() + " FROM individuals " + where,
      [](const SqlStatement& row) {
        return Member{static_cast<std::uint64_t>(row.integer(0)), individual_of(row, 1)};
      },
      bound);
}

Result<std::optional<RunReader::Member>> RunReader::member(std::uint64_t birth_id) const {
  ASSIGN_OR_RETURN(auto found, members("WHERE birth_id = ? ORDER BY generation LIMIT 1",
                                       static_cast<std::int64_t>(birth_id)));
  if (found.empty()) return std::optional<Member>();
  return std::optional<Member>(std::move(found.front()));
}

Result<std::vector<RunReader::Member>> RunReader::given_up(std::size_t most) const {
  return members(
      "WHERE generation IN (SELECT generation FROM generations WHERE quarantined > 0) AND outcome "
      "= 'WORKER_FAILED' ORDER BY generation DESC, birth_id LIMIT ?",
      static_cast<std::int64_t>(most));
}

Result<std::vector<StoredWorkerEvent>> RunReader::worker_events(std::size_t most) const {
  if (schema_ < kSchemaWithWorkerEvents) return std::vector<StoredWorkerEvent>();
  return database_.rows(
      "read who came and went",
      "SELECT time, kind, worker, host, text FROM (SELECT rowid AS place, * FROM worker_events "
      "ORDER BY rowid DESC LIMIT ?) ORDER BY place",
      [](const SqlStatement& row) {
        StoredWorkerEvent e;
        row.read_all(e.unix_s, e.kind, e.worker, e.host, e.text);
        return e;
      },
      most);
}

Result<std::optional<StoredIndividual>> RunReader::best() const {
  ASSIGN_OR_RETURN(
      const std::int64_t last,
      database_.integer("SELECT max(generation) FROM generations", "read the generations"));
  ASSIGN_OR_RETURN(std::vector<StoredIndividual> all,
                   individuals(static_cast<std::uint64_t>(last)));
  return best_of(std::move(all));
}

Result<std::vector<Incident>> RunReader::incidents() const {
  if (schema_ < kSchemaWithIncidents) return std::vector<Incident>();
  return database_.rows("read the incidents",
                        "SELECT generation, kind, time, text FROM incidents ORDER BY rowid",
                        [](const SqlStatement& row) {
                          Incident incident;
                          std::string kind;
                          row.read_all(incident.generation, kind, incident.unix_s, incident.text);
                          for (const auto known : {IncidentKind::kAlarm, IncidentKind::kFailure}) {
                            if (kind == incident_name(known)) incident.kind = known;
                          }
                          return incident;
                        });
}

Result<std::optional<StoredDocument>> RunReader::document(const std::string& name) const {
  if (schema_ < kSchemaWithDocuments) return std::optional<StoredDocument>();
  return database_.row(
      "read " + name, "SELECT generation, content FROM documents WHERE name = ?",
      [](const SqlStatement& row) {
        StoredDocument document;
        row.read_all(document.generation, document.json);
        return document;
      },
      name);
}

Result<Progress> RunReader::progress() const {
  ASSIGN_OR_RETURN(
      const auto found,
      database_.row("read the progress",
                    "SELECT state, stop_reason, pid, host, heartbeat, rate_per_s, time_left_s, "
                    "done, total, workers, epoch, " +
                        std::string(schema_ < kSchemaWithIncidents ? "'{}'" : "farm") +
                        " FROM progress",
                    [](const SqlStatement& row) {
                      Progress p;
                      std::string state, reason, workers, farm;
                      row.read_all(state, reason, p.pid, p.host, p.heartbeat_unix_s, p.rate_per_s,
                                   p.time_left_s, p.done, p.total, workers, p.epoch, farm);
                      p.state = run_state_of(state);
                      (p.running() ? p.waiting : p.stop_reason) = reason;
                      p.workers = workers_of(parse_json(workers));
                      read_farm(farm, &p);
                      return p;
                    }));
  return found.value_or(Progress());
}

Result<RunStatus> run_status(const RunReader& reader, double now_unix_s) {
  RunStatus status;
  status.info = reader.info();
  ASSIGN_OR_RETURN(static_cast<Progress&>(status), reader.progress());
  status.heartbeat_age_s = now_unix_s - status.heartbeat_unix_s;

  ASSIGN_OR_RETURN(const std::vector<StoredGeneration> generations, reader.generations());
  for (const StoredGeneration& generation : generations) {
    status.best_by_generation.push_back(generation.best);
    status.wall_s += generation.wall_s;
    status.quarantined += generation.quarantined;
  }
  ASSIGN_OR_RETURN(status.incidents, reader.incidents());
  if (!generations.empty()) status.last = generations.back();
  for (const Incident& incident : status.incidents) {
    const bool counted = incident.generation <= status.last.generation;  // with its generation
    status.quarantined += incident.kind == IncidentKind::kQuarantine && !counted ? 1 : 0;
  }
  // By number, not "the last": another generation may have been committed meanwhile.
  ASSIGN_OR_RETURN(std::vector<StoredIndividual> members,
                   reader.individuals(status.last.generation));
  status.best_individual = best_of(std::move(members));

  ASSIGN_OR_RETURN(status.front, run_front(reader, generations));

  status.judge(master_lives(reader, status.host, status.heartbeat_age_s));
  if (!status.running()) {
    const double evaluations = static_cast<double>(status.last.evaluations);
    status.rate_per_s = status.wall_s > 0 ? evaluations / status.wall_s : 0;
  }
  return status;
}

Json search_start(const RunInfo& info) {
  const Json overrides = parse_json(info.overrides);
  const bool has = overrides.is_object() && overrides.contains("start");
  return has && overrides["start"].is_object() ? overrides["start"] : Json();
}

std::string search_start_text(const RunInfo& info) {
  const Json start = search_start(info);
  if (start.is_null()) return {};
  const auto list = [&](const char* key) { return start.value(key, Json::array()); };
  const auto word = [](const Json& json) {
    return json.is_string() ? json.get<std::string>() : json_text(json);
  };
  std::string text = word(start.value("from", Json("")));
  if (!start.contains("generation")) {
    return text + ", genomes: " + std::to_string(list("genomes").size());
  }
  text += " after generation " + json_text(start["generation"]);
  std::string changes;
  for (const Json& fixed : list("fixed")) changes += ", " + word(fixed) + " fixed";
  for (const Json& freed : list("freed")) changes += ", " + word(freed) + " freed";
  return text + (changes.empty() ? "" : ":" + changes.substr(1));
}

Json to_json(const RunStatus& status) {
  Json json;
  json["state"] = run_state_name(status.state);
  json["stop_reason"] = status.stop_reason;
  json["waiting"] = status.waiting;
  json["generation"] = status.last.generation;
  json["evaluations"] = status.last.evaluations;
  json["best_fitness"] = number_or_null(status.last.best);
  json["mean_fitness"] = number_or_null(status.last.mean);
  json["worst_fitness"] = number_or_null(status.last.worst);
  json["rate_per_s"] = status.rate_per_s;
  json["time_left_s"] = number_or_null(status.time_left_s);
  json["digest"] = status.last.digest;
  json["workers"] = workers_json(status.workers);
  json["quarantined"] = status.quarantined;
  Json& incidents = json["incidents"] = Json::array();
  for (const Incident& incident : status.incidents) incidents.push_back(to_json(incident));
  json["farm"] = to_json(status.farm);
  json["fleets"] = fleets_json(status.fleets);
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
  if (Json start = search_start(status.info); !start.is_null()) {
    start.erase("genomes");
    start.erase("spread");
    json["start"] = std::move(start);
  }
  json["epoch"] = status.epoch;
  json["heartbeat_age_s"] = status.heartbeat_age_s;
  if (!status.front.objectives.empty()) json["front"] = to_json(status.front);
  if (status.best_individual) {
    json["best"] = {{"birth_id", status.best_individual->birth_id},
                    {"values", values_json(*status.best_individual)}};
  }
  return json;
}

}  // namespace gapfarm
