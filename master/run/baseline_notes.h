// What predictions without a simulation score, beside a model: notes for people.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/config/model.h"
#include "common/problem/problem.h"
#include "common/score/baselines.h"
#include "master/farm/farm.h"

namespace gapfarm {

// Whether a scenario's commands can repeat, so that there is something to learn from repeats.
bool has_baselines(std::string_view scenario);

// The trials that a model was fitted to, where its files are still at hand and hold as many.
std::optional<TrialLog> trials_behind(const Model& model);

// Beside the model's log scores, one a trial of `log`; empty where no command repeats enough or
// baselines make no sense.  Learned from the trials behind the model; where those are not at hand,
// or are the same, from the other sessions of `log`.  The sentence says which.
Result<std::string> baseline_note(const Model& model, const TrialLog& log,
                                  std::span<const double> scores);

// Beside the log scores that the problem's own trials have at a genome, each baseline learned from
// the other sessions; empty also where the genome's simulation does not end well.
Result<std::string> baseline_note_of_run(const Problem& problem, const Genome& genome, Farm& farm);

// The same beside a prediction of the problem's trials; none where baselines make no sense.
Result<std::vector<BaselineComparison>> baselines_beside(const Problem& problem,
                                                         const v1::PredictResult& prediction);

}  // namespace gapfarm
