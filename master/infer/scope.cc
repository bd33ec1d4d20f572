#include "master/infer/scope.h"

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "common/base/ranges.h"

namespace gapfarm::infer {

Scope scope_of(const Forward& forward, const Observations& whole,
               std::vector<std::uint32_t> index) {
  Scope some{forward, whole, std::move(index)};
  if (some.index.size() == whole.size()) return some;
  const Eigen::Index columns = whole.columns.cols();
  some.observations = {{},
                       {},
                       {},
                       Eigen::MatrixXd(3 * some.index.size(), columns),
                       whole.least_scale,
                       whole.most_scale,
                       whole.loss};
  for (std::size_t k = 0; k < some.index.size(); ++k) {
    const std::uint32_t i = some.index[k];
    some.observations.measured.push_back(whole.measured[i]);
    some.observations.whitener.push_back(whole.whitener[i]);
    some.observations.fold.push_back(whole.fold[i]);
    if (!whole.weight.empty()) some.observations.weight.push_back(whole.weight[i]);
    if (columns == 0) continue;
    some.observations.columns.middleRows<3>(3 * k) = whole.columns.middleRows<3>(3 * i);
  }
  some.forward = [&forward, index = some.index](const std::vector<PredictionRequest>& points) {
    std::vector<PredictionRequest> counted = points;
    for (PredictionRequest& request : counted) {
      if (request.trials.empty())
        request.trials = index;
      else
        for (std::uint32_t& trial : request.trials) trial = index[trial];
    }
    return forward(counted);
  };
  return some;
}

std::vector<std::uint32_t> within(const Scope& scope, const std::vector<std::uint32_t>& some) {
  std::vector<std::uint32_t> counted;
  for (std::uint32_t k = 0; k < scope.index.size(); ++k) {
    if (std::binary_search(some.begin(), some.end(), scope.index[k])) counted.push_back(k);
  }
  return counted;
}

Forward remembering(Forward forward) {
  using Point = std::pair<Overrides, std::vector<std::uint32_t>>;
  using Ends = std::optional<std::vector<Pose>>;
  return [forward = std::move(forward), known = std::make_shared<std::map<Point, Ends>>()](
             const std::vector<PredictionRequest>& points) -> Result<std::vector<Ends>> {
    std::vector<PredictionRequest> unknown;
    for (const PredictionRequest& p : points) {
      if (known->count({p.at, p.trials}) == 0) unknown.push_back(p);
    }
    if (!unknown.empty()) {
      ASSIGN_OR_RETURN(auto ends, forward(unknown));
      for (std::size_t k = 0; k < unknown.size(); ++k) {
        (*known)[{unknown[k].at, unknown[k].trials}] = std::move(ends[k]);
      }
    }
    return mapped(points, [&](const PredictionRequest& p) { return known->at({p.at, p.trials}); });
  };
}

}  // namespace gapfarm::infer
