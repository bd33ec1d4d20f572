// Where the lines of fitted seams run.

#include <cmath>

#include "master/diagnose/fit/estimate.h"
#include "master/diagnose/places/seam.h"

namespace gapfarm {
namespace {

// A first search as wide as two readings leave a line, then a finer one.
constexpr double kWideStep_m = 0.01;
constexpr int kWideSteps = 8, kFineSteps = 3;
// Of the misfit (twice nats), for a move: trials change sides one by one.
constexpr double kWorthMoving = 2;

std::vector<std::size_t> seam_rows(const ParameterTable& table, const Overrides& at) {
  std::vector<std::size_t> rows;
  for (const auto& [row, value] : at) {
    if (is_seam_position(table[row].key)) rows.push_back(row);
  }
  return rows;
}

// The best place of one line among so many about where it is; the misfit there.
Result<double> search_line(Predictor& predictor, const Study& study,
                           const Eigen::MatrixXd& nuisances, std::size_t row, double step_m,
                           int steps, JointFit* fit) {
  std::vector<PredictionRequest> requests;
  for (int k = -steps; k <= steps; ++k) {
    requests.push_back({fit->at, {}});
    requests.back().at[row] += k * step_m;
  }
  const auto ends = predictor.attempt(requests);
  if (!ends) return ends.error();
  double best = INFINITY, place = fit->at.at(row);
  JointFit tried = *fit;
  // From the middle outward: of two equal places the closer one.
  for (int k = 0; k <= 2 * steps; ++k) {
    const int off = k % 2 == 0 ? k / 2 : -(k + 1) / 2;
    const auto at = static_cast<std::size_t>(steps + off);
    if (!(*ends)[at]) continue;
    for (std::size_t i = 0; i < study.size(); ++i) {
      tried.residuals[i] = residual_of(study.trials[i], (*(*ends)[at])[i]);
    }
    const double misfit = misfit_of(study, tried, nuisances);
    const double least = off == 0 ? misfit : misfit + kWorthMoving;
    if (least >= best) continue;
    best = misfit;
    place = requests[at].at.at(row);
  }
  fit->at[row] = place;
  return best;
}

}  // namespace

Result<bool> move_seams(Predictor& predictor, const Study& study, const Eigen::MatrixXd& nuisances,
                        JointFit* fit) {
  const Overrides before = fit->at;
  for (const auto& [step_m, steps] :
       {std::pair(kWideStep_m, kWideSteps), std::pair(kFineSeamStep_m, kFineSteps)}) {
    for (std::size_t row : seam_rows(predictor.problem().table(), fit->at)) {
      auto misfit = search_line(predictor, study, nuisances, row, step_m, steps, fit);
      if (!misfit) return misfit.error();
    }
  }
  return fit->at != before;
}

}  // namespace gapfarm
