// Options of the commands that trace paths.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "master/influence/paths.h"

namespace gapfarm {

struct TracedCommands {
  std::vector<std::string> names;  // empty: all
  double interval_s = 0.02;

  void declare(CLI::App& app);
  // Error: a name that is none of `known`; no commands at all.
  Status choose(const std::vector<CommandSpec>& known, std::uint64_t seed, TraceSettings* to) const;
};

}  // namespace gapfarm
