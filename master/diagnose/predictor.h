// Predictions of a log at points of the parameter space: the diagnosis's only way to the
// simulation. All points of a call are one batch of farm work.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/pose/pose.h"
#include "common/problem/problem.h"
#include "master/farm/farm.h"

namespace gapfarm {

// Parameter rows that differ from the problem's values.
using Overrides = std::map<std::size_t, double>;

struct PredictionRequest {
  Overrides at;
  std::vector<std::uint32_t> trials;  // empty: all
};

// The farm's task behind a request for all trials.
v1::Task predict_task(const Overrides& at, bool means_only);

class Predictor {
 public:
  Predictor(Farm& farm, const Problem& problem)
      : farm_(farm), problem_(problem), hash_(farm.add_problem(to_proto(problem))) {}

  const Problem& problem() const { return problem_; }
  std::uint64_t predictions() const { return predictions_; }

  // Predicted measured end poses, one a trial asked for, of each request.  Errors: the farm's, and
  // a simulation that did not end well (its point is named).
  Result<std::vector<std::vector<Pose>>> ends(const std::vector<PredictionRequest>& requests);
  // Whether the last error of ends() was a simulation's rather than the farm's.
  bool simulation_failed() const { return simulation_failed_; }

  // Log scores of every trial under the worker's own predictive distribution.
  Result<std::vector<double>> log_scores(const Overrides& at);

 private:
  Farm& farm_;
  const Problem& problem_;
  std::string hash_;
  std::uint64_t predictions_ = 0;
  bool simulation_failed_ = false;
};

}  // namespace gapfarm
