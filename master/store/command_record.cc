#include "master/store/command_record.h"

#include <nlohmann/json.hpp>

#include "common/base/build_info.h"
#include "common/base/try.h"
#include "common/json/fields.h"
#include "common/json/json.h"
#include "master/store/answer_store.h"
#include "master/store/run_lock.h"
#include "master/store/run_reader.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

// Commands beat about once a second, less often while they compute themselves.
constexpr double kFreshRecord_s = 120;

// Every object of the record, in the order of its fields.
constexpr auto kStage = [](auto& v, auto& stage) {
  v.field("name", stage.name);
  v.field("began", stage.began_unix_s);
};
constexpr auto kStageFinding = [](auto& v, auto& row) {
  v.field("stage", row.stage);
  v.field("about", row.found.about);
  v.field("text", row.found.text);
  v.field("columns", row.found.columns);
  v.field("rows", row.found.rows);
};
constexpr auto kWorker = [](auto& v, auto& worker) {
  v.field("name", worker.name);
  v.field("state", worker.state);
  v.field("jobs", worker.jobs);
  v.field("host", worker.host);
  v.field("finished", worker.finished);
  v.field("rate_per_s", worker.rate_per_s);
};
constexpr auto kFleet = [](auto& v, auto& fleet) {
  v.field("name", fleet.name);
  v.field("system", fleet.system);
  v.field("host", fleet.host);
  v.field("asked", fleet.wanted);
  v.field("queued", fleet.queued);
  v.field("running", fleet.running);
  v.field("lost", fleet.lost);
  v.field("why", fleet.why);
};
constexpr auto kRecord = [](auto& v, auto& record) {
  v.field("command", record.command);
  v.field("state", record.state);
  v.field("stop_reason", record.reason);
  v.field("stage", record.stage);
  v.field("stage_number", record.stage_number);
  v.field("stages", record.stages);
  v.list("plan", record.plan, kStage);
  v.list("findings", record.findings, kStageFinding);
  v.field("done", record.done);
  v.field("total", record.total);
  v.field("share", record.share);
  v.field("rate_per_s", record.rate_per_s);
  v.field("time_left_s", record.time_left_s);
  v.field("remembered", record.remembered);
  v.field("simulated", record.simulated);
  v.field("waiting", record.waiting);
  v.list("workers", record.workers, kWorker);
  v.list("fleets", record.fleets, kFleet);
  v.field("listen", record.listen);
  v.field("began", record.began_unix_s);
  v.field("heartbeat", record.heartbeat_unix_s);
  v.field("pid", record.pid);
  v.field("host", record.host);
  v.field("arguments", record.arguments);
};

bool lives(const std::filesystem::path& folder, const CommandRecord& record, double now_unix_s) {
  const std::optional<bool> held = run_lock_held(folder);
  if (held.value_or(false)) return true;
  const bool blind = !held || record.host != host_name();
  return blind && now_unix_s - record.heartbeat_unix_s < kFreshRecord_s;
}

}  // namespace

std::filesystem::path answer_file(const std::filesystem::path& folder) {
  return folder / "simulations.sqlite";
}

Json to_json(const CommandRecord& record) { return FieldWriter::written(record, kRecord); }

CommandRecord command_record_of(const Json& json) {
  return LenientFields::read<CommandRecord>(json, kRecord);
}

Json workers_json(const std::vector<StoredWorker>& workers) {
  return FieldWriter::list(workers, kWorker);
}

std::vector<StoredWorker> workers_of(const Json& json) {
  return LenientFields::list<StoredWorker>(json, kWorker);
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
  if (record.state == "running" && !lives(folder, record, now_unix_s)) {
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
