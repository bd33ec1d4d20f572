#include "master/diagnose/fit/profile.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/try.h"
#include "common/math/algebra.h"
#include "common/math/statistics.h"
#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/subject.h"

namespace gapfarm {
namespace {

// Standard errors to either side: the ends of a 95 % interval.  With less room than a quarter of
// that a bound decides, and the rise says nothing.
constexpr double kAside = 2, kLeastAside = 0.5;
// Steps in which the others follow (straight valleys need none), moves to somewhere better, and
// rounds of the fit that goes on from there: chosen for the CPU seconds that they cost, on blind
// checks of seeds 41, 43 and 47.
constexpr int kFollowing = 2, kMostMoves = 4, kFitRounds = 2;
// Of the misfit (twice nats): less is no progress, as in any fit (estimate.cc).
constexpr double kLeastDrop = 1;
// Times the standard error of the slopes; chosen, for a rise of nothing would make it infinite.
constexpr double kWidest = 3;

struct Aside {
  std::size_t parameter = 0;
  double by = 0;  // standard errors
  JointFit there;
  Eigen::VectorXd move;  // next
  double misfit = INFINITY;
};

class Profile {
 public:
  Profile(Predictor& predictor, const Study& study, const JointFit& fit)
      : predictor_(predictor),
        study_(study),
        fit_(fit),
        none_(no_nuisances(study)),
        inverse_(inverse_of_symmetric(step_equations(study, fit).matrix)),
        misfit_(misfit_of(study, fit, none_)) {}

  Status look() {
    std::vector<Aside*> moving;
    for (std::size_t k = fit_.base_parameters; k < fit_.parameters.size(); ++k) {
      if (!(inverse_(k, k) > 0)) continue;
      for (const double side : {-1.0, 1.0}) {
        const double error = std::sqrt(inverse_(k, k));
        const double by = std::min(kAside, room(k, side) / error);
        if (by < kLeastAside) continue;
        asides_.push_back({k, by, fit_, inverse_.col(k) * (side * by / error)});
      }
    }
    for (Aside& aside : asides_) moving.push_back(&aside);
    for (int step = 0; step <= kFollowing && !moving.empty(); ++step) {
      RETURN_IF_ERROR(move(moving));
      std::erase_if(moving, [](const Aside* aside) { return aside->move.size() == 0; });
    }
    return {};
  }

  // Where it is downhill, if it is anywhere.
  const JointFit* lower() const {
    const auto least = std::ranges::min_element(asides_, {}, &Aside::misfit);
    const bool found = least != asides_.end() && least->misfit < misfit_ - kLeastDrop;
    return found ? &least->there : nullptr;
  }

  // By how much each effect's parameter is known less well than slopes say.
  std::vector<double> bent() const {
    std::vector<double> all(fit_.parameters.size(), 1.0);
    for (std::size_t k = fit_.base_parameters; k < all.size(); ++k) {
      std::vector<double> risen;
      for (const Aside& aside : asides_) {
        if (aside.parameter != k || !std::isfinite(aside.misfit)) continue;
        risen.push_back((aside.misfit - misfit_) / (aside.by * aside.by));
      }
      if (!risen.empty())
        all[k] = std::clamp(1 / std::sqrt(std::max(mean(risen), 1e-9)), 1.0, kWidest);
    }
    return all;
  }

 private:
  double room(std::size_t k, double side) const {
    const FittedParameter& p = fit_.parameters[k];
    const Parameter& row = (*study_.table)[p.row];
    if (goes_round(row)) return INFINITY;
    return side > 0 ? row.upper - p.value : p.value - row.lower;
  }

  // Those that come no lower stay, and move no more.
  Status move(const std::vector<Aside*>& asides) {
    std::vector<PredictionRequest> requests;
    std::vector<JointFit> tried;
    for (const Aside* aside : asides) {
      shift(*study_.table, aside->move, &tried.emplace_back(aside->there));
      requests.push_back({tried.back().at, {}});
    }
    ASSIGN_OR_RETURN(const auto ends, predictor_.attempt(requests));
    for (std::size_t j = 0; j < asides.size(); ++j) {
      Aside& aside = *asides[j];
      aside.move.resize(0);
      if (!ends[j]) continue;
      tried[j].ends = *ends[j];
      tried[j].residuals = study_.residuals_about(*ends[j]);
      const double misfit = misfit_of(study_, tried[j], none_);
      if (misfit >= aside.misfit) continue;
      aside.misfit = misfit;
      aside.there = std::move(tried[j]);
      follow(&aside);
    }
    return {};
  }

  // Where the others, by the slopes of the middle, have somewhere to go.
  void follow(Aside* aside) const {
    StepEquations held = step_equations(study_, aside->there);
    const auto k = static_cast<Eigen::Index>(aside->parameter);
    held.matrix.row(k).setZero();
    held.matrix.col(k).setZero();
    held.matrix(k, k) = 1;
    held.right[k] = 0;
    const Eigen::VectorXd move = solve_symmetric(held.matrix, held.right);
    if (held.right.dot(move) > kLeastDrop) aside->move = move;
  }

  Predictor& predictor_;
  const Study& study_;
  const JointFit& fit_;
  const Eigen::MatrixXd none_;
  const Eigen::MatrixXd inverse_;
  const double misfit_;
  std::vector<Aside> asides_;
};

}  // namespace

Result<JointFit> profiled(Predictor& predictor, const Study& study,
                          const std::vector<EffectCandidate>& effects, JointFit fit) {
  if (fit.parameters.size() == fit.base_parameters) return fit;
  std::vector<double> bent;
  for (int moved = 0;; ++moved) {
    Profile profile(predictor, study, fit);
    RETURN_IF_ERROR(profile.look());
    bent = profile.bent();
    const JointFit* lower = profile.lower();
    if (lower == nullptr || moved == kMostMoves) break;
    fit = JointFit(*lower);
  }
  ASSIGN_OR_RETURN(fit, fit_jointly(predictor, study, effects, fit.at, BaseParameters::kFitted,
                                    no_nuisances(study), kFitRounds, Loss::kRedescending));
  for (std::size_t k = 0; k < bent.size(); ++k) {
    fit.parameters[k].bent = bent[k];
    fit.parameters[k].standard_error *= bent[k];
  }
  return fit;
}

}  // namespace gapfarm
