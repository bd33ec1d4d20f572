// What a command is given, and how it may end.
#pragma once

#include <memory>

#include "common/process/stop.h"
#include "master/command/console.h"

namespace gapfarm {

enum ExitCode : int {
  kExitDone = 0,
  kExitFailed = 1,        // the work had begun
  kExitBadUsage = 2,      // wrong usage, config or input: found before the work began
  kExitQuarantined = 3,   // done, but some tasks were given up
  kExitChanged = 4,       // done: `watch` found that something changed
  kExitResumable = 85,    // stopped; the same command, or `resume`, goes on from there
  kExitSignalBase = 128,  // + the signal, 130 or 143: stopped, and nothing is kept
};

class LongCommand;

struct CliContext {
  Console& console;
  StopSource& stop;  // requested by SIGINT and SIGTERM; a second one ends the program at once
  std::shared_ptr<LongCommand> work{};  // of a long command, once it has begun
  bool dry_run = false;                 // all is to be checked and reported, and nothing done
  // Set as soon as the input is found good: an error is then kExitFailed, before kExitBadUsage.
  bool begun = false;
};

}  // namespace gapfarm
