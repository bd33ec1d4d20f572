// --trials and how to read them: the same options wherever a command reads logs.
#pragma once

#include <CLI/CLI.hpp>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "common/trials/read.h"

namespace gapfarm {

class Console;

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

}  // namespace gapfarm
