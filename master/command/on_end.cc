// --on-end COMMAND: what a user wants run when a long command is over; --dry-run: nothing at all.
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "common/process/child.h"
#include "master/command/context.h"
#include "master/command/long_command.h"

namespace gapfarm {
namespace {

std::string value_of(const CLI::App& command, const std::string& name) {
  const CLI::Option* option = command.get_option_no_throw(name);
  return option == nullptr || option->count() == 0 ? std::string() : option->results().front();
}

// The folder or file that the command leaves, as a whole path; empty: none.
std::string out_of(const CLI::App& command) {
  std::string out = value_of(command, "--out");
  if (out.empty()) out = value_of(command, "RUN");
  if (out.empty() || out == "-") return {};
  std::error_code code;
  const auto whole = std::filesystem::absolute(out, code);
  return code ? out : whole.string();
}

// Its exit status, or what kept it from starting.
Result<int> run_shell(const std::string& text, const std::vector<std::string>& variables) {
  ChildSetup setup;
  setup.arguments = {"/bin/sh", "-c", text};
  setup.environment = variables;
  setup.in = STDIN_FILENO;
  setup.death_signal = 0;
  const Result<pid_t> pid = start_child(setup);
  if (!pid) return Error{"cannot start it: " + pid.error().message};
  int status = 0;
  while (waitpid(*pid, &status, 0) < 0) {
    if (errno != EINTR) return Error{std::string("lost sight of it: ") + std::strerror(errno)};
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : kExitSignalBase + WTERMSIG(status);
}

}  // namespace

void declare_long_command(CLI::App& app) {
  app.add_option_function<std::string>(
         "--on-end", [](const std::string&) {},
         "Shell command to run when this one ends, stops or fails, with GAPFARM_COMMAND, "
         "GAPFARM_OUT, GAPFARM_STATE (finished, stopped, failed) and GAPFARM_EXIT set")
      ->type_name("COMMAND");
  const std::string summary = "Check everything and report what would be done; do nothing";
  app.add_flag("--dry-run", summary);
}

bool is_dry_run(const CLI::App& command) {
  const CLI::Option* option = command.get_option_no_throw("--dry-run");
  return option != nullptr && option->count() > 0;
}

void conclude_command(const CLI::App& command, int exit_code, CliContext& context) {
  if (context.work != nullptr) context.work->end(exit_code);
  const std::string text = value_of(command, "--on-end");
  if (text.empty() || context.dry_run) return;
  const auto status =
      run_shell(text, {"GAPFARM_COMMAND=" + command.get_name(), "GAPFARM_OUT=" + out_of(command),
                       "GAPFARM_STATE=" + state_of_exit(exit_code),
                       "GAPFARM_EXIT=" + std::to_string(exit_code)});
  if (!status) {
    context.console.error(Error{"--on-end: " + status.error().message});
  } else if (*status != 0) {
    context.console.error(
        Error{"--on-end: the command ended with status " + std::to_string(*status)});
  }
}

}  // namespace gapfarm
