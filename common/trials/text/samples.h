// What was recorded along trials and lies in files of its own: internal to common/trials.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/trials/text/mistakes.h"
#include "common/trials/trial.h"

namespace gapfarm {

// Adds the samples of a paths.csv or a tips.csv to the trials of `logs` that they name.  Mistakes:
// also a trial that has such samples already, or that two of the logs hold.  A note in the first
// log reports rows without a trial.  Nothing is added when the text cannot be read.
void add_paths(std::string_view text, const std::string& file, const std::vector<TrialLog*>& logs,
               Mistakes& mistakes);
void add_tips(std::string_view text, const std::string& file, const std::vector<TrialLog*>& logs,
              Mistakes& mistakes);

}  // namespace gapfarm
