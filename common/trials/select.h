// Parts of a trial log, picked by what stands in a column.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "common/base/result.h"
#include "common/trials/trial.h"

namespace gapfarm {

using TrialColumnReader = std::function<std::string(const Trial&)>;

// What stands in a column of a log's trials: session, trial, command (or object, the same) or one
// of the log's extra columns.  Error: another.
Result<TrialColumnReader> trial_column_reader(const TrialLog& log, const std::string& column);

// The trials whose columns hold one of the values of every filter, "COLUMN=VALUE[,VALUE...]".
// Values are compared as numbers where both are numbers, as text otherwise.  Errors: a filter
// without '=', a column that the log does not have, nothing left.
Result<TrialLog> select_trials(const TrialLog& log, std::span<const std::string> filters);

// The log with everything in it moved along the world's axes, m.
TrialLog shifted(TrialLog log, double dx_m, double dy_m);

}  // namespace gapfarm
