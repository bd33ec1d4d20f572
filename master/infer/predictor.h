// Predictions of a log at points of the parameter space: the diagnosis's only way to the
// simulation. All points of a call are one batch of farm work.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "common/base/result.h"
#include "common/pose/pose.h"
#include "common/problem/problem.h"
#include "master/farm/farm.h"

namespace gapfarm {

// Parameter rows that differ from the problem's values.
using Overrides = std::map<std::size_t, double>;

// Puts these values in, by their keys of the table.
void set_values(const ParameterTable& table, const std::map<std::string, double>& values,
                Overrides* at);
double value_at(const Problem& problem, const Overrides& at, std::size_t row);

struct PredictionRequest {
  Overrides at;
  std::vector<std::uint32_t> trials;  // ascending; empty: all
  std::uint32_t headings = 0;         // as in v1::PredictTask
};

class Predictor {
 public:
  Predictor(Farm& farm, const Problem& problem);

  const Problem& problem() const { return problem_; }
  const std::string& problem_hash() const { return hash_; }

  // Predicted measured end poses, one a trial asked for, of each request.  Few requests are cut
  // into tasks of some conditions each, so that many workers have something to do.  Errors: the
  // farm's, and a simulation that did not end well (its point is named).
  Result<std::vector<std::vector<Pose>>> ends(const std::vector<PredictionRequest>& requests);
  // The same, but a point outside the parameters' bounds, or one whose simulation does not end
  // well, has no ends; failed() says why, of the first.  Errors: the farm's alone.
  Result<std::vector<std::optional<std::vector<Pose>>>> attempt(
      const std::vector<PredictionRequest>& requests);
  // The same for all trials at one point, every duty times `factor`, (0, 1]: how drives depend on
  // the speed of a robot whose parameters may know of none.
  Result<std::optional<std::vector<Pose>>> attempt_slower(const Overrides& at, double factor);
  // Keeps the last failure as the reason why `what` ("floor_tilt") had to be omitted.
  void exclude(const std::string& what) { excluded_.try_emplace(what, last_failure_); }
  const std::map<std::string, std::string>& excluded() const { return excluded_; }
  // The farm's tasks behind a lone request for all trials.
  std::vector<v1::Task> tasks(const Overrides& at) const;
  // Nominal path of each command in its start frame.
  Result<std::vector<std::vector<PathSample>>> paths(const Overrides& at,
                                                     const std::vector<CommandSpec>& commands,
                                                     double interval_s);
  // The first failure of the last batch that had one as an error of the simulation's.
  Error failed(const std::string& what) const;
  // Why a worker could not do its work, which is nobody's point; nothing: none failed.
  const std::optional<std::string>& broken() const { return broken_; }

 private:
  // Trials of one share a simulation, unless their places matter.
  using Condition = std::tuple<std::uint32_t, std::string, std::optional<double>,
                               std::optional<double>, std::optional<double>>;
  Condition condition(std::uint32_t trial) const;
  std::vector<std::vector<std::uint32_t>> parts_of(const PredictionRequest& request,
                                                   std::size_t parts) const;
  Result<std::vector<std::optional<std::vector<Pose>>>> simulate(
      const std::string& problem, const std::vector<PredictionRequest>& requests);

  Farm& farm_;
  const Problem& problem_;
  std::string hash_;
  std::vector<std::uint32_t> by_condition_;  // trials, those that share a simulation in a row
  std::string last_failure_;
  std::optional<std::string> broken_;
  std::map<std::string, std::string> excluded_;
};

namespace infer {

// Predicted poses of the observations asked for, at each point; none where a point cannot be
// simulated.  Errors: the simulation's own, never a point's.
using Forward = std::function<Result<std::vector<std::optional<std::vector<Pose>>>>(
    const std::vector<PredictionRequest>& points)>;

// The same, asking once for what was asked before, of some `most` points and the last batch: a fit
// of what no simulation moves stays where it is.
Forward remembering(Forward forward, std::size_t most = SIZE_MAX);

}  // namespace infer
}  // namespace gapfarm
