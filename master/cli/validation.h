// Trials that evolution never saw.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/config/stages.h"
#include "common/problem/problem.h"
#include "master/farm/farm.h"

namespace gapfarm {

struct Validated {
  std::string name;  // "the config's own values", "after stage 1", "the best"
  std::optional<double> fitness;
};

// The trials that [validation] keeps apart; none when it names none.  Errors: of reading, a file
// that is among the trials evolved on.
Result<std::optional<TrialLog>> read_validation(const StagePlan& plan, const Config& config);

// What a run needs of its config.  Errors of check_evolvable(), read_stages() and
// read_validation().
Status check_runnable(const Config& config);

// Fitness on `log` of the problem's own values, each stage's result and the best.
Result<std::vector<Validated>> validate(Farm& farm, const Problem& problem, const TrialLog& log,
                                        const std::vector<Genome>& stages, const Genome& best);

}  // namespace gapfarm
