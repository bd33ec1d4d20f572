// gapfarm status FOLDER: how a run or another long command is doing, from its store alone.

#include <poll.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/trials/files.h"
#include "master/cli/subcommand.h"
#include "master/store/records.h"
#include "master/store/run_lock.h"
#include "master/store/run_reader.h"
#include "master/store/schema.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMostWorkers = 8;
constexpr std::size_t kMostParameters = 12;
constexpr std::size_t kMostOfAKind = 4;  // incidents

// What is shown of a folder: a title, and lines with a label each.
class Screen {
 public:
  Screen(const Console& console, const std::string& folder, const std::string& what,
         const LiveStatus& live)
      : console_(console) {
    const char* style = live.running()                      ? "1;32"
                        : live.state == RunState::kFinished ? "1;34"
                        : live.state == RunState::kFailed   ? "1;31"
                                                            : "1;33";
    const std::string& why = live.running() ? live.waiting : live.stop_reason;
    text_ = styled(folder, "1") + "  " + what + styled(run_state_name(live.state), style) +
            (why.empty() ? "" : ": " + printable(why)) + "\n";
  }

  template <class... Values>
  void line(const std::string& label, fmt::format_string<Values...> format, Values&&... values) {
    const std::string blanks(label.size() < 12 ? 12 - label.size() : 1, ' ');
    text_ +=
        styled(label + blanks, "2") + fmt::format(format, std::forward<Values>(values)...) + "\n";
  }
  void more(std::size_t count) { line("", "... {} more with --json", count); }
  std::string styled(const std::string& text, const char* code) const {
    return console_.styled(text, code);
  }
  const std::string& text() const { return text_; }

 private:
  const Console& console_;
  std::string text_;
};

void show_best(const RunStatus& status, Screen& screen) {
  if (!status.best_individual) return;
  const auto values = parse_json(status.best_individual->values);
  if (!values.is_object()) return;
  std::size_t widest = 0, shown = 0;
  for (const auto& [key, value] : values.items()) widest = std::max(widest, key.size());
  for (const auto& [key, value] : values.items()) {
    if (shown++ == kMostParameters) return screen.more(values.size() - kMostParameters);
    const std::string text = value.is_number_float() ? format_number(value.get<double>())
                             : value.is_string()     ? value.get<std::string>()
                                                     : json_text(value);
    screen.line(shown == 1 ? "best" : "", "{}{}{}", printable(key),
                std::string(widest - key.size() + 2, ' '), printable(text));
  }
}

void show_workers(const LiveStatus& live, double heartbeat_age_s, Screen& screen) {
  const std::vector<WorkerStatus>& workers = live.workers;
  for (std::size_t i = 0; i < std::min(workers.size(), kMostWorkers); ++i) {
    const WorkerStatus& w = workers[i];
    screen.line(i == 0 ? "workers" : "", "{} on {}: {}, {} in hand, {} done{}", printable(w.name),
                printable(w.host), printable(w.state), w.jobs, w.finished, rate_text(w.rate_per_s));
  }
  if (workers.size() > kMostWorkers) screen.more(workers.size() - kMostWorkers);
  for (const FleetStatus& f : live.fleets) {
    screen.line("cluster", "{}: {} workers asked for, {} queued, {} running, {} lost{}",
                printable(f.system), f.wanted, f.queued, f.running, f.lost,
                f.why.empty() ? "" : "; " + printable(f.why));
  }
  if (live.running() && heartbeat_age_s > 5) {
    screen.line("heartbeat", "{} ago", format_duration(heartbeat_age_s));
  }
}

// What the farm coped with; nothing where there was nothing.
void show_farm(const FarmTally& farm, Screen& screen) {
  const std::pair<std::uint64_t, const char*> parts[] = {
      {farm.retries, " retries"},
      {farm.hung, " hung and killed"},
      {farm.copies, " copies of stragglers"},
      {farm.handed_over, " answers kept over a restart"},
      {farm.compared, " answers compared"}};
  std::vector<std::string> all;
  for (const auto& [count, what] : parts) {
    if (count > 0) all.push_back(std::to_string(count) + what);
  }
  if (!all.empty()) screen.line("farm", "{}", fmt::join(all, ", "));
}

std::vector<const Incident*> of_kind(const RunStatus& status, IncidentKind kind) {
  return filtered(
      status.incidents, [&](const Incident& one) { return one.kind == kind; },
      [](const Incident& one) { return &one; });
}

// The latest of them.
void show_incidents(const std::vector<const Incident*>& all, Screen& screen) {
  const std::size_t first = all.size() - std::min(all.size(), kMostOfAKind);
  for (std::size_t i = first; i < all.size(); ++i) {
    screen.line("", "generation {}: {}", all[i]->generation, printable(all[i]->text));
  }
  if (first > 0) screen.line("", "... {} earlier with --json", first);
}

void show_trouble(const RunStatus& status, Screen& screen) {
  show_farm(status.farm, screen);
  if (status.quarantined > 0) {
    screen.line("given up", "{} task{}", status.quarantined, status.quarantined == 1 ? "" : "s");
    show_incidents(of_kind(status, IncidentKind::kQuarantine), screen);
  }
  if (const auto failures = of_kind(status, IncidentKind::kFailure); !failures.empty()) {
    screen.line("failed", "evaluations that the program had no value for");
    show_incidents(failures, screen);
  }
  if (const auto alarms = of_kind(status, IncidentKind::kAlarm); !alarms.empty()) {
    screen.line("alarms", "{}",
                screen.styled("two answers to one task: a machine computes wrongly", "1;31"));
    show_incidents(alarms, screen);
  }
}

// Of several objectives.
void show_front(const RunFront& front, Screen& screen) {
  if (front.members.empty()) return;
  screen.line("front",
              "{} members, the best is its knee; others: --json, gapfarm replay RUN --genome ID "
              "--out MODEL",
              front.members.size());
  for (std::size_t m = 0; m < front.objectives.size(); ++m) {
    screen.line("", "{}, {} is better: ideal {}, knee {}, nadir {}; hypervolume from {}",
                printable(front.objectives[m].name),
                front.objectives[m].maximise ? "higher" : "lower", format_number(front.ideal[m]),
                format_number(front.members[front.knee].objectives[m].second),
                format_number(front.nadir[m]), format_number(front.reference[m]));
  }
  if (!front.hypervolume.back()) return;
  screen.line("hypervolume", "{}", format_number(front.hypervolume.back()));
}

std::string status_screen(const RunStatus& status, const std::string& run, const Console& console) {
  const bool running = status.running();
  const RunInfo& info = status.info;
  Screen screen(console, run, "", status);
  screen.line("generation", "{}{}", status.last.generation,
              running && status.total > 0
                  ? fmt::format(", and {} of {} tasks of the next", status.done, status.total)
                  : "");
  screen.line("evaluations", "{}{}{}", status.last.evaluations, rate_text(status.rate_per_s),
              !running             ? ", in " + format_duration(status.wall_s)
              : status.time_left_s ? ", " + format_duration(*status.time_left_s) + " left"
                                   : "");
  screen.line("fitness", "{}{}, {} is better{}", info.fitness,
              info.fitness_unit == "-" ? "" : " (" + info.fitness_unit + ")",
              info.higher_is_better ? "higher" : "lower",
              status.best_individual && status.best_individual->outcome == "INFEASIBLE"
                  ? "; nothing feasible was found yet"
                  : "");
  if (status.last.generation > 0) {
    const unsigned scores = status.best_individual ? status.best_individual->scores : 1;
    screen.line("", "best {}{}, mean {}, worst {}", format_number(status.last.best),
                scores > 1 ? fmt::format(" (of {} noisy scores, the luckiest of all)", scores) : "",
                format_number(status.last.mean), format_number(status.last.worst));
  }
  show_front(status.front, screen);
  show_best(status, screen);
  show_workers(status, status.heartbeat_age_s, screen);
  show_trouble(status, screen);
  if (const std::string start = search_start_text(info); !start.empty()) {
    screen.line("began at", "{}", printable(start));
  }
  screen.line("seed", "{}", info.seed);
  if (!status.last.digest.empty()) screen.line("digest", "{}", status.last.digest);
  if (status.state == RunState::kStopped)
    screen.line("go on with", "gapfarm resume {}", shell_quoted(run));
  return screen.text();
}

// About a diagnosis, a comparison or a study in `folder`.
std::string command_screen(const CommandRecord& record, const std::string& folder,
                           double now_unix_s, const Console& console) {
  const bool running = record.running(), over = record.state == RunState::kFinished;
  Screen screen(console, folder, printable(record.command) + " ", record);
  if (!over && record.number > 0) {
    screen.line("stage", "{} of {}: {}{}", record.number, record.stages, printable(record.stage),
                record.total > 0 ? fmt::format(", {} of {}", record.done, record.total) : "");
  }
  screen.line("done", "{}{}{}", format_share(over ? 1 : record.share),
              running ? rate_text(record.rate_per_s) : "",
              !over && record.time_left_s
                  ? ", about " + format_duration(*record.time_left_s) + " left"
                  : "");
  screen.line("simulated", "{}{}", record.simulated,
              record.remembered > 0 ? fmt::format(", and {} remembered", record.remembered) : "");
  screen.line(
      "took", "{}, process {} on {}",
      format_duration((running ? now_unix_s : record.heartbeat_unix_s) - record.began_unix_s),
      record.pid, printable(record.host));
  for (const auto& [stage, found] : record.findings) {
    screen.line("so far", "{}", printable(found.text));
  }
  show_workers(record, now_unix_s - record.heartbeat_unix_s, screen);
  if (record.state == RunState::kStopped)
    screen.line("go on with", "{}", printable(record.arguments));
  return screen.text();
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
  const std::filesystem::path partial = path + ".partial";
  return is_there(answer_file(partial)) ? partial : std::filesystem::path(path);
}

Result<Look> look(const std::string& run, const Console& console) {
  const double now_s = unix_now_s();
  if (!is_there(run_store_file(run)) || command_folder(run) != run) {
    ASSIGN_OR_RETURN(const auto record, command_status(command_folder(run), now_s));
    if (record) {
      return Look{to_json(*record), command_screen(*record, run, now_s, console),
                  record->running()};
    }
  }
  ASSIGN_OR_RETURN(const RunReader reader, RunReader::open(run));
  ASSIGN_OR_RETURN(const RunStatus status, run_status(reader, now_s));
  return Look{to_json(status), status_screen(status, run, console), status.running()};
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
