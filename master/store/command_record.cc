#include "master/store/command_record.h"

#include <nlohmann/json.hpp>

#include "common/json/fields.h"
#include "common/json/json.h"
#include "master/store/answer_store.h"
#include "master/store/run_lock.h"
#include "master/store/run_reader.h"

namespace gapfarm {
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
  FIELDS(command, state);
  v.field("stop_reason", row.reason);
  FIELDS(stage);
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

std::filesystem::path answer_file(const std::filesystem::path& folder) {
  return folder / "simulations.sqlite";
}

Json to_json(const CommandRecord& record) { return FieldWriter::written(record, kRecord); }

CommandRecord command_record_of(const Json& json) {
  return LenientFields::read<CommandRecord>(json, kRecord);
}

Json workers_json(const std::vector<WorkerStatus>& workers) {
  return FieldWriter::list(workers, kWorker);
}

std::vector<WorkerStatus> workers_of(const Json& json) {
  return LenientFields::list<WorkerStatus>(json, kWorker);
}

Json fleets_json(const std::vector<FleetStatus>& fleets) {
  return FieldWriter::list(fleets, kFleet);
}

std::vector<FleetStatus> fleets_of(const Json& json) {
  return LenientFields::list<FleetStatus>(json, kFleet);
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
  if (record.state == "running" && !holder_lives(folder, record.host, age_s, kFreshRecord_s)) {
    record.state = "stopped";
    record.reason = "crashed: process " + std::to_string(record.pid) + " on " + record.host +
                    " is gone without a word";
  }
  if (record.state != "running") {
    record.time_left_s.reset();
    if (record.state == "finished") record.time_left_s = 0;
    record.workers.clear();
    record.fleets.clear();
    record.waiting.clear();
  }
  return std::optional<CommandRecord>(std::move(record));
}

}  // namespace gapfarm
