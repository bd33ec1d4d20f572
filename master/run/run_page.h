// A run's page, from its store alone.
#pragma once

#include "master/farm/farm.h"
#include "master/report/figures/figures.h"
#include "master/run/run.h"
#include "master/store/records.h"
#include "master/store/run_reader.h"

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

// What a finished run is for: its model, held against `held_out` and against no simulation; into
// `summary` what came of it.  REQUIRES: a best member whose outcome is OK.
Status write_outputs(RunStore& store, const RunRequest& run, const std::optional<Problem>& held_out,
                     Farm& farm, RunWatcher& watcher, RunSummary* summary);

// What a run's store shows of how it went on, for its page.

// Fills in operators, densities, elite, genomes and the farm.  Of long runs some generations are
// read, so that any run's page takes as long as another's.  Errors: of reading the store.
Status add_history(const RunReader& reader, const Problem& problem,
                   const std::vector<StoredGeneration>& generations, const RunQuestion& question,
                   RunReport* report);

// Who came and went.  `alive`: the run's last master is still there.
RunTimeline timeline_of(const std::vector<StoredWorkerEvent>& events, double heartbeat_unix_s,
                        bool alive);

// Workers, their timeline and failures, tallies, what was given up, the end of the log.  Errors: of
// reading the store.
Status add_farm(const RunReader& reader, RunReport* report);

// The first of `last` over its objectives, where there are several, and its genes.
RunElite run_elite(const Problem& problem, const std::vector<StoredIndividual>& last);

// `members`: each once, with a fitness.  The importance of a gene is first_order_index() on the
// ranks of the fitness, or of each of several objectives: ranks, since a search that has settled
// leaves few, wild values far away.
RunSample run_sample(const Problem& problem, const std::vector<StoredIndividual>& members);

// The whole history as CSV, a row an individual in the order of birth, as it first appeared: its
// parameters, objectives, and what the run had spent by the end of its generation.  Errors: of
// reading the store.
Result<std::string> history_csv(const RunReader& reader);

}  // namespace gapfarm
