// Which trials to drive next so that competing explanations part.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/pose/pose.h"
#include "common/problem/problem.h"
#include "gapfarm/v1/task.pb.h"
#include "master/diagnose/result/diagnosis.h"
#include "master/farm/farm.h"

namespace gapfarm {

// An explanation at its best fit: what it changes in the problem's values.
struct CompetingCause {
  std::string name;
  std::vector<v1::Override> overrides;
};
using CompetingCauses = std::vector<CompetingCause>;

// Trials that might be made, all alike but for where they start.
struct Design {
  std::string group;                  // a further sentence offers a design of another group
  std::vector<std::uint32_t> trials;  // of the plan's log, to be predicted
  // What is special about it must be why it shows: the trial without that, from the same start.
  std::optional<std::uint32_t> ordinary;
  double cost = 0;  // of two that show as much the cheaper is offered
  // What to do, without a full stop; `many_starts`: one start alone would show less.
  std::function<std::string(bool many_starts)> action;
};

struct ExperimentPlan {
  Problem problem;  // without genes, and with the synthetic log of all designs
  std::vector<Design> designs;
  std::string designs_are;  // "No ... shows them apart"
  std::string instead;      // what to do when no design distinguishes alternatives
};

// A predicted measured end pose in the world, covariance in its own axes.
struct PredictedEnd {
  Pose X_WM;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
};

// Mean Kullback-Leibler divergence a trial of two Gaussian predictions, nats:
//
//   d' S^-1 d / 2 + (tr(A^-1 B) + tr(B^-1 A) - 6) / 4,    S = (A + B) / 2
//
// d: from one mean to the other; A, B: the covariances in the axes of the first end.  The second
// term is the mean of both directions' divergences at equal means.  Infinite means are not allowed;
// 0 when a covariance is not positive definite (nothing is known then).
double divergence(const PredictedEnd& a, const PredictedEnd& b);

// Trials after which the likelihood ratio of the two is wrong at most once in twenty, either way:
// about normal with mean +-n D and variance 2 n D, so n = 2 * 1.645^2 / D = 5.41 / D.  At least 3.
std::uint64_t trials_needed(double divergence);

// Predicts every alternative on the plan's designs and says which of them distinguish the
// alternatives with the fewest trials, 500 at most; two sentences at most.  A further sentence
// parts alternatives that the ones before left together, or offers a design of another group.
// Alternatives that no design parts get a sentence stating so, with 0 trials.  Fewer than two
// alternatives need no experiment.  Alternatives are taken at their fits: the base is not retuned
// to the new trials. Errors: the farm's, and an alternative that cannot be simulated anywhere.
Result<std::vector<NextExperiment>> next_experiments(Farm& farm, const ExperimentPlan& plan,
                                                     const CompetingCauses& alternatives);

}  // namespace gapfarm
