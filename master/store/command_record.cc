#include "master/store/command_record.h"

#include <nlohmann/json.hpp>

#include "common/base/host.h"
#include "common/json/json.h"
#include "master/store/answer_store.h"
#include "master/store/run_lock.h"
#include "master/store/run_status.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

// Commands beat about once a second, less often while they compute themselves.
constexpr double kFreshRecord_s = 120;

template <class T>
void read(const Json& json, const char* key, T& to) {
  const auto found = json.find(key);
  if (found == json.end()) return;
  if constexpr (std::is_same_v<T, std::string>) {
    if (found->is_string()) to = found->get<T>();
  } else {
    if (found->is_number()) to = found->get<T>();
  }
}

Json findings_json(const std::vector<StageFinding>& findings) {
  Json list = Json::array();
  for (const auto& [stage, found] : findings) {
    Json rows = Json::array();
    for (const auto& [name, value] : found.rows) rows.push_back({name, value});
    list.push_back({{"stage", stage},
                    {"about", found.about},
                    {"text", found.text},
                    {"columns", {found.columns.first, found.columns.second}},
                    {"rows", std::move(rows)}});
  }
  return list;
}

// Two texts; empty ones where there is something else.
std::pair<std::string, std::string> two_texts(const Json& json) {
  if (!json.is_array() || json.size() != 2 || !json[0].is_string() || !json[1].is_string()) {
    return {};
  }
  return {json[0].get<std::string>(), json[1].get<std::string>()};
}

void read_stage_records(const Json& json, CommandRecord* record) {
  const auto plan = json.find("plan"), findings = json.find("findings");
  if (plan != json.end() && plan->is_array()) {
    for (const Json& stage : *plan) {
      if (!stage.is_object()) continue;
      read(stage, "name", record->plan.emplace_back().name);
      read(stage, "began", record->plan.back().began_unix_s);
    }
  }
  if (findings == json.end() || !findings->is_array()) return;
  for (const Json& finding : *findings) {
    if (!finding.is_object()) continue;
    auto& [stage, found] = record->findings.emplace_back();
    read(finding, "stage", stage);
    read(finding, "about", found.about);
    read(finding, "text", found.text);
    if (finding.contains("columns")) found.columns = two_texts(finding["columns"]);
    if (!finding.contains("rows") || !finding["rows"].is_array()) continue;
    for (const Json& row : finding["rows"]) found.rows.push_back(two_texts(row));
  }
}

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

Json to_json(const CommandRecord& record) {
  Json json;
  json["command"] = record.command;
  json["state"] = record.state;
  json["stop_reason"] = record.reason;
  json["stage"] = record.stage;
  json["stage_number"] = record.stage_number;
  json["stages"] = record.stages;
  json["plan"] = Json::array();
  for (const StageRecord& stage : record.plan) {
    json["plan"].push_back({{"name", stage.name}, {"began", stage.began_unix_s}});
  }
  json["findings"] = findings_json(record.findings);
  json["done"] = record.done;
  json["total"] = record.total;
  json["share"] = record.share;
  json["rate_per_s"] = record.rate_per_s;
  json["time_left_s"] = record.time_left_s ? Json(*record.time_left_s) : Json(nullptr);
  json["remembered"] = record.remembered;
  json["simulated"] = record.simulated;
  json["waiting"] = record.waiting;
  json["workers"] = workers_json(record.workers);
  json["began"] = record.began_unix_s;
  json["heartbeat"] = record.heartbeat_unix_s;
  json["pid"] = record.pid;
  json["host"] = record.host;
  json["arguments"] = record.arguments;
  return json;
}

CommandRecord command_record_of(const Json& json) {
  CommandRecord record;
  if (!json.is_object()) return record;
  read(json, "command", record.command);
  read(json, "state", record.state);
  read(json, "stop_reason", record.reason);
  read(json, "stage", record.stage);
  read(json, "stage_number", record.stage_number);
  read(json, "stages", record.stages);
  read(json, "done", record.done);
  read(json, "total", record.total);
  read(json, "share", record.share);
  read(json, "rate_per_s", record.rate_per_s);
  if (json.contains("time_left_s") && json["time_left_s"].is_number()) {
    record.time_left_s = json["time_left_s"].get<double>();
  }
  read(json, "remembered", record.remembered);
  read(json, "simulated", record.simulated);
  read(json, "waiting", record.waiting);
  read(json, "began", record.began_unix_s);
  read(json, "heartbeat", record.heartbeat_unix_s);
  read(json, "pid", record.pid);
  read(json, "host", record.host);
  read(json, "arguments", record.arguments);
  read_stage_records(json, &record);
  if (!json.contains("workers") || !json["workers"].is_array()) return record;
  for (const Json& json_worker : json["workers"]) {
    StoredWorker& worker = record.workers.emplace_back();
    if (!json_worker.is_object()) continue;
    read(json_worker, "name", worker.name);
    read(json_worker, "state", worker.state);
    read(json_worker, "jobs", worker.jobs);
    read(json_worker, "host", worker.host);
    read(json_worker, "finished", worker.finished);
    read(json_worker, "rate_per_s", worker.rate_per_s);
  }
  return record;
}

Result<std::optional<CommandRecord>> command_status(const std::filesystem::path& folder,
                                                    double now_unix_s) {
  std::error_code ignored;
  if (!std::filesystem::exists(answer_file(folder), ignored)) {
    return std::optional<CommandRecord>();
  }
  const auto text = read_command(answer_file(folder));
  if (!text) return text.error();
  if (!*text) return std::optional<CommandRecord>();
  CommandRecord record = command_record_of(parse_json(**text));
  if (record.state == "running" && !lives(folder, record, now_unix_s)) {
    record.state = "stopped";
    record.reason = "crashed: process " + std::to_string(record.pid) + " on " + record.host +
                    " is gone without a word";
  }
  if (record.state != "running") {
    record.time_left_s.reset();
    if (record.state == "finished") record.time_left_s = 0;
    record.workers.clear();
    record.waiting.clear();
  }
  return std::optional<CommandRecord>(std::move(record));
}

}  // namespace gapfarm
