// What a run's store shows of how it went on, for its page.
#pragma once

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

}  // namespace gapfarm
