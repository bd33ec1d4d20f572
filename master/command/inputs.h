// What several subcommands read and start in the same way.
#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/config/model.h"
#include "common/config/settings.h"
#include "common/net/keys.h"
#include "common/problem/run_files.h"
#include "master/command/context.h"
#include "master/command/farm_log.h"
#include "master/command/trial_options.h"
#include "master/farm/socket_farm.h"

namespace gapfarm {

// A config with its trials read: those given, else the config's own.  Errors: neither names any
// file, and whatever reading either finds.
Result<Config> read_config_and_trials(const std::string& config_path, const TrialOptions& trials);

// A config, or a model as a config without trials.
struct Source {
  Config config;
  double frame_x_m = 0, frame_y_m = 0;  // world position that its places count from
};
Result<Source> read_source(const std::string& path);

// The config that a command works on, with its trials and the log's notes shown.  `finish` puts in
// what the command line changes and checks what the command needs.
Result<Config> open_config(const std::string& config_path, const TrialOptions& trials,
                           Console& console, const std::function<Status(Config&)>& finish);

// --workers, --listen and what goes with them.
struct FarmOptions {
  int workers = -1;  // -1: as the config says, else one a core
  std::vector<std::string> listen;
  std::string keys = KeyFolder::default_path();
  bool insecure = false;
  bool insecure_anywhere = false;
  LogFlags log;

  void declare(CLI::App& app, bool remote);
};

unsigned local_workers(const FarmOptions& options, const FarmSettings& settings);

// What can be checked before anything is made: keys that are missing, endpoints that would be open.
Status check_farm(const FarmOptions& options, const FarmSettings& settings);

// Starts the farm: the work has begun.
Result<std::unique_ptr<SocketFarm>> start_farm(const FarmOptions& options,
                                               const FarmSettings& settings, CliContext& context,
                                               SocketFarmOptions base = {});

// Where --dry-run ends a command whose input is checked: says what `would` be done ("evolve 7
// parameters ...") and by whom, with `facts` for --json.
Result<int> print_dry_run(const std::string& would, nlohmann::ordered_json facts,
                          const FarmOptions& options, const FarmSettings& settings,
                          CliContext& context);

// A farm that is asked through the command's LongCommand.
struct RecordedWork {
  std::unique_ptr<SocketFarm> sockets;
  std::unique_ptr<Farm> farm;

  Farm& operator*() const { return *farm; }
  Farm* operator->() const { return farm.get(); }
};
Result<RecordedWork> start_recorded(const FarmOptions& options, const FarmSettings& settings,
                                    CliContext& context);

// What a command exits with that ends with this error, which is shown: kExitBadUsage before its
// work begins.  After a signal kExitResumable, with a sentence how to go on, where the command
// keeps what it simulates (LongCommand), else 130 or 143; without one kExitFailed.
int failed(const Error& error, CliContext& context);

}  // namespace gapfarm
