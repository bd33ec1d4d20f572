#include "master/store/run_reader.h"

#include <cstring>
#include <nlohmann/json.hpp>

#include "common/base/try.h"
#include "common/json/json.h"
#include "master/store/run_status.h"
#include "master/store/schema.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::int64_t kSchemaWithIncidents = 2;
constexpr std::int64_t kSchemaWithDocuments = 3;
constexpr std::int64_t kSchemaWithWorkerEvents = 4;

constexpr const char* kMemberColumns =
    "birth_id, genome, parameters, outcome, fitness, scores, parents, operators";

std::vector<double> genome_of(const std::string& blob) {
  std::vector<double> genome(blob.size() / sizeof(double));
  std::memcpy(genome.data(), blob.data(), genome.size() * sizeof(double));
  return genome;
}

RunState state_of(const std::string& name) {
  for (const RunState state : {RunState::kRunning, RunState::kFinished}) {
    if (name == run_state_name(state)) return state;
  }
  return RunState::kStopped;
}

// Of kMemberColumns, the first being column `at`.
StoredIndividual individual_of(const SqlStatement& row, int at) {
  StoredIndividual individual;
  std::string genome, parents;
  row.read_from(at, individual.birth_id, SqlBlob{genome}, individual.values, individual.outcome,
                individual.fitness, individual.scores, parents, individual.operators);
  individual.genome = genome_of(genome);
  for (const Json& parent : parse_json(parents)) {
    if (parent.is_number_unsigned()) individual.parents.push_back(parent.get<std::uint64_t>());
  }
  return individual;
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

}  // namespace

Result<RunReader> RunReader::open(const std::filesystem::path& run) {
  const std::filesystem::path file = run_store_file(run);
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) {
    return Error{run.string() +
                 ": holds no run and no other long command (there is neither a run.sqlite nor a "
                 "simulations.sqlite with one); give the folder that --out names"};
  }
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

Result<std::vector<StoredIndividual>> RunReader::individuals(std::uint64_t generation) const {
  return database_.rows(
      "read the individuals",
      std::string("SELECT ") + kMemberColumns +
          " FROM individuals WHERE generation = ? ORDER BY rank",
      [](const SqlStatement& row) { return individual_of(row, 0); }, generation);
}

Result<std::vector<RunReader::Member>> RunReader::members(const std::string& where,
                                                          std::int64_t bound) const {
  return database_.rows(
      "read the individuals",
      "SELECT generation, " + std::string(kMemberColumns) + " FROM individuals " + where,
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
  if (all.empty()) return std::optional<StoredIndividual>{};
  return std::optional<StoredIndividual>(std::move(all.front()));
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
      database_.row(
          "read the progress",
          "SELECT state, stop_reason, pid, host, heartbeat, rate_per_s, time_left_s, done, total, "
          "workers, epoch, " +
              std::string(schema_ < kSchemaWithIncidents ? "'{}'" : "farm") + " FROM progress",
          [](const SqlStatement& row) {
            Progress p;
            std::string state, reason, workers, farm;
            row.read_all(state, reason, p.pid, p.host, p.heartbeat_unix_s, p.rate_per_s,
                         p.time_left_s, p.done, p.total, workers, p.epoch, farm);
            p.state = state_of(state);
            (p.state == RunState::kRunning ? p.waiting : p.stop_reason) = reason;
            p.workers = workers_of(parse_json(workers));
            FarmTally::read_farm(farm, &p);
            return p;
          }));
  return found.value_or(Progress());
}

}  // namespace gapfarm
