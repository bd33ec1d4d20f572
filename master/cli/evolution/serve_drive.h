// One drive of a run's log, measured and simulated, for a page that plays it.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "common/base/result.h"
#include "master/cli/subcommand.h"
#include "master/farm/socket_farm.h"
#include "master/serve/site.h"

namespace gapfarm {

// Simulates on one worker of its own, which begins with the first question.  No run's farm is
// asked.
class DriveShower {
 public:
  explicit DriveShower(CliContext& context) : context_(context) {}

  // JSON for watch.js: paths of [t s, x m, y m, heading rad] from the start, by the config's values
  // ("before") and by the best of the generation ("best"), both without noise.  Errors: no such
  // trial or generation, a drive that does not end well.
  Result<std::string> show(const DriveQuestion& question);

 private:
  CliContext& context_;
  std::unique_ptr<SocketFarm> farm_;
  std::map<std::string, std::string> shown_;  // answers to what was asked
};

}  // namespace gapfarm
