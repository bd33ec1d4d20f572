// gapfarm status FOLDER: how a run or another long command is doing, from its store alone.

#include <poll.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/base/try.h"
#include "common/json/json.h"
#include "master/cli/subcommand.h"
#include "master/command/console.h"
#include "master/command/long_command.h"
#include "master/store/command_record.h"
#include "master/store/run_lock.h"
#include "master/store/run_reader.h"
#include "master/store/schema.h"

namespace gapfarm {
namespace {

// A line of eight-level blocks, at most `width` of them, a blank where there is no value.  Longer
// series are cut into equal stretches and show the last value of each.  The scale omits the
// worst tenth of the values, so that a bad first generation does not flatten the rest.
std::string sparkline(const std::vector<std::optional<double>>& values, std::size_t width,
                      bool higher_is_better);

std::string status_screen(const RunStatus& status, const std::string& run, const Console& console);

// One about a diagnosis, a comparison or a study in `folder`.
std::string command_screen(const CommandRecord& record, const std::string& folder,
                           double now_unix_s, const Console& console);

constexpr std::size_t kMostWorkers = 8;
constexpr std::size_t kMostParameters = 12;
constexpr std::size_t kMostOfAKind = 4;  // incidents

const char* state_style(const std::string& state) {
  if (state == "running") return "1;32";
  if (state == "finished") return "1;34";
  return state == "failed" ? "1;31" : "1;33";
}

std::string label(const Console& console, const std::string& name) {
  return console.styled(name + std::string(name.size() < 12 ? 12 - name.size() : 1, ' '), "2");
}

std::string best_values(const RunStatus& status, const Console& console) {
  if (!status.best_individual) return {};
  const auto values = parse_json(status.best_individual->values);
  if (!values.is_object() || values.empty()) return {};
  std::size_t widest = 0, shown = 0;
  for (const auto& [key, value] : values.items()) widest = std::max(widest, key.size());
  std::string text;
  for (const auto& [key, value] : values.items()) {
    if (shown++ == kMostParameters) {
      text += label(console, "") + "... " + std::to_string(values.size() - kMostParameters) +
              " more with --json\n";
      break;
    }
    const std::string shown_value =
        value.is_number_float() ? format_number(value.get<double>())
                                : (value.is_string() ? value.get<std::string>() : json_text(value));
    text += label(console, shown == 1 ? "best" : "") + printable(key) +
            std::string(widest - key.size() + 2, ' ') + printable(shown_value) + "\n";
  }
  return text;
}

std::string worker_lines(const std::vector<WorkerStatus>& workers, const Console& console) {
  std::string text;
  for (std::size_t i = 0; i < workers.size(); ++i) {
    if (i == kMostWorkers) {
      text +=
          label(console, "") + "... " + std::to_string(workers.size() - i) + " more with --json\n";
      break;
    }
    const WorkerStatus& worker = workers[i];
    text += label(console, i == 0 ? "workers" : "") + printable(worker.name) + " on " +
            printable(worker.host) + ": " + printable(worker.state) + ", " +
            std::to_string(worker.jobs) + " in hand, " + std::to_string(worker.finished) + " done" +
            rate_text(worker.rate_per_s) + "\n";
  }
  return text;
}

std::string fleet_lines(const std::vector<FleetStatus>& fleets, const Console& console) {
  std::string text;
  for (const FleetStatus& f : fleets) {
    text += label(console, "cluster") + printable(f.system) + ": " + std::to_string(f.wanted) +
            " workers asked for, " + std::to_string(f.queued) + " queued, " +
            std::to_string(f.running) + " running, " + std::to_string(f.lost) + " lost" +
            (f.why.empty() ? "" : "; " + printable(f.why)) + "\n";
  }
  return text;
}

// What the farm coped with; nothing where there was nothing.
std::string farm_line(const FarmTally& farm, const Console& console) {
  const std::pair<std::uint64_t, const char*> parts[] = {
      {farm.retries, " retries"},
      {farm.hung, " hung and killed"},
      {farm.copies, " copies of stragglers"},
      {farm.handed_over, " answers kept over a restart"},
      {farm.compared, " answers compared"}};
  std::string text;
  for (const auto& [count, what] : parts) {
    if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + what;
  }
  return text.empty() ? text : label(console, "farm") + text + "\n";
}

// The latest of a kind.
std::string incident_lines(const RunStatus& status, IncidentKind kind, const Console& console) {
  std::vector<const Incident*> all;
  for (const Incident& incident : status.incidents) {
    if (incident.kind == kind) all.push_back(&incident);
  }
  std::string text;
  const std::size_t first = all.size() - std::min(all.size(), kMostOfAKind);
  for (std::size_t i = first; i < all.size(); ++i) {
    text += label(console, "") + "generation " + std::to_string(all[i]->generation) + ": " +
            printable(all[i]->text) + "\n";
  }
  if (first > 0) {
    text += label(console, "") + "... " + std::to_string(first) + " earlier with --json\n";
  }
  return text;
}

std::string trouble(const RunStatus& status, const Console& console) {
  std::string text = farm_line(status.progress.farm, console);
  if (status.quarantined > 0) {
    text += label(console, "given up") + std::to_string(status.quarantined) +
            (status.quarantined == 1 ? " task\n" : " tasks\n") +
            incident_lines(status, IncidentKind::kQuarantine, console);
  }
  const std::string failures = incident_lines(status, IncidentKind::kFailure, console);
  if (!failures.empty()) {
    text += label(console, "failed") + "evaluations that the program had no value for\n" + failures;
  }
  const std::string alarms = incident_lines(status, IncidentKind::kAlarm, console);
  if (!alarms.empty()) {
    text += label(console, "alarms") +
            console.styled("two answers to one task: a machine computes wrongly", "1;31") + "\n" +
            alarms;
  }
  return text;
}

std::string sparkline(const std::vector<std::optional<double>>& values, std::size_t width,
                      bool higher_is_better) {
  static constexpr const char* kBlocks[] = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  std::vector<double> sorted;
  for (const std::optional<double>& value : values) {
    if (value && std::isfinite(*value)) sorted.push_back(*value);
  }
  std::sort(sorted.begin(), sorted.end());
  if (sorted.empty() || width == 0) return {};
  const std::size_t tenth = sorted.size() / 10;
  const double low = sorted[higher_is_better ? tenth : 0];
  const double high = sorted[sorted.size() - 1 - (higher_is_better ? 0 : tenth)];

  const std::size_t columns = std::min(width, values.size());
  std::string line;
  for (std::size_t c = 0; c < columns; ++c) {
    const std::optional<double>& value = values[(c + 1) * values.size() / columns - 1];
    if (!value || !std::isfinite(*value)) {
      line += ' ';
      continue;
    }
    const double share = high > low ? std::clamp((*value - low) / (high - low), 0.0, 1.0) : 0.5;
    line += kBlocks[std::min(7, static_cast<int>(share * 8))];
  }
  return line;
}

// Of several objectives.
std::string front_lines(const RunFront& front, const Console& console) {
  if (front.members.empty()) return {};
  std::string text = label(console, "front") + std::to_string(front.members.size()) +
                     " members, the best is its knee; others: --json, gapfarm replay RUN --genome "
                     "ID --out MODEL\n";
  for (std::size_t m = 0; m < front.objectives.size(); ++m) {
    text += label(console, "") + printable(front.objectives[m].name) +
            (front.objectives[m].maximise ? ", higher" : ", lower") + " is better: ideal " +
            format_number(front.ideal[m]) + ", knee " +
            format_number(front.members[front.knee].objectives[m].second) + ", nadir " +
            format_number(front.nadir[m]) + "; hypervolume from " +
            format_number(front.reference[m]) + "\n";
  }
  if (!front.hypervolume.back()) return text;
  return text + label(console, "hypervolume") + format_number(front.hypervolume.back()) + "  " +
         sparkline(front.hypervolume, 40, true) + console.styled(" by generation", "2") + "\n";
}

std::string status_screen(const RunStatus& status, const std::string& run, const Console& console) {
  std::string text =
      console.styled(run, "1") + "  " +
      console.styled(run_state_name(status.state), state_style(run_state_name(status.state)));
  const bool running = status.state == RunState::kRunning;
  const std::string& why = running ? status.progress.waiting : status.stop_reason;
  if (!why.empty()) text += ": " + printable(why);
  text += "\n";

  text += label(console, "generation") + std::to_string(status.generation);
  if (status.state == RunState::kRunning && status.progress.total > 0) {
    text += ", and " + std::to_string(status.progress.done) + " of " +
            std::to_string(status.progress.total) + " tasks of the next";
  }
  text += "\n" + label(console, "evaluations") + std::to_string(status.evaluations) +
          rate_text(status.rate_per_s);
  if (status.state == RunState::kRunning && status.time_left_s) {
    text += ", " + format_duration(*status.time_left_s) + " left";
  }
  if (status.state != RunState::kRunning) text += ", in " + format_duration(status.wall_s);
  text += "\n" + label(console, "fitness") + status.info.fitness;
  if (status.info.fitness_unit != "-") text += " (" + status.info.fitness_unit + ")";
  text += status.info.higher_is_better ? ", higher is better" : ", lower is better";
  if (status.best_individual && status.best_individual->outcome == "INFEASIBLE") {
    text += "; nothing feasible was found yet";
  }
  if (status.generation > 0) {
    text += "\n" + label(console, "") + "best " + format_number(status.best) + ", mean " +
            format_number(status.mean) + ", worst " + format_number(status.worst);
    const std::size_t columns = std::min<std::size_t>(60, std::max(20u, console.width()) - 13);
    text += "\n" + label(console, "") +
            sparkline(status.best_by_generation, columns, status.info.higher_is_better) +
            console.styled(" best by generation", "2");
  }
  text += "\n" + front_lines(status.front, console);
  text += best_values(status, console) + worker_lines(status.progress.workers, console) +
          fleet_lines(status.progress.fleets, console);
  if (status.state == RunState::kRunning && status.heartbeat_age_s > 5) {
    text += label(console, "heartbeat") + format_duration(status.heartbeat_age_s) + " ago\n";
  }
  text += trouble(status, console);
  if (const std::string start = search_start_text(status.info); !start.empty()) {
    text += label(console, "began at") + printable(start) + "\n";
  }
  text += label(console, "seed") + std::to_string(status.info.seed) + "\n";
  if (!status.digest.empty()) text += label(console, "digest") + status.digest + "\n";
  if (status.state == RunState::kStopped) {
    text += label(console, "go on with") + "gapfarm resume " + run + "\n";
  }
  return text;
}

std::string command_screen(const CommandRecord& record, const std::string& folder,
                           double now_unix_s, const Console& console) {
  std::string text = console.styled(folder, "1") + "  " + printable(record.command) + " " +
                     console.styled(record.state, state_style(record.state));
  const std::string& why = record.state == "running" ? record.waiting : record.reason;
  if (!why.empty()) text += ": " + printable(why);
  text += "\n";
  const bool over = record.state == "finished";
  if (!over && record.number > 0) {
    text += label(console, "stage") + std::to_string(record.number) + " of " +
            std::to_string(record.stages) + ": " + printable(record.stage);
    if (record.total > 0) {
      text += ", " + std::to_string(record.done) + " of " + std::to_string(record.total);
    }
    text += "\n";
  }
  text += label(console, "done") + format_share(over ? 1 : record.share);
  if (record.state == "running") text += rate_text(record.rate_per_s);
  if (!over && record.time_left_s) {
    text += ", about " + format_duration(*record.time_left_s) + " left";
  }
  text += "\n" + label(console, "simulated") + std::to_string(record.simulated);
  if (record.remembered > 0) text += ", and " + std::to_string(record.remembered) + " remembered";
  text += "\n" + label(console, "took") +
          format_duration((record.state == "running" ? now_unix_s : record.heartbeat_unix_s) -
                          record.began_unix_s) +
          ", process " + std::to_string(record.pid) + " on " + printable(record.host) + "\n";
  for (const auto& [stage, found] : record.findings) {
    text += label(console, "so far") + printable(found.text) + "\n";
  }
  text += worker_lines(record.workers, console) + fleet_lines(record.fleets, console);
  const double age_s = now_unix_s - record.heartbeat_unix_s;
  if (record.state == "running" && age_s > 5) {
    text += label(console, "heartbeat") + format_duration(age_s) + " ago\n";
  }
  if (record.state == "stopped") {
    text += label(console, "go on with") + printable(record.arguments) + "\n";
  }
  return text;
}

constexpr int kWatchInterval_ms = 1000;

struct StatusOptions {
  std::string run;
  bool watch = false;
};

struct Look {
  nlohmann::ordered_json json;
  std::string screen;
  bool running = false;
};

// The folder where the command keeps what it simulates: `path` itself, or, where that is a file or
// is to be one, the folder beside it.
std::filesystem::path command_folder(const std::string& path) {
  std::error_code ignored;
  const std::filesystem::path partial = path + ".partial";
  return std::filesystem::exists(answer_file(partial), ignored) ? partial
                                                                : std::filesystem::path(path);
}

Result<Look> look(const std::string& run, const Console& console) {
  const double now_s = unix_now_s();
  std::error_code ignored;
  if (!std::filesystem::exists(run_store_file(run), ignored) || command_folder(run) != run) {
    ASSIGN_OR_RETURN(const auto record, command_status(command_folder(run), now_s));
    if (record) {
      return Look{to_json(*record), command_screen(*record, run, now_s, console),
                  record->state == "running"};
    }
  }
  ASSIGN_OR_RETURN(const RunReader reader, RunReader::open(run));
  ASSIGN_OR_RETURN(const RunStatus status, run_status(reader, now_s));
  return Look{to_json(status), status_screen(status, run, console),
              status.state == RunState::kRunning};
}

void show(const Look& seen, const StatusOptions& options, Console& console) {
  if (console.json()) {
    // Watched: one line a look, for `jq` and the like.
    const int indent = options.watch ? -1 : 2;
    console.print(json_text(seen.json, indent) + "\n");
    return;
  }
  if (options.watch && console.out_is_terminal()) console.print("\x1b[H\x1b[2J");
  console.print(seen.screen);
}

Result<int> run_status_command(const StatusOptions& options, CliContext& context) {
  for (;;) {
    ASSIGN_OR_RETURN(const Look seen, look(options.run, context.console));
    show(seen, options, context.console);
    if (!options.watch || !seen.running) return kExitDone;
    pollfd stop{context.stop.fd(), POLLIN, 0};
    ::poll(&stop, 1, kWatchInterval_ms);
    if (context.stop.requested()) return kExitSignalBase + context.stop.signal();
  }
}

}  // namespace

SubcommandRun setup_status(CLI::App& app) {
  auto options = std::make_shared<StatusOptions>();
  app.add_option("RUN", options->run, "Folder of a run, a diagnosis, a comparison or a study")
      ->required();
  app.add_flag("--watch", options->watch, "Look again every second until it ends");
  app.footer(
      "Examples:\n"
      "  gapfarm status run/demo\n"
      "  gapfarm status run/demo --watch\n"
      "  gapfarm status diagnosis\n"
      "  gapfarm status run/demo --json | jq .best_fitness");
  return [options](CliContext& context) { return run_status_command(*options, context); };
}

}  // namespace gapfarm
