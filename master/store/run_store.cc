#include "master/store/run_store.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <ctime>
#include <nlohmann/json.hpp>
#include <system_error>

#include "common/base/build_info.h"
#include "common/base/host.h"
#include "common/json/json.h"
#include "master/store/run_status.h"
#include "master/store/schema.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

// Forces a file's or folder's content to disk.
Status sync_to_disk(const fs::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool synced = fd >= 0 && ::fsync(fd) == 0;
  const int error = errno;
  if (fd >= 0) ::close(fd);
  if (synced) return {};
  return Error{path.string() + ": cannot write to disk: " + std::strerror(error) +
               "; check the disk"};
}

std::string_view genome_bytes(const std::vector<double>& genome) {
  return {reinterpret_cast<const char*>(genome.data()), genome.size() * sizeof(double)};
}

std::string operator_json(const StoredGeneration& generation) {
  Json json = Json::object();
  for (const auto& [name, probability] : generation.operator_probabilities) {
    json[name] = probability;
  }
  return json_text(json);
}

// Alarms stay: they are about machines, not about generations.
std::string forget_quarantines(std::uint64_t from) {
  return std::string("DELETE FROM incidents WHERE kind = '") +
         incident_name(IncidentKind::kQuarantine) + "' AND generation >= " + std::to_string(from);
}

// A path in `run` that is not taken: run.generation-41.sqlite, run.generation-41.2.sqlite, ...
fs::path free_backup_path(const fs::path& run, std::uint64_t generation) {
  const std::string stem = "run.generation-" + std::to_string(generation);
  fs::path path = run / (stem + ".sqlite");
  std::error_code ignored;
  for (int i = 2; fs::exists(path, ignored); ++i)
    path = run / (stem + "." + std::to_string(i) + ".sqlite");
  return path;
}

Status create_tables(Database& database, const RunInfo& info) {
  Result<SqlTransaction> transaction = SqlTransaction::begin(database);
  if (!transaction) return transaction.error();
  if (Status s = create_run_tables(database); !s) return s;
  if (Status s = insert_run_info(database, info); !s) return s;
  if (Status s = database.exec("INSERT INTO progress VALUES (1, 'stopped', '', 0, '', 0, 0, NULL, "
                               "0, 0, '[]', 0, '{}')",
                               "create the run store");
      !s) {
    return s;
  }
  return transaction->commit();
}

// Whether nothing is there, or what a creation leaves that was interrupted before its one
// transaction committed: an empty file, or a database without tables.
bool is_unborn(const fs::path& file) {
  std::error_code code;
  if (!fs::exists(file, code) || fs::file_size(file, code) == 0) return true;
  const Result<Database> database = Database::open(file, Database::Mode::kQueryOnly);
  if (!database) return false;
  const auto tables = database->integer("SELECT count(*) FROM sqlite_master", "look");
  const auto id = database->integer("PRAGMA application_id", "look");
  return tables && id && *tables == 0 && *id == 0;
}

}  // namespace

Result<RunStore> RunStore::create(const fs::path& run, const RunInfo& info) {
  std::error_code code;
  fs::create_directories(run, code);
  if (code) {
    return Error{run.string() + ": cannot make the run folder: " + code.message() +
                 "; choose another --out"};
  }
  Result<RunLock> lock = RunLock::take(run);
  if (!lock) return lock.error();
  const fs::path file = run / "run.sqlite";
  if (!is_unborn(file)) {
    return Error{run.string() + ": holds a run already; continue it with `gapfarm resume " +
                 run.string() + "`, or choose another --out"};
  }
  Result<Database> database = Database::open(file, Database::Mode::kCreate);
  if (!database) return database.error();
  RunInfo complete = info;
  if (complete.program_version.empty()) complete.program_version = build_info().version;
  if (complete.fingerprint.empty()) complete.fingerprint = build_info().fingerprint;
  complete.created = utc_now();
  if (Status s = create_tables(*database, complete); !s) return s.error();
  if (Status s = sync_to_disk(run); !s) return s.error();

  RunStore store(run, std::move(*lock), std::move(*database));
  store.info_ = std::move(complete);
  if (Status s = store.begin_epoch(); !s) return s.error();
  return store;
}

Status RunStore::discard(RunStore store, bool with_folder) {
  const fs::path run = store.run();
  {
    // Closed before its files go; the lock goes last.
    const Database closing = std::move(store.database_);
  }
  std::error_code code;
  for (const char* name :
       {"run.sqlite", "run.sqlite-wal", "run.sqlite-shm", "log.txt", "run.lock"}) {
    fs::remove(run / name, code);
    if (code) {
      return Error{(run / name).string() + ": cannot be taken away: " + code.message() +
                   "; delete it by hand"};
    }
  }
  if (with_folder && fs::is_empty(run, code)) fs::remove(run, code);
  return {};
}

Result<RunStore> RunStore::open(const fs::path& run) {
  const fs::path file = run / "run.sqlite";
  std::error_code missing;
  if (!fs::exists(file, missing)) {
    return Error{run.string() +
                 ": holds no run (there is no run.sqlite); start one with "
                 "`gapfarm evolve CONFIG --out " +
                 run.string() + "`"};
  }
  Result<RunLock> lock = RunLock::take(run);
  if (!lock) return lock.error();
  // Looked at before anything may be written to it: it could be another program's file.
  {
    const Result<Database> look = Database::open(file, Database::Mode::kQueryOnly);
    if (!look) return look.error();
    if (Status s = check_run_store(*look); !s) return s.error();
  }
  Result<Database> database = Database::open(file, Database::Mode::kWrite);
  if (!database) return database.error();
  Result<SqlStatement> damage = database->prepare("PRAGMA quick_check(1)", "check the run store");
  if (!damage) return damage.error();
  const Result<bool> checked = damage->step();
  if (!checked) return checked.error();
  if (damage->text(0) != "ok") {
    return Error{file.string() + ": the file is damaged (" + damage->text(0) +
                 "); restore a copy, or save what is left with `sqlite3 run.sqlite .recover`"};
  }
  if (Status s = upgrade_run_store(*database); !s) return s.error();
  Result<RunInfo> info = load_run_info(*database);
  if (!info) return info.error();

  RunStore store(run, std::move(*lock), std::move(*database));
  store.info_ = std::move(*info);
  const Result<std::optional<Checkpoint>> last = store.checkpoint();
  if (!last) return last.error();
  if (*last) {
    store.last_generation_ = (*last)->generation;
    store.digest_ = (*last)->digest;
  }
  if (Status s = store.begin_epoch(); !s) return s.error();
  return store;
}

Status RunStore::load_before() {
  Result<SqlStatement> before =
      database_.prepare("SELECT epoch, farm, heartbeat, host FROM progress", "read the run store");
  if (!before) return before.error();
  const Result<bool> row = before->step();
  if (!row) return row.error();
  if (!*row) {
    return Error{database_.file().string() +
                 ": table progress is empty: the file was changed by hand; restore a copy"};
  }
  epoch_ = static_cast<std::uint64_t>(before->integer(0)) + 1;
  farm_before_ = FarmTally::from_json(before->text(1));
  end_before_ = {before->real(2), "end", "", before->text(3),
                 "the last that was heard of a master"};
  return {};
}

Status RunStore::begin_epoch() {
  if (Status s = load_before(); !s) return s;
  std::vector<StoredWorkerEvent> events = {
      {unix_now_s(), "master", "", host_name(), "master " + std::to_string(epoch_) + " begins"}};
  if (epoch_ > 1) events.insert(events.begin(), end_before_);
  Result<SqlTransaction> transaction = SqlTransaction::begin(database_);
  if (!transaction) return transaction.error();
  if (Status s = database_.exec(forget_quarantines(next_generation()), "write the run store"); !s) {
    return s;
  }
  if (Status s = insert_worker_events(events); !s) return s;
  if (Status s = set_progress({}); !s) return s;
  return transaction->commit();
}

Result<std::uint64_t> RunStore::quarantined() const {
  const Result<std::int64_t> sum = database_.integer(
      "SELECT coalesce(sum(quarantined), 0) FROM generations", "read the generations");
  if (!sum) return sum.error();
  return static_cast<std::uint64_t>(*sum);
}

Result<std::string> RunStore::commit(const StoredGeneration& generation) {
  if (last_generation_ && generation.generation != *last_generation_ + 1) {
    return Error{database_.file().string() + ": generation " +
                 std::to_string(generation.generation) + " cannot follow generation " +
                 std::to_string(*last_generation_) + "; commit generations in order"};
  }
  const std::string digest = generation_digest(digest_, generation);
  Result<SqlTransaction> transaction = SqlTransaction::begin(database_);
  if (!transaction) return transaction.error();
  Result<SqlStatement> insert = database_.prepare(
      "INSERT INTO generations VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", "commit a generation");
  if (!insert) return insert.error();
  insert->bind(1, static_cast<std::int64_t>(generation.generation));
  insert->bind(2, generation.best).bind(3, generation.mean);
  insert->bind(4, generation.median).bind(5, generation.worst);
  insert->bind(6, generation.diversity).bind_text(7, operator_json(generation));
  insert->bind(8, static_cast<std::int64_t>(generation.evaluations));
  insert->bind(9, generation.wall_s).bind(10, std::int64_t{generation.quarantined});
  insert->bind_blob(11, generation.optimiser_state).bind_text(12, digest);
  if (Status s = insert->run(); !s) return s.error();
  if (Status s = insert_individuals(generation); !s) return s.error();
  if (Status s = transaction->commit(); !s) return s.error();
  last_generation_ = generation.generation;
  digest_ = digest;
  return digest;
}

Status RunStore::insert_individuals(const StoredGeneration& generation) {
  Result<SqlStatement> insert = database_.prepare(
      "INSERT INTO individuals VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", "commit a generation");
  if (!insert) return insert.error();
  std::int64_t rank = 0;
  for (const StoredIndividual& individual : generation.individuals) {
    insert->bind(1, static_cast<std::int64_t>(generation.generation)).bind(2, rank++);
    insert->bind(3, static_cast<std::int64_t>(individual.birth_id));
    insert->bind_blob(4, genome_bytes(individual.genome)).bind_text(5, individual.values);
    insert->bind_text(6, individual.outcome).bind(7, individual.fitness);
    insert->bind(8, std::int64_t{individual.scores});
    insert->bind_text(9, json_text(Json(individual.parents))).bind_text(10, individual.operators);
    if (Status s = insert->run(); !s) return s;
  }
  return {};
}

Status RunStore::set_numeric_class(const std::string& numeric_class) {
  if (!info_.numeric_class.empty()) return {};
  Result<SqlStatement> update = database_.prepare(
      "UPDATE run SET numeric_class = ? WHERE numeric_class = ''", "keep the numeric class");
  if (!update) return update.error();
  update->bind_text(1, numeric_class);
  if (Status s = update->run(); !s) return s;
  info_.numeric_class = numeric_class;
  return {};
}

Status RunStore::set_progress(const Progress& progress) {
  Result<SqlStatement> update = database_.prepare(
      "UPDATE progress SET state = ?, stop_reason = ?, pid = ?, host = ?, heartbeat = ?, "
      "rate_per_s = ?, time_left_s = ?, done = ?, total = ?, workers = ?, epoch = ?, farm = ?",
      "write the progress");
  if (!update) return update.error();
  // One column for both: a run that waits has not stopped.
  const bool running = progress.state == RunState::kRunning;
  update->bind_text(1, run_state_name(progress.state));
  update->bind_text(2, running ? progress.waiting : progress.stop_reason);
  update->bind(3, std::int64_t{::getpid()}).bind_text(4, host_name());
  update->bind(5, unix_now_s()).bind(6, progress.rate_per_s).bind(7, progress.time_left_s);
  update->bind(8, static_cast<std::int64_t>(progress.done));
  update->bind(9, static_cast<std::int64_t>(progress.total));
  update->bind_text(10, json_text(workers_json(progress.workers)));
  update->bind(11, static_cast<std::int64_t>(epoch_));
  FarmTally farm = farm_before_;
  farm += progress.farm;
  update->bind_text(12, farm.to_json());
  return update->run();
}

Result<std::optional<Checkpoint>> RunStore::checkpoint(
    std::optional<std::uint64_t> generation) const {
  Result<SqlStatement> select = database_.prepare(
      "SELECT generation, evaluations, optimiser_state, digest, (SELECT sum(wall_s) FROM "
      "generations AS g WHERE g.generation <= generations.generation) FROM generations WHERE "
      "?1 IS NULL OR generation = ?1 ORDER BY generation DESC LIMIT 1",
      "read a checkpoint");
  if (!select) return select.error();
  if (generation) select->bind(1, static_cast<std::int64_t>(*generation));
  const Result<bool> row = select->step();
  if (!row) return row.error();
  if (!*row) {
    if (!generation) return std::optional<Checkpoint>{};
    return Error{database_.file().string() + ": has no generation " + std::to_string(*generation) +
                 "; " +
                 (last_generation_ ? "the last one is " + std::to_string(*last_generation_)
                                   : std::string("none was committed yet"))};
  }
  Checkpoint checkpoint;
  checkpoint.generation = static_cast<std::uint64_t>(select->integer(0));
  checkpoint.evaluations = static_cast<std::uint64_t>(select->integer(1));
  checkpoint.optimiser_state = select->blob(2);
  checkpoint.digest = select->text(3);
  checkpoint.wall_s = select->real(4);
  return std::optional<Checkpoint>(std::move(checkpoint));
}

Result<fs::path> RunStore::truncate_after(std::uint64_t generation) {
  const Result<std::optional<Checkpoint>> kept = checkpoint(generation);
  if (!kept) return kept.error();
  if (last_generation_ == generation) return fs::path{};

  const fs::path backup = free_backup_path(run_, *last_generation_);
  const std::string operation =
      "keep the generations after " + std::to_string(generation) + " in " + backup.string();
  Result<SqlStatement> copy = database_.prepare("VACUUM INTO ?", operation);
  if (!copy) return copy.error();
  copy->bind_text(1, backup.string());
  if (Status s = copy->run(); !s) return s.error();
  if (Status s = sync_to_disk(backup); !s) return s.error();
  if (Status s = sync_to_disk(run_); !s) return s.error();

  // The individuals go with their generations.
  Result<SqlTransaction> transaction = SqlTransaction::begin(database_);
  if (!transaction) return transaction.error();
  if (Status s = database_.exec(
          "DELETE FROM generations WHERE generation > " + std::to_string(generation) +
              "; DELETE FROM documents WHERE generation > " + std::to_string(generation) + "; " +
              forget_quarantines(generation + 1),
          "forget the generations after " + std::to_string(generation));
      !s) {
    return s.error();
  }
  if (Status s = transaction->commit(); !s) return s.error();
  last_generation_ = generation;
  digest_ = (*kept)->digest;
  return backup;
}

}  // namespace gapfarm
