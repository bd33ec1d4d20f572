// One evolution from a store's checkpoint to a reason to stop: what `evolve` and `resume` do.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/config/settings.h"
#include "common/log/log.h"
#include "common/trials/trial.h"
#include "master/evolve/evolve.h"
#include "master/run/evolution_farm.h"
#include "master/run/validation.h"
#include "master/store/run_store.h"

namespace gapfarm {

struct RunRequest {
  const Config& config;  // overrides applied; its log may be empty
  const Problem& problem;
  Log& log;
  // Called once all inputs are known to be sound.  What happens in the farm goes to `keep`.
  std::function<Result<std::unique_ptr<FarmOfRun>>(std::function<void(const FarmEvent&)> keep)>
      open_farm;
  std::function<bool()> stop_requested;  // may be empty; the farm is notified separately
};

struct RunSummary {
  EvolveSummary evolved;
  // Tasks given up, by this master and those before it.
  std::uint64_t given_up = 0;
  std::size_t held_out = 0;          // trials or windows
  std::vector<Validated> validated;  // on those
  // Left in the run's folder; none where the run was stopped, or nothing ended well.
  std::vector<std::string> files;

  bool stopped() const { return evolved.reason == StopReason::kRequested; }
};

// Evolves from the store's last checkpoint and commits every generation.  Unless it was stopped it
// holds the best against what was held out, and leaves model.toml, report.html, poses.svg and
// fitness.svg behind.  Errors: of the store, the farm, what [validation] names; the store says then
// that the run stopped, and why.
Result<RunSummary> evolve_run(RunStore& store, const RunRequest& request, RunWatcher& watcher);

// Says in the store that the run stopped by this error, which it returns.  `last`: what else its
// live row says.
Error stopped_by(RunStore& store, Error error, const Progress& last = {});

}  // namespace gapfarm
