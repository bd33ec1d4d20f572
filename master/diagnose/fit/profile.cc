#include "master/diagnose/fit/profile.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/math/algebra.h"
#include "common/math/statistics.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

// Standard errors to either side: the ends of a 95 % interval.  With less room than a quarter of
// that a bound decides, and the rise says nothing.
constexpr double kAside = 2, kLeastAside = 0.5;
// Steps in which the others follow: straight valleys need none.
constexpr int kFollowing = 2;

struct Aside {
  Eigen::Index parameter = 0;
  double by = 0;  // standard errors
  infer::Fit there;
  Eigen::VectorXd move;  // next
};

// About a fit whose slopes serve for all that is tried.
class Profile {
 public:
  // `first`: those before are the base's.  REQUIRES: all outlive it.
  Profile(const infer::Fitter& fitter, const infer::Space& space, const infer::Fit& middle,
          Eigen::Index first)
      : fitter_(fitter),
        space_(space),
        middle_(middle),
        first_(first),
        inverse_(inverse_of_symmetric(fitter.normal(middle).matrix)) {}

  Status look() {
    for (Eigen::Index k = first_; k < middle_.u.size(); ++k) {
      if (!(inverse_(k, k) > 0)) continue;
      const double error = std::sqrt(inverse_(k, k));
      for (const double side : {-1.0, 1.0}) {
        const double room =
            side > 0 ? space_.upper()[k] - middle_.u[k] : middle_.u[k] - space_.lower()[k];
        const double by = std::min(kAside, room / error);
        if (by < kLeastAside) continue;
        asides_.push_back({k, by, middle_, inverse_.col(k) * (side * by / error)});
        asides_.back().there.score = -INFINITY;
      }
    }
    std::vector<Aside*> moving;
    for (Aside& aside : asides_) moving.push_back(&aside);
    for (int step = 0; step <= kFollowing && !moving.empty(); ++step) {
      RETURN_IF_ERROR(move(moving));
      std::erase_if(moving, [](const Aside* aside) { return aside->move.size() == 0; });
    }
    return {};
  }

  // Where it is downhill, if it is anywhere.
  const infer::Fit* lower() const {
    const infer::Fit* best = &middle_;
    for (const Aside& aside : asides_) {
      if (aside.there.score > best->score) best = &aside.there;
    }
    return best->score > middle_.score + kSettledGain ? best : nullptr;
  }

  // By how much each effect's parameter is known less well than slopes say.
  std::vector<double> bent() const {
    std::vector<double> all(static_cast<std::size_t>(middle_.u.size()), 1.0);
    for (Eigen::Index k = first_; k < middle_.u.size(); ++k) {
      std::vector<double> risen;
      for (const Aside& aside : asides_) {
        if (aside.parameter != k || !std::isfinite(aside.there.score)) continue;
        risen.push_back(2 * (middle_.score - aside.there.score) / (aside.by * aside.by));
      }
      if (risen.empty()) continue;
      all[static_cast<std::size_t>(k)] =
          std::clamp(1 / std::sqrt(std::max(mean(risen), 1e-9)), 1.0, kWidest);
    }
    return all;
  }

 private:
  // Those that come no lower stay, and move no more.
  Status move(const std::vector<Aside*>& asides) {
    std::vector<Eigen::VectorXd> points;
    for (const Aside* aside : asides) {
      points.emplace_back(
          (aside->there.u + aside->move).cwiseMax(space_.lower()).cwiseMin(space_.upper()));
    }
    ASSIGN_OR_RETURN(auto tried,
                     fitter_.starts(points, std::vector<infer::Space>(points.size(), space_)));
    for (std::size_t j = 0; j < asides.size(); ++j) {
      Aside& aside = *asides[j];
      aside.move.resize(0);
      if (!(tried[j].score > aside.there.score)) continue;
      aside.there = std::move(tried[j]);
      aside.there.slopes = middle_.slopes;
      follow(&aside);
    }
    return {};
  }

  // Where the others, by the slopes of the middle, have somewhere to go.
  void follow(Aside* aside) const {
    infer::Normal held = fitter_.normal(aside->there);
    const Eigen::Index k = aside->parameter;
    held.matrix.row(k).setZero();
    held.matrix.col(k).setZero();
    held.matrix(k, k) = 1;
    held.right[k] = 0;
    const Eigen::VectorXd move = solve_symmetric(held.matrix, held.right);
    if (held.gain(move) > kSettledGain) aside->move = move;
  }

  const infer::Fitter& fitter_;
  const infer::Space& space_;
  const infer::Fit& middle_;
  const Eigen::Index first_;
  const Eigen::MatrixXd inverse_;
  std::vector<Aside> asides_;
};

}  // namespace

Result<JointFit> profiled(Predictor& predictor, const Study& study,
                          const std::vector<EffectCandidate>& effects, JointFit fit) {
  if (fit.parameters.size() == fit.base_parameters) return fit;
  const auto fit_from = [&](const Overrides& at) {
    return fit_jointly(predictor, study, effects, at, BaseParameters::kFitted, no_nuisances(study),
                       kLongSearch, Loss::kRedescending, infer::Sides::kBoth);
  };
  ASSIGN_OR_RETURN(fit, fit_from(fit.at));
  const infer::Forward forward = [&](const std::vector<PredictionRequest>& points) {
    return predictor.attempt(points);
  };
  const infer::Observations observations = observations_of(study, no_nuisances(study), fit.loss);
  const infer::Space space = space_of(study, fit, 0);
  const infer::Fitter fitter(forward, observations, space);
  infer::Fit middle = as_searched(study, fit, fitter, space);
  std::vector<double> bent;
  int moved = 0;
  for (;; ++moved) {
    Profile profile(fitter, space, middle, static_cast<Eigen::Index>(fit.base_parameters));
    RETURN_IF_ERROR(profile.look());
    bent = profile.bent();
    const infer::Fit* lower = profile.lower();
    if (lower == nullptr || moved == kMostMoves) break;
    middle = infer::Fit(*lower);
  }
  if (moved > 0) {
    ASSIGN_OR_RETURN(fit, fit_from(space.values(middle.u)));
  }
  for (std::size_t k = 0; k < bent.size(); ++k) {
    fit.parameters[k].bent = bent[k];
    fit.parameters[k].standard_error *= bent[k];
  }
  return fit;
}

}  // namespace gapfarm
