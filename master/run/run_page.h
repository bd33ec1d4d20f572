// A run's page, from its store alone.
#pragma once

#include <vector>

#include "common/base/result.h"
#include "common/config/settings.h"
#include "common/problem/problem.h"
#include "master/evolve/evolve.h"
#include "master/farm/farm.h"
#include "master/report/figures/pose_picture.h"
#include "master/report/run/run_report.h"
#include "master/run/run.h"
#include "master/store/records.h"
#include "master/store/run_store.h"

namespace gapfarm {

// The log as the config's values and the best predict it, for RunStore::keep_document().  Where one
// of the two did not end well its poses are not numbers.
RunOutcome run_outcome(const Problem& problem, const PredictionOfLog* before,
                       const PredictionOfLog* after, const std::vector<ScoreRow>& validated);

// The document's name in the store.
inline constexpr const char* kOutcomeDocument = "outcome";

// Whatever the store of a run holds, running, stopped or finished.  Errors: RunReader::open()'s, a
// problem that cannot be read.
Result<RunReport> read_run_report(const RunQuestion& question);

// The problem on what the run's config holds out; none when it names nothing.  Errors: of reading
// that, which may have gone since.
Result<std::optional<Problem>> held_out_of(const RunInfo& info, const Problem& problem);

// Beside a run: what `gapfarm determine --out` wrote of it.
inline constexpr const char* kDeterminedFile = "determined.csv";

// The names of what write_outputs() writes.
std::vector<std::string> output_files(const Problem& problem);

// `validated`: what is known of trials held out.  REQUIRES: a best member whose outcome is OK.
Status write_outputs(RunStore& store, const Problem& problem, const Config& config,
                     const EvolveSummary& summary, Farm& farm,
                     const std::vector<ScoreRow>& validated, RunWatcher& watcher);

}  // namespace gapfarm
