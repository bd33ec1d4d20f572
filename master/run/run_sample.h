// What a run's individuals show of its genes and objectives, for its page.
#pragma once

#include <vector>

#include "common/problem/problem.h"
#include "master/report/run/run_report.h"
#include "master/store/run_reader.h"

namespace gapfarm {

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
