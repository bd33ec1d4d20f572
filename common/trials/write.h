// Writes trial logs (docs/formats.md).
#pragma once

#include <string>

#include "common/base/result.h"
#include "common/trials/trial.h"

namespace gapfarm {

// The text of a trials.csv, or of a pushes.csv for a log with tips; every number reads back as the
// same bits.
std::string format_trials(const TrialLog& log);
// The text of a paths.csv; a header alone when no trial has a path.
std::string format_paths(const TrialLog& log);

// The text of a tips.csv.
std::string format_tips(const TrialLog& log);

// Writes `path`, and paths.csv and tips.csv beside it when the log has them.  Each file appears
// whole or not at all.  Errors: what would not read back (an empty session, extra values without a
// column, a repeated trial, a number that is not finite), a paths.csv of another log in the way,
// the file system's own.
Status write_trials(const TrialLog& log, const std::string& path);

}  // namespace gapfarm
