#include "master/store/run_reader.h"

#include <cstring>
#include <nlohmann/json.hpp>

#include "common/json/json.h"
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
  individual.birth_id = static_cast<std::uint64_t>(row.integer(at));
  individual.genome = genome_of(row.blob(at + 1));
  individual.values = row.text(at + 2);
  individual.outcome = row.text(at + 3);
  individual.fitness = row.optional_real(at + 4);
  individual.scores = static_cast<unsigned>(row.integer(at + 5));
  for (const Json& parent : parse_json(row.text(at + 6))) {
    if (parent.is_number_unsigned()) individual.parents.push_back(parent.get<std::uint64_t>());
  }
  individual.operators = row.text(at + 7);
  return individual;
}

std::vector<StoredWorker> workers_of(const std::string& text) {
  std::vector<StoredWorker> workers;
  // What was written by hand or damaged reads as empty: status is no place to die over it.
  const Json json = parse_json(text);
  if (!json.is_array()) return workers;
  for (const Json& entry : json) {
    if (!entry.is_object()) continue;
    StoredWorker worker;
    worker.name = entry.value("name", "");
    worker.host = entry.value("host", "");
    worker.state = entry.value("state", "");
    worker.jobs = entry.value("jobs", 0u);
    worker.finished = entry.value("finished", std::uint64_t{0});
    worker.rate_per_s = entry.value("rate_per_s", 0.0);
    workers.push_back(std::move(worker));
  }
  return workers;
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
  Result<Database> database = Database::open(file, Database::Mode::kQueryOnly);
  if (!database) return database.error();
  if (Status s = check_run_store(*database); !s) return s.error();
  Result<RunInfo> info = load_run_info(*database);
  if (!info) return info.error();
  const Result<std::int64_t> schema = run_store_schema(*database);
  if (!schema) return schema.error();
  RunReader reader(run, std::move(*database));
  reader.schema_ = *schema;
  reader.info_ = std::move(*info);
  return reader;
}

Result<std::vector<StoredGeneration>> RunReader::generations() const {
  Result<SqlStatement> select = database_.prepare(
      "SELECT generation, best, mean, median, worst, diversity, operator_probabilities, "
      "evaluations, wall_s, quarantined, digest FROM generations ORDER BY generation",
      "read the generations");
  if (!select) return select.error();
  std::vector<StoredGeneration> generations;
  for (;;) {
    const Result<bool> row = select->step();
    if (!row) return row.error();
    if (!*row) return generations;
    StoredGeneration& generation = generations.emplace_back();
    generation.generation = static_cast<std::uint64_t>(select->integer(0));
    generation.best = select->optional_real(1);
    generation.mean = select->optional_real(2);
    generation.median = select->optional_real(3);
    generation.worst = select->optional_real(4);
    generation.diversity = select->real(5);
    const Json operators = parse_json(select->text(6));
    for (const auto& [name, probability] : operators.items()) {
      if (probability.is_number()) {
        generation.operator_probabilities.emplace_back(name, probability.get<double>());
      }
    }
    generation.evaluations = static_cast<std::uint64_t>(select->integer(7));
    generation.wall_s = select->real(8);
    generation.quarantined = static_cast<unsigned>(select->integer(9));
    generation.digest = select->text(10);
  }
}

Result<std::vector<StoredIndividual>> RunReader::individuals(std::uint64_t generation) const {
  Result<SqlStatement> select =
      database_.prepare(std::string("SELECT ") + kMemberColumns +
                            " FROM individuals WHERE generation = ? ORDER BY rank",
                        "read the individuals");
  if (!select) return select.error();
  select->bind(1, static_cast<std::int64_t>(generation));
  std::vector<StoredIndividual> individuals;
  for (;;) {
    const Result<bool> row = select->step();
    if (!row) return row.error();
    if (!*row) return individuals;
    individuals.push_back(individual_of(*select, 0));
  }
}

Result<std::vector<RunReader::Member>> RunReader::members(const std::string& where,
                                                          std::int64_t bound) const {
  Result<SqlStatement> select = database_.prepare(
      "SELECT generation, " + std::string(kMemberColumns) + " FROM individuals " + where,
      "read the individuals");
  if (!select) return select.error();
  select->bind(1, bound);
  std::vector<Member> members;
  for (;;) {
    const Result<bool> row = select->step();
    if (!row) return row.error();
    if (!*row) return members;
    members.push_back({static_cast<std::uint64_t>(select->integer(0)), individual_of(*select, 1)});
  }
}

Result<std::optional<RunReader::Member>> RunReader::member(std::uint64_t birth_id) const {
  auto found = members("WHERE birth_id = ? ORDER BY generation LIMIT 1",
                       static_cast<std::int64_t>(birth_id));
  if (!found) return found.error();
  if (found->empty()) return std::optional<Member>();
  return std::optional<Member>(std::move(found->front()));
}

Result<std::vector<RunReader::Member>> RunReader::given_up(std::size_t most) const {
  return members(
      "WHERE generation IN (SELECT generation FROM generations WHERE quarantined > 0) AND outcome "
      "= 'WORKER_FAILED' ORDER BY generation DESC, birth_id LIMIT ?",
      static_cast<std::int64_t>(most));
}

Result<std::vector<StoredWorkerEvent>> RunReader::worker_events(std::size_t most) const {
  std::vector<StoredWorkerEvent> events;
  if (schema_ < kSchemaWithWorkerEvents) return events;
  Result<SqlStatement> select = database_.prepare(
      "SELECT time, kind, worker, host, text FROM (SELECT rowid AS place, * FROM worker_events "
      "ORDER BY rowid DESC LIMIT ?) ORDER BY place",
      "read who came and went");
  if (!select) return select.error();
  select->bind(1, static_cast<std::int64_t>(most));
  for (;;) {
    const Result<bool> row = select->step();
    if (!row) return row.error();
    if (!*row) return events;
    events.push_back(
        {select->real(0), select->text(1), select->text(2), select->text(3), select->text(4)});
  }
}

Result<std::optional<StoredIndividual>> RunReader::best() const {
  const Result<std::int64_t> last =
      database_.integer("SELECT max(generation) FROM generations", "read the generations");
  if (!last) return last.error();
  Result<std::vector<StoredIndividual>> all = individuals(static_cast<std::uint64_t>(*last));
  if (!all) return all.error();
  if (all->empty()) return std::optional<StoredIndividual>{};
  return std::optional<StoredIndividual>(std::move(all->front()));
}

Result<std::vector<Incident>> RunReader::incidents() const {
  std::vector<Incident> incidents;
  if (schema_ < kSchemaWithIncidents) return incidents;
  Result<SqlStatement> select = database_.prepare(
      "SELECT generation, kind, time, text FROM incidents ORDER BY rowid", "read the incidents");
  if (!select) return select.error();
  for (;;) {
    const Result<bool> row = select->step();
    if (!row) return row.error();
    if (!*row) return incidents;
    const bool alarm = select->text(1) == incident_name(IncidentKind::kAlarm);
    incidents.push_back({alarm ? IncidentKind::kAlarm : IncidentKind::kQuarantine,
                         static_cast<std::uint64_t>(select->integer(0)), select->real(2),
                         select->text(3)});
  }
}

Result<std::optional<StoredDocument>> RunReader::document(const std::string& name) const {
  if (schema_ < kSchemaWithDocuments) return std::optional<StoredDocument>();
  Result<SqlStatement> select =
      database_.prepare("SELECT generation, content FROM documents WHERE name = ?", "read " + name);
  if (!select) return select.error();
  select->bind_text(1, name);
  const Result<bool> row = select->step();
  if (!row) return row.error();
  if (!*row) return std::optional<StoredDocument>();
  return std::optional<StoredDocument>(
      {static_cast<std::uint64_t>(select->integer(0)), select->text(1)});
}

Result<Progress> RunReader::progress() const {
  Result<SqlStatement> select = database_.prepare(
      "SELECT state, stop_reason, pid, host, heartbeat, rate_per_s, time_left_s, done, total, "
      "workers, epoch, " +
          std::string(schema_ < kSchemaWithIncidents ? "'{}'" : "farm") + " FROM progress",
      "read the progress");
  if (!select) return select.error();
  const Result<bool> row = select->step();
  if (!row) return row.error();
  Progress progress;
  if (!*row) return progress;
  progress.state = state_of(select->text(0));
  const bool running = progress.state == RunState::kRunning;
  (running ? progress.waiting : progress.stop_reason) = select->text(1);
  progress.pid = select->integer(2);
  progress.host = select->text(3);
  progress.heartbeat_unix_s = select->real(4);
  progress.rate_per_s = select->real(5);
  progress.time_left_s = select->optional_real(6);
  progress.done = static_cast<std::uint64_t>(select->integer(7));
  progress.total = static_cast<std::uint64_t>(select->integer(8));
  progress.workers = workers_of(select->text(9));
  progress.epoch = static_cast<std::uint64_t>(select->integer(10));
  progress.farm = FarmTally::from_json(select->text(11));
  return progress;
}

}  // namespace gapfarm
