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

// The problem with what [validation] holds out in place of its trials; none when it names none.
// Errors: of reading, a file or folder that is among those evolved on.
Result<std::optional<Problem>> read_validation(const StagePlan& plan, const Config& config);

// What a run needs of its config.  Errors of check_evolvable(), read_stages() and
// read_validation().
Status check_runnable(const Config& config);

// Fitness on what was held out of the problem's own values, each stage's result and the best.
Result<std::vector<Validated>> validate(Farm& farm, const Problem& apart,
                                        const std::vector<Genome>& stages, const Genome& best);

}  // namespace gapfarm
