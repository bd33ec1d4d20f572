// What a run's store shows of how it went on, for its page.
#pragma once

#include <vector>

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "master/report/run/run_report.h"
#include "master/store/run_reader.h"

namespace gapfarm {

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
