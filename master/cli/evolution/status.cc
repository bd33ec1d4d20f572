// gapfarm status FOLDER: how a run or another long command is doing, from its store alone.
#include <poll.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/base/try.h"
#include "common/json/json.h"
#include "master/cli/evolution/status_view.h"
#include "master/cli/subcommand.h"
#include "master/command/long_command.h"
#include "master/store/run_lock.h"
#include "master/store/run_status.h"
#include "master/store/schema.h"

namespace gapfarm {
namespace {

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
