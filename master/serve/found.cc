#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/json/json.h"
#include "common/problem/problem.h"
#include "common/trials/files.h"
#include "master/serve/site.h"
#include "master/store/run_reader.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

constexpr int kDeepest = 4;
constexpr std::size_t kMostFound = 2000;
constexpr std::size_t kMostFiles = 50000;
constexpr std::size_t kMostPoints = 60;
constexpr double kLookAgain_s = 5;  // at what says that it runs: its master may have died
constexpr double kBusy_s = 10;      // a store that cannot be read for so long is reported

constexpr const char* kResultFiles[] = {
    "run.sqlite",     "run.sqlite-wal", "simulations.sqlite", "simulations.sqlite-wal",
    "diagnosis.json", "log.txt",        "determined.csv"};

std::optional<FoundWork> work_in(const fs::path& folder) {
  std::error_code ignored;
  const auto has = [&](const char* name) { return fs::is_regular_file(folder / name, ignored); };
  FoundWork found{FoundWork::Kind::kRun, folder.lexically_normal().string(), folder};
  if (has("run.sqlite")) return found;
  found.kind = FoundWork::Kind::kDiagnosis;
  if (has("diagnosis.json")) return found;
  found.kind = FoundWork::Kind::kCommand;
  if (has("simulations.sqlite")) return found;
  return std::nullopt;
}

struct Search {
  std::size_t files = 0;
  std::vector<FoundWork> found;

  bool full() const { return files >= kMostFiles || found.size() >= kMostFound; }

  void look_into(const fs::path& folder, int depth) {
    if (auto work = work_in(folder)) found.push_back(*std::move(work));
    if (depth == kDeepest) return;
    std::vector<fs::path> below;
    std::error_code error;
    fs::directory_iterator it(folder, fs::directory_options::skip_permission_denied, error);
    for (; !error && it != fs::directory_iterator() && !full(); it.increment(error)) {
      ++files;
      std::error_code ignored;
      const std::string name = it->path().filename().string();
      if (!name.starts_with('.') && it->is_directory(ignored) && !it->is_symlink(ignored)) {
        below.push_back(it->path());
      }
    }
    std::ranges::sort(below);
    for (const fs::path& next : below) {
      if (full()) return;
      look_into(next, depth + 1);
    }
  }
};

std::size_t trials_of(const RunInfo& info) {
  v1::Problem message;
  return message.ParseFromString(info.problem) ? static_cast<std::size_t>(message.trials_size())
                                               : 0;
}

Status read_run(const FoundWork& found, double now_unix_s, WorkEntry* entry) {
  ASSIGN_OR_RETURN(const auto reader, RunReader::open(found.path));
  ASSIGN_OR_RETURN(const auto status, run_status(reader, now_unix_s));
  static_cast<LiveStatus&>(*entry) = status;
  entry->status_text = status.running() ? status.waiting : status.stop_reason;
  entry->fitness = status.info.fitness;
  entry->unit = status.info.fitness_unit;
  entry->higher_is_better = status.info.higher_is_better;
  entry->best = status.last.best;
  const auto& all = status.best_by_generation;
  const std::size_t each = std::max<std::size_t>(1, (all.size() + kMostPoints - 1) / kMostPoints);
  for (std::size_t i = all.size(); i > 0; i -= std::min(i, each)) {
    if (all[i - 1])
      entry->best_by_generation.insert(entry->best_by_generation.begin(), *all[i - 1]);
  }
  entry->generation = status.last.generation;
  entry->evaluations = status.last.evaluations;
  entry->trials = trials_of(status.info);
  entry->seed = status.info.seed;
  entry->config = status.info.config_path;
  entry->given_up = status.quarantined;
  entry->farm = status.farm;
  return {};
}

Status read_command_of(const FoundWork& found, double now_unix_s, WorkEntry* entry) {
  ASSIGN_OR_RETURN(const auto record, command_status(found.path, now_unix_s));
  if (!record) return {};
  const CommandRecord& r = *record;
  static_cast<LiveStatus&>(*entry) = r;
  entry->what = r.command.empty() ? entry->what : r.command;
  entry->status_text = r.running() ? (r.waiting.empty() ? r.stage : r.waiting) : r.stop_reason;
  entry->config = r.arguments;
  return {};
}

// The headline alone: trials and drives stay unread.
void read_headline(const FoundWork& found, WorkEntry* entry) {
  const auto text = read_text_file((found.path / "diagnosis.json").string());
  if (!text) return;
  const auto json = parse_json(*text);
  if (!json.is_object()) return;
  if (json.contains("headline") && json["headline"].is_string()) {
    entry->status_text = json["headline"].get<std::string>();
  }
  if (entry->state == RunState::kUnknown) entry->state = RunState::kFinished;
}

// Never fails: what cannot be read says so in `trouble`.
WorkEntry entry_of(const FoundWork& found, double now_unix_s) {
  WorkEntry entry;
  entry.kind = found.kind;
  entry.name = found.name;
  entry.what = found.kind == FoundWork::Kind::kRun         ? "run"
               : found.kind == FoundWork::Kind::kDiagnosis ? "diagnosis"
                                                           : "command";
  const bool run = found.kind == FoundWork::Kind::kRun;
  const Status read =
      run ? read_run(found, now_unix_s, &entry) : read_command_of(found, now_unix_s, &entry);
  if (!read) entry.trouble = read.error().message;
  if (found.kind == FoundWork::Kind::kDiagnosis && !entry.running()) {
    read_headline(found, &entry);
  }
  return entry;
}

}  // namespace

std::vector<FoundWork> find_work(const std::vector<fs::path>& roots) {
  Search search;
  for (const fs::path& root : roots) search.look_into(root, 0);
  return std::move(search.found);
}

std::string stamp_of(const fs::path& folder) {
  std::string stamp;
  for (const char* name : kResultFiles) {
    std::error_code no_size, no_time;
    const auto size = fs::file_size(folder / name, no_size);
    const auto time = fs::last_write_time(folder / name, no_time);
    stamp += no_size || no_time
                 ? "-"
                 : std::to_string(size) + "@" + std::to_string(time.time_since_epoch().count());
    stamp += ' ';
  }
  return stamp;
}

bool WorkEntries::holds(const Known& known, const std::string& stamp, double now_unix_s) const {
  const double age_s = now_unix_s - known.read_unix_s;
  if (age_s < 0) return false;
  if (age_s < good_for_s(known.cost_s)) return true;
  const bool may_change = known.entry.running() || !known.entry.trouble.empty();
  return known.entry.stamp == stamp && (!may_change || age_s < kLookAgain_s);
}

std::vector<WorkEntry> WorkEntries::now(const std::vector<FoundWork>& found) {
  std::map<std::string, Known> still;
  std::vector<WorkEntry> entries;
  for (const FoundWork& f : found) {
    // What a folder is taken for may change once its files have stood still.
    std::string stamp = stamp_of(f.path) + std::to_string(static_cast<int>(f.kind));
    const double now_unix_s = unix_now_s_();
    const auto known = known_.find(f.name);
    Known& next = still[f.name];
    if (known != known_.end() && holds(known->second, stamp, now_unix_s)) {
      next = known->second;
    } else {
      const double began_s = cpu_now_s_();
      WorkEntry fresh = entry_of(f, now_unix_s);
      fresh.stamp = std::move(stamp);
      const bool busy = !fresh.trouble.empty() && known != known_.end() &&
                        known->second.entry.trouble.empty() &&
                        now_unix_s - known->second.read_unix_s < kBusy_s;
      if (busy) {
        next = known->second;  // somebody writes just now: it is looked at again soon
      } else {
        next = {now_unix_s, cpu_now_s_() - began_s, std::move(fresh)};
      }
    }
    entries.push_back(next.entry);
  }
  known_ = std::move(still);
  return entries;
}

}  // namespace gapfarm
