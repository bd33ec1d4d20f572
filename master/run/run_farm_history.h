// What a run's store shows of its farm, for its page.
#pragma once

#include "common/base/result.h"
#include "master/report/run/run_report.h"
#include "master/store/run_reader.h"

namespace gapfarm {

// Who came and went.  `alive`: the run's last master is still there.
RunTimeline timeline_of(const std::vector<StoredWorkerEvent>& events, double heartbeat_unix_s,
                        bool alive);

// Workers, their timeline and failures, tallies, what was given up, the end of the log.  Errors: of
// reading the store.
Status add_farm(const RunReader& reader, RunReport* report);

}  // namespace gapfarm
