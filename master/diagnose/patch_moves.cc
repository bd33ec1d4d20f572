// Where the patch of a fit lies.

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "master/diagnose/estimate.h"

namespace gapfarm {
namespace {

// Which contacts a disc carries, and when, changes trial by trial as its edge moves: along steps of
// centimetres the misfit falls steadily where its derivative points anywhere.
struct PatchStep {
  const char* key;
  double step;  // m, or of the ratio's logarithm
};
constexpr std::array<PatchStep, 4> kSteps = {{{"friction_patch.x", 0.04},
                                              {"friction_patch.y", 0.04},
                                              {"friction_patch.radius", 0.04},
                                              {"friction_patch.ratio", 0.2}}};
constexpr int kHalvings = 3;  // to 5 mm and 2.5 %
constexpr int kMostBatches = 14;

using Move = std::array<int, kSteps.size()>;  // in steps

Overrides moved(const ParameterTable& table, const Overrides& from, const Move& move, double part) {
  Overrides at = from;
  for (std::size_t k = 0; k < kSteps.size(); ++k) {
    const std::size_t row = table.row(kSteps[k].key);
    const double step = move[k] * part * kSteps[k].step;
    const bool is_ratio = kSteps[k].key == std::string("friction_patch.ratio");
    double& value = at.at(row);
    value = std::clamp(is_ratio ? value * std::exp(step) : value + step, table[row].lower,
                       table[row].upper);
  }
  return at;
}

// Each parameter up and down, and the last way once more.
std::vector<Move> neighbours(const Move& last) {
  std::vector<Move> moves;
  for (std::size_t k = 0; k < kSteps.size(); ++k) {
    for (int way : {-1, 1}) {
      moves.push_back({});
      moves.back()[k] = way;
    }
  }
  if (std::count(last.begin(), last.end(), 0) < static_cast<std::ptrdiff_t>(kSteps.size())) {
    moves.push_back(last);
  }
  return moves;
}

// Misfits of these places; INFINITY where one cannot be simulated.
Result<std::vector<double>> misfits(Predictor& predictor, const Study& study,
                                    const Eigen::MatrixXd& nuisances, const JointFit& fit,
                                    const std::vector<Overrides>& places) {
  std::vector<PredictionRequest> requests;
  for (const Overrides& at : places) requests.push_back({at, {}});
  const auto ends = predictor.attempt(requests);
  if (!ends) return ends.error();
  std::vector<double> all;
  JointFit tried = fit;
  for (const auto& simulated : *ends) {
    if (!simulated) {
      all.push_back(INFINITY);
      continue;
    }
    for (std::size_t i = 0; i < study.size(); ++i) {
      tried.residuals[i] = residual_of(study.trials[i], (*simulated)[i]);
    }
    all.push_back(misfit_of(study, tried, nuisances));
  }
  return all;
}

}  // namespace

Result<bool> move_patch(Predictor& predictor, const Study& study, const Eigen::MatrixXd& nuisances,
                        JointFit* fit) {
  const ParameterTable& table = predictor.problem().table();
  const auto ratio = table.find("friction_patch.ratio");
  if (!ratio || !fit->at.count(*ratio)) return false;
  const Overrides before = fit->at;
  double best = misfit_of(study, *fit, nuisances), part = 1;
  Move last = {};
  for (int batch = 0, halvings = 0; batch < kMostBatches && halvings <= kHalvings; ++batch) {
    const std::vector<Move> moves = neighbours(last);
    std::vector<Overrides> places;
    for (const Move& move : moves) places.push_back(moved(table, fit->at, move, part));
    auto tried = misfits(predictor, study, nuisances, *fit, places);
    if (!tried) return tried.error();
    // The better way along each parameter, and all of them together.
    Move together = {};
    for (std::size_t k = 0; k < kSteps.size(); ++k) {
      const double down = (*tried)[2 * k], up = (*tried)[2 * k + 1];
      if (std::min(down, up) < best) together[k] = down < up ? -1 : 1;
    }
    places.push_back(moved(table, fit->at, together, part));
    auto joined = misfits(predictor, study, nuisances, *fit, {places.back()});
    if (!joined) return joined.error();
    tried->push_back(joined->front());
    const auto least = std::min_element(tried->begin(), tried->end());
    const auto at = static_cast<std::size_t>(least - tried->begin());
    if (*least < best - kWorthMoving) {
      best = *least;
      fit->at = places[at];
      last = at < moves.size() ? moves[at] : together;
    } else {
      part /= 2;
      last = {};
      ++halvings;
    }
  }
  return fit->at != before;
}

}  // namespace gapfarm
