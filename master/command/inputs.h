// What several subcommands read and start in the same way.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <optional>
#include <vector>

#include "common/config/config.h"
#include "common/config/model.h"
#include "common/config/settings.h"
#include "common/net/keys.h"
#include "common/problem/problem.h"
#include "common/trials/read.h"
#include "master/command/console.h"
#include "master/farm/socket_farm.h"
#include "master/io/log_checks/log_checks.h"
#include "master/run/stored_run.h"

namespace gapfarm {

// While it lives, the console's notes and errors are lines of a log that is not for people.
class NotesGoTo {
 public:
  NotesGoTo(Log& log, Console& console) : console_(console) {
    if (log.format() == LogFormat::kJson) console_.use(&log);
  }
  ~NotesGoTo() { console_.use(nullptr); }
  NotesGoTo& operator=(NotesGoTo&&) = delete;

 private:
  Console& console_;
};

// Lets `options` report events, and single jobs at level debug, to `log`, which outlives the farm.
void report_to(Log& log, SocketFarmOptions& options);
// Lets `options` report what went wrong to the user, and all events to the console's kept file.
void report_to(Console& console, SocketFarmOptions& options);

struct TrialOptions {
  std::vector<std::string> files;
  ReadOptions read;
  bool needed = true;  // false: scenario objective, which has none, is taken too

  // --trials, with this help, and declare_reading().
  CLI::Option* declare(CLI::App& app,
                       const std::string& help = "Trial logs in place of the config's");
  // --paths, --skip-invalid and --session-prefix, for logs that another option names.
  void declare_reading(CLI::App& app);
};

// What the readers omitted from a log and which files they read, to stderr.
void show_notes(const TrialLog& log, Console& console);

// The warnings of `check` about a log; of a ground robot's, whose folders are `runs`, what is the
// wrong way round.  `impossible`: check_sanity()'s.
std::vector<SanityFinding> log_warnings(const Problem& problem,
                                        const std::vector<std::string>& runs,
                                        std::vector<std::size_t>* impossible = nullptr);
// The same, a note each, except that its trials are few.
void show_warnings(const Problem& problem, const std::vector<std::string>& runs, Console& console);

std::size_t count_sessions(const TrialLog& log);

// Reads the log of a config: the trials or runs given, else its own.  Errors: neither names any,
// the scenario has none, and whatever reading finds.
Status read_log_of(const TrialOptions& trials, Config* config);
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
  std::vector<std::string> listen = {};
  std::string keys = KeyFolder::default_path();
  bool insecure = false;
  bool insecure_anywhere = false;
  LogFormat log_format = LogFormat::kText;
  std::optional<LogLevel> log_level = {};  // none: warnings as text, info as JSON

  void declare(CLI::App& app, bool remote);
  std::unique_ptr<Log> open_log() const;
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
Result<int> print_dry_run(const std::string& would, Json facts, const FarmOptions& options,
                          const FarmSettings& settings, CliContext& context);

// The same, asked through the command's LongCommand.
Result<std::unique_ptr<Farm>> start_recorded(const FarmOptions& options,
                                             const FarmSettings& settings, CliContext& context);

// What a command exits with that ends with this error, which is shown: kExitBadUsage before its
// work begins.  After a signal kExitResumable, with a sentence how to go on, where the command
// keeps what it simulates (LongCommand), else 130 or 143; without one kExitFailed.
int failed(const Error& error, CliContext& context);

// A model file, or the model of a run's or a diagnosis's folder: its model.toml, or, where a run
// has gone further than that says or left none, its best so far, of which a note shows.
Result<Model> find_model(const std::string& run_or_model, Console& console);
// The same; of a scenario that predicts trials (check_can()).
Result<Model> read_model_of(const std::string& run_or_model, Console& console);

// What was fitted to, and at which values a simulation is driven.
struct FittedRuns {
  Problem problem;
  ParameterValues values;
  WindowSettings windows;
  std::vector<std::string> folders;
  std::string robot_path = {};  // of a config
};

// A finished run's, or a config's own; `folders`, where some are given, are in place of what was
// fitted to or the config names.
Result<FittedRuns> open_fitted(const std::string& source, const std::vector<std::string>& folders,
                               Console& console);

// An error where the model is one of another scenario or robot than the config's.
Status check_same_robot(const Model& model, const std::string& path, const Config& config,
                        const std::string& config_path);

// An error where the model has a [residual], which `user` ("drive") cannot take along.
Status check_no_residual(const Model& model, const std::string& path, const std::string& user);

}  // namespace gapfarm
