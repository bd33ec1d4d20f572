// One evolution from a store's checkpoint to a reason to stop: what `evolve` and `resume` do.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/config/config.h"
#include "common/config/model.h"
#include "common/config/settings.h"
#include "common/log/log.h"
#include "common/problem/problem.h"
#include "common/score/baselines.h"
#include "common/trials/trial.h"
#include "master/evolve/evolve.h"
#include "master/farm/scheduler.h"
#include "master/report/run/run_report.h"
#include "master/store/run_store.h"

namespace gapfarm {

// The problem with what [validation] holds out in place of its trials; none when it names none.
// Errors: of reading, a file or folder that is among those evolved on.
Result<std::optional<Problem>> read_validation(const StagePlan& plan, const Config& config);

// What a run needs of its config.  Errors of check_evolvable(), read_stages() and
// read_validation().
Status check_runnable(const Config& config);

// Fitness on what was held out of the problem's own values, each stage's result and the best.
Result<std::vector<ScoreRow>> validate(const RunStore& store, const Problem& apart, Farm& farm,
                                       const Genome& best);

// What those who watch a run hear while it goes on.
class RunWatcher {
 public:
  virtual ~RunWatcher() = default;
  virtual void note(std::string_view) {}
  // The run goes on all the same.
  virtual void error(const Error&) {}
  // In place of the last one; `news`: it is not just more of the same.  Empty: there is none now.
  virtual void progress(std::string_view, bool /*news*/) {}
  // A log that the run takes beside its own.
  virtual void read(const TrialLog&) {}
};

struct RunRequest {
  const Config& config;  // overrides applied; its log may be empty
  const Problem& problem;
  Log& log;
  // Called once all inputs are known to be sound.  What happens in the farm goes to `keep`.
  std::function<Result<std::unique_ptr<Farm>>(std::function<void(const FarmEvent&)> keep)>
      open_farm;
  std::function<bool()> stop_requested;  // may be empty; the farm is notified separately
};

// What searches for the run, begun or as the checkpoint has it, with notes on how and why.  Errors:
// of its setup, the farm's.
Result<std::unique_ptr<Optimiser>> optimiser_of(const RunRequest& run, const StagePlan& plan,
                                                const std::optional<Checkpoint>& checkpoint,
                                                Farm& farm, RunWatcher& watcher);

struct RunSummary {
  EvolveSummary evolved;
  // Tasks given up, by this master and those before it.
  std::uint64_t given_up = 0;
  std::string failure;       // the last evaluations that a program had no answer to, in a sentence
  std::size_t held_out = 0;  // trials or windows
  std::vector<ScoreRow> validated;  // on those
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

// What predictions without a simulation score, beside a model: notes for people.

// Beside the model's log scores, one a trial of `log`; empty where no command repeats enough or
// baselines make no sense.  Learned from the trials behind the model; where those are not at hand,
// or share some with it, from the other sessions of `log`.  The sentence says which.
Result<std::string> baseline_note(const Model& model, const TrialLog& log,
                                  std::span<const double> scores);

// Beside a prediction of the problem's trials, each baseline learned from the other sessions; none
// where baselines make no sense.
Result<std::vector<BaselineComparison>> baselines_beside(const Problem& problem,
                                                         const v1::PredictResult& prediction);
// The same as a sentence; empty where there are none.
std::string baseline_note_of_run(const std::vector<BaselineComparison>& beside);

}  // namespace gapfarm
