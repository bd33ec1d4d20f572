#include "master/store/run_store.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <system_error>

#include "common/base/build_info.h"
#include "common/base/text.h"
#include "common/json/json.h"
#include "master/store/run_reader.h"
#include "master/store/schema.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

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

std::string named_json(const std::vector<NamedValue>& values) {
  Json json = Json::object();
  for (const auto& [name, value] : values) json[name] = value;
  return json_text(json);
}

// Alarms stay: they are about machines, not about generations.
std::string forget_incidents(std::uint64_t from) {
  return std::string("DELETE FROM incidents WHERE kind != '") +
         incident_name(IncidentKind::kAlarm) + "' AND generation >= " + std::to_string(from);
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
  ASSIGN_OR_RETURN(SqlTransaction transaction, SqlTransaction::begin(database));
  RETURN_IF_ERROR(create_run_tables(database));
  RETURN_IF_ERROR(insert_run_info(database, info));
  RETURN_IF_ERROR(database.exec(
      "INSERT INTO progress VALUES (1, 'stopped', '', 0, '', 0, 0, NULL, 0, 0, '[]', 0, '{}')",
      "create the run store"));
  return transaction.commit();
}

// Whether nothing is there, or what a creation leaves that was interrupted before its one
// transaction committed: an empty file, or a database without tables.
bool is_unborn(const fs::path& file) {
  std::error_code code;
  if (!fs::exists(file, code) || fs::file_size(file, code) == 0) return true;
  const Result<Database> database = Database::open(file, Database::Mode::kQueryOnly);
  if (!database) return false;
  const auto is = database->identity("look");
  return is && is->empty;
}

}  // namespace

Status RunStore::check_free(const fs::path& run) {
  if (is_unborn(run / "run.sqlite")) return {};
  return Error{run.string() + ": holds a run already; continue it with `gapfarm resume " +
               shell_quoted(run.string()) + "`, or choose another --out"};
}

Result<RunStore> RunStore::create(const fs::path& run, const RunInfo& info) {
  std::error_code code;
  const bool made = fs::create_directories(run, code);
  if (code) {
    return Error{run.string() + ": cannot make the run folder: " + code.message() +
                 "; choose another --out"};
  }
  ASSIGN_OR_RETURN(RunLock lock, RunLock::take(run));
  RETURN_IF_ERROR(check_free(run));
  ASSIGN_OR_RETURN(Database database, Database::open(run / "run.sqlite", Database::Mode::kCreate));
  RunInfo complete = info;
  if (complete.program_version.empty()) complete.program_version = build_info().version;
  if (complete.fingerprint.empty()) complete.fingerprint = build_info().fingerprint;
  complete.created = utc_text(unix_now_s(), kStoredTime);
  RunStore store(run, std::move(lock), std::move(database));
  store.info_ = std::move(complete);
  Status begun = create_tables(store.database_, store.info_);
  if (begun) begun = sync_to_disk(run);
  if (begun) begun = store.begin_epoch();
  if (begun) return store;
  static_cast<void>(discard(std::move(store), made));  // why it could not begin says more
  return begun.error();
}

Status RunStore::discard(RunStore store, bool with_folder) {
  const fs::path run = store.run();
  {
    // Closed before its files go; the lock goes last.
    const Database closing = std::move(store.database_);
  }
  std::error_code code;
  for (const char* name : {"run.sqlite", "run.sqlite-wal", "run.sqlite-shm", "run.sqlite-journal",
                           "log.txt", "run.lock"}) {
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
  if (!fs::exists(file, missing)) return no_run_in(run);
  ASSIGN_OR_RETURN(RunLock lock, RunLock::take(run));
  // Looked at before anything may be written to it: it could be another program's file.
  {
    ASSIGN_OR_RETURN(const Database look, Database::open(file, Database::Mode::kQueryOnly));
    RETURN_IF_ERROR(check_run_store(look));
  }
  ASSIGN_OR_RETURN(Database database, Database::open(file, Database::Mode::kWrite));
  ASSIGN_OR_RETURN(const auto checked,
                   database.row("check the run store", "PRAGMA quick_check(1)",
                                [](const SqlStatement& row) { return row.text(0); }));
  if (checked != "ok") {
    return Error{file.string() + ": the file is damaged (" + checked.value_or("") +
                 "); restore a copy, or save what is left with `sqlite3 run.sqlite .recover`"};
  }
  RETURN_IF_ERROR(upgrade_run_store(database));
  ASSIGN_OR_RETURN(RunInfo info, load_run_info(database));

  RunStore store(run, std::move(lock), std::move(database));
  store.info_ = std::move(info);
  ASSIGN_OR_RETURN(const std::optional<Checkpoint> last, store.checkpoint());
  if (last) {
    store.last_generation_ = last->generation;
    store.digest_ = last->digest;
  }
  RETURN_IF_ERROR(store.begin_epoch());
  return store;
}

Status RunStore::load_before() {
  end_before_ = {0, "end", "", "", "the last that was heard of a master"};
  std::string farm;
  ASSIGN_OR_RETURN(
      const auto row,
      database_.row("read the run store", "SELECT epoch, farm, heartbeat, host FROM progress",
                    [&](const SqlStatement& before) {
                      before.read_all(epoch_, farm, end_before_.unix_s, end_before_.host);
                      return true;
                    }));
  if (!row) {
    return Error{database_.file().string() +
                 ": table progress is empty: the file was changed by hand; restore a copy"};
  }
  ++epoch_;
  Progress before;
  read_farm(farm, &before);
  farm_before_ = before.farm;
  return {};
}

Status RunStore::begin_epoch() {
  RETURN_IF_ERROR(load_before());
  std::vector<StoredWorkerEvent> events = {
      {unix_now_s(), "master", "", host_name(), "master " + std::to_string(epoch_) + " begins"}};
  if (epoch_ > 1) events.insert(events.begin(), end_before_);
  ASSIGN_OR_RETURN(SqlTransaction transaction, SqlTransaction::begin(database_));
  RETURN_IF_ERROR(database_.exec("CREATE TEMP TABLE progress_before AS SELECT * FROM progress; " +
                                     forget_incidents(next_generation()),
                                 "write the run store"));
  RETURN_IF_ERROR(insert_worker_events(events));
  RETURN_IF_ERROR(set_progress({}));
  return transaction.commit();
}

Result<std::uint64_t> RunStore::quarantined() const {
  ASSIGN_OR_RETURN(const std::int64_t sum,
                   database_.integer("SELECT coalesce(sum(quarantined), 0) FROM generations",
                                     "read the generations"));
  return static_cast<std::uint64_t>(sum);
}

Result<std::string> RunStore::commit(const StoredGeneration& generation) {
  if (last_generation_ && generation.generation != *last_generation_ + 1) {
    return Error{database_.file().string() + ": generation " +
                 std::to_string(generation.generation) + " cannot follow generation " +
                 std::to_string(*last_generation_) + "; commit generations in order"};
  }
  const std::string digest = generation_digest(digest_, generation);
  ASSIGN_OR_RETURN(SqlTransaction transaction, SqlTransaction::begin(database_));
  RETURN_IF_ERROR(database_.run(
      "commit a generation", "INSERT INTO generations VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
      generation.generation, generation.best, generation.mean, generation.median, generation.worst,
      generation.diversity, named_json(generation.operator_probabilities), generation.evaluations,
      generation.wall_s, generation.quarantined, SqlBlob{generation.optimiser_state}, digest));
  RETURN_IF_ERROR(insert_individuals(generation));
  RETURN_IF_ERROR(transaction.commit());
  last_generation_ = generation.generation;
  digest_ = digest;
  return digest;
}

Status RunStore::insert_individuals(const StoredGeneration& generation) {
  ASSIGN_OR_RETURN(
      SqlStatement insert,
      database_.prepare("INSERT INTO individuals VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                        "commit a generation"));
  std::int64_t rank = 0;
  for (const StoredIndividual& i : generation.individuals) {
    const std::string_view genome = genome_bytes(i.genome);
    const std::string objectives = i.objectives.empty() ? "" : named_json(i.objectives);
    insert.bind_all(generation.generation, rank++, i.birth_id, SqlBlob{genome}, i.values, i.outcome,
                    i.fitness, i.scores, json_text(Json(i.parents)), i.operators, objectives);
    RETURN_IF_ERROR(insert.run());
  }
  return {};
}

Status RunStore::set_numeric_class(const std::string& numeric_class) {
  const BuildInfo& build = build_info();
  const bool own = info_.fingerprint == build.fingerprint;
  if (own && !info_.numeric_class.empty()) return {};
  RETURN_IF_ERROR(database_.run("keep the numeric class",
                                "UPDATE run SET numeric_class = ?, fingerprint = ?, "
                                "program_version = ?",
                                numeric_class, build.fingerprint, build.version));
  info_.numeric_class = numeric_class;
  info_.fingerprint = build.fingerprint;
  info_.program_version = build.version;
  return {};
}

Status RunStore::set_overrides(const std::string& json) {
  info_.overrides = json;
  return database_.run("keep the run's options", "UPDATE run SET overrides = ?", json);
}

Status RunStore::set_progress(const Progress& progress) {
  // One column for both: a run that waits has not stopped.
  const bool running = progress.running();
  FarmTally farm = farm_before_;
  farm += progress.farm;
  return database_.run(
      "write the progress",
      "UPDATE progress SET state = ?, stop_reason = ?, pid = ?, host = ?, heartbeat = ?, "
      "rate_per_s = ?, time_left_s = ?, done = ?, total = ?, workers = ?, epoch = ?, farm = ?",
      run_state_name(progress.state), running ? progress.waiting : progress.stop_reason, ::getpid(),
      host_name(), unix_now_s(), progress.rate_per_s, progress.time_left_s, progress.done,
      progress.total, json_text(workers_json(progress.workers)), epoch_, farm_json(farm, progress));
}

Result<std::optional<Checkpoint>> RunStore::checkpoint(
    std::optional<std::uint64_t> generation) const {
  auto found = database_.row(
      "read a checkpoint",
      "SELECT generation, evaluations, optimiser_state, digest, (SELECT sum(wall_s) FROM "
      "generations AS g WHERE g.generation <= generations.generation) FROM generations WHERE ?1 IS "
      "NULL OR generation = ?1 ORDER BY generation DESC LIMIT 1",
      [](const SqlStatement& row) {
        Checkpoint c;
        row.read_all(c.generation, c.evaluations, c.optimiser_state, c.digest, c.wall_s);
        return c;
      },
      generation);
  if (found && !*found && generation) {
    return Error{database_.file().string() + ": has no generation " + std::to_string(*generation) +
                 "; " +
                 (last_generation_ ? "the last one is " + std::to_string(*last_generation_)
                                   : std::string("none was committed yet"))};
  }
  return found;
}

Result<fs::path> RunStore::truncate_after(std::uint64_t generation) {
  ASSIGN_OR_RETURN(const std::optional<Checkpoint> kept, checkpoint(generation));
  if (last_generation_ == generation) return fs::path{};

  const fs::path backup = free_backup_path(run_, *last_generation_);
  const std::string operation =
      "keep the generations after " + std::to_string(generation) + " in " + backup.string();
  RETURN_IF_ERROR(database_.run(operation, "VACUUM INTO ?", backup.string()));
  // The copy ends as the master before left it; this one goes on elsewhere.
  RETURN_IF_ERROR(database_.run(operation, "ATTACH ? AS copy", backup.string()));
  RETURN_IF_ERROR(database_.exec(
      "REPLACE INTO copy.progress SELECT * FROM temp.progress_before; DETACH copy", operation));
  RETURN_IF_ERROR(sync_to_disk(backup));
  RETURN_IF_ERROR(sync_to_disk(run_));

  // The individuals go with their generations.  What the run left in its folder is there as before.
  ASSIGN_OR_RETURN(SqlTransaction transaction, SqlTransaction::begin(database_));
  RETURN_IF_ERROR(
      database_.exec("DELETE FROM generations WHERE generation > " + std::to_string(generation) +
                         "; DELETE FROM documents WHERE name <> 'model' AND generation > " +
                         std::to_string(generation) + "; " + forget_incidents(generation + 1),
                     "forget the generations after " + std::to_string(generation)));
  RETURN_IF_ERROR(transaction.commit());
  last_generation_ = generation;
  digest_ = kept->digest;
  return backup;
}

Status RunStore::add_incident(IncidentKind kind, const std::string& text) {
  return database_.run("write down what happened", "INSERT INTO incidents VALUES (?, ?, ?, ?)",
                       next_generation(), incident_name(kind), unix_now_s(), text);
}

Status RunStore::add_worker_events(const std::vector<StoredWorkerEvent>& events) {
  if (events.empty()) return {};
  ASSIGN_OR_RETURN(SqlTransaction transaction, SqlTransaction::begin(database_));
  RETURN_IF_ERROR(insert_worker_events(events));
  return transaction.commit();
}

Status RunStore::insert_worker_events(const std::vector<StoredWorkerEvent>& events) {
  ASSIGN_OR_RETURN(SqlStatement insert,
                   database_.prepare("INSERT INTO worker_events VALUES (?, ?, ?, ?, ?)",
                                     "write down who came and went"));
  for (const StoredWorkerEvent& e : events) {
    RETURN_IF_ERROR(insert.bind_all(e.unix_s, e.kind, e.worker, e.host, e.text).run());
  }
  return {};
}

Status RunStore::keep_document(const std::string& name, const std::string& json) {
  return database_.run("keep " + name, "INSERT OR REPLACE INTO documents VALUES (?, ?, ?)", name,
                       last_generation_.value_or(0), json);
}

}  // namespace gapfarm
