// Options of the commands that trace paths.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "common/config/settings.h"
#include "master/command/trial_options.h"
#include "master/experiments/influence/paths.h"

namespace gapfarm {

struct TracedCommands {
  std::vector<std::string> names;  // empty: all
  double interval_s = 0.02;
  TrialOptions trials;  // where commands are pieces
  std::vector<std::string> only;

  void declare(CLI::App& app);
  // The config, and in `to` what of it is traced: its commands, or the pushes of a log where the
  // commands are pieces.  Errors: of reading either, a name that is no command, nothing to trace.
  Result<Config> open(const std::string& path, TraceSettings* to) const;

 private:
  Status choose(const std::vector<CommandSpec>& known, TraceSettings* to) const;
};

}  // namespace gapfarm
