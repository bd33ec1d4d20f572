// Writes trial logs (docs/formats.md).
#pragma once

#include <string>
#include <vector>

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

struct TrialFile {
  std::string path;
  std::string text;
};

// The files that a log at `path` is made of, in the order to write them: paths.csv, marked as this
// log's (log_marks()), and tips.csv beside it when it has them, then `path` itself.  Errors: what
// would not read back (an empty session, extra values without a column, a repeated trial, a number
// that is not finite), a path named like what lies beside a log.
Result<std::vector<TrialFile>> trial_files(const TrialLog& log, const std::string& path);

// Where trial_files() will put a log that is not there yet.
std::vector<std::string> trial_file_names(const std::string& path, bool paths, bool tips);

// Writes them.  Each file appears whole or not at all, in place of what is there.
Status write_trials(const TrialLog& log, const std::string& path);

}  // namespace gapfarm
