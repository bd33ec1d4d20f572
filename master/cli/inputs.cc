#include "master/cli/inputs.h"

#include <algorithm>
#include <filesystem>
#include <thread>

#include "common/config/config.h"
#include "common/trials/read.h"

namespace gapfarm {

std::vector<std::string> command_names(const std::vector<CommandSpec>& commands) {
  std::vector<std::string> names;
  for (const CommandSpec& command : commands) names.push_back(command.name);
  return names;
}

Result<Config> read_config_and_trials(const std::string& config_path,
                                      const std::vector<std::string>& trial_files) {
  Result<Config> config = read_config(config_path);
  if (!config) return config.error();
  if (!trial_files.empty()) config->trial_files = trial_files;
  if (config->trial_files.empty()) {
    return Error{config_path +
                 ": names no trial files; add them to the config or give --trials FILE"};
  }
  Result<TrialLog> log =
      read_trial_files(config->trial_files, command_names(config->problem.commands));
  if (!log) return log.error();
  config->problem.log = std::move(*log);
  const Result<Problem> sound = from_proto(to_proto(config->problem));
  if (!sound) return sound.error();
  return config;
}

void show_notes(const TrialLog& log, Console& console) {
  for (const std::string& note : log.notes) console.note(note);
}

Result<Model> read_model_of(const std::string& run_or_model) {
  const std::filesystem::path path(run_or_model);
  std::error_code ignored;
  if (!std::filesystem::is_directory(path, ignored)) return read_model(run_or_model);
  const std::filesystem::path model = path / "model.toml";
  if (std::filesystem::exists(model, ignored)) return read_model(model.string());
  return Error{run_or_model +
               ": has no model.toml; a run leaves it when it ends, see `gapfarm "
               "status` and `gapfarm resume`"};
}

void FarmOptions::declare(CLI::App& app, bool remote) {
  app.add_option("--workers", workers, "Local worker processes (default: one a core)")
      ->check(CLI::Range(0, 4096));
  if (!remote) return;
  app.add_option("--listen", listen, "Endpoint for remote workers, tcp://HOST:PORT; may repeat");
}

unsigned local_workers(const FarmOptions& options, const FarmSettings& settings) {
  if (options.workers >= 0) return static_cast<unsigned>(options.workers);
  return settings.workers.value_or(std::max(1u, std::thread::hardware_concurrency()));
}

Result<std::unique_ptr<SocketFarm>> start_farm(const FarmOptions& options,
                                               const FarmSettings& settings, CliContext& context,
                                               SocketFarmOptions base) {
  base.local_workers = local_workers(options, settings);
  base.listen = options.listen;
  if (base.listen.empty() && settings.listen) base.listen = {*settings.listen};
  base.window = settings.window;
  base.heartbeat_interval_s = settings.heartbeat_interval_s;
  base.silence_limit_s = settings.silence_limit_s;
  base.allow_mixed_numeric_classes = settings.allow_mixed_numeric_classes;
  base.stop = &context.stop;
  return SocketFarm::create(std::move(base));
}

int failed(const Error& error, CliContext& context) {
  context.console.clear_progress();
  if (context.stop.requested()) return kExitSignalBase + context.stop.signal();
  context.console.error(error);
  return kExitFailed;
}

}  // namespace gapfarm
