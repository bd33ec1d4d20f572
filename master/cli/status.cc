// gapfarm status RUN: how a run is doing, from its store alone.
#include <poll.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>

#include "master/cli/status_view.h"
#include "master/cli/subcommand.h"
#include "master/store/run_status.h"

namespace gapfarm {
namespace {

constexpr int kWatchInterval_ms = 1000;

struct StatusOptions {
  std::string run;
  bool watch = false;
};

Result<RunStatus> look(const std::string& run) {
  const Result<RunReader> reader = RunReader::open(run);
  if (!reader) return reader.error();
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return run_status(*reader, std::chrono::duration<double>(now).count());
}

void show(const RunStatus& status, const StatusOptions& options, Console& console) {
  if (console.json()) {
    // Watched: one line a look, for `jq` and the like.
    const int indent = options.watch ? -1 : 2;
    console.print(
        to_json(status).dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace) +
        "\n");
    return;
  }
  const std::string screen = status_screen(status, options.run, console);
  if (options.watch && console.out_is_terminal()) console.print("\x1b[H\x1b[2J");
  console.print(screen);
}

int run_status_command(const StatusOptions& options, CliContext& context) {
  for (;;) {
    const Result<RunStatus> status = look(options.run);
    if (!status) {
      context.console.error(status.error());
      return kExitBadUsage;
    }
    show(*status, options, context.console);
    if (!options.watch || status->state != RunState::kRunning) return kExitDone;
    pollfd stop{context.stop.fd(), POLLIN, 0};
    ::poll(&stop, 1, kWatchInterval_ms);
    if (context.stop.requested()) return kExitSignalBase + context.stop.signal();
  }
}

}  // namespace

SubcommandRun setup_status(CLI::App& app) {
  auto options = std::make_shared<StatusOptions>();
  app.add_option("RUN", options->run, "Folder of the run")->required();
  app.add_flag("--watch", options->watch, "Look again every second until the run ends");
  app.footer(
      "Examples:\n"
      "  gapfarm status run/demo\n"
      "  gapfarm status run/demo --watch\n"
      "  gapfarm status run/demo --json | jq .best_fitness");
  return [options](CliContext& context) { return run_status_command(*options, context); };
}

}  // namespace gapfarm
