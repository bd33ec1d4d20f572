#include "master/diagnose/places/seam.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "common/effects/catalogue.h"
#include "master/diagnose/evidence/covariates.h"
#include "master/diagnose/fit/estimate.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

double value_in(const Signature& seam, const char* key) {
  return seam.fixed.at(seam.effect + "." + key);
}

// A first search as wide as two readings leave a line, then a finer one.
constexpr double kWideStep_m = 0.01;
constexpr int kWideSteps = 8, kFineSteps = 3;
// Of the misfit (twice nats), for a move: trials change sides one by one.
constexpr double kWorthMoving = 2;

// The best place of one line among so many about where it is; the misfit there.
Result<double> search_line(Predictor& predictor, const Study& study,
                           const Eigen::MatrixXd& nuisances, std::size_t row, double step_m,
                           int steps, JointFit* fit) {
  std::vector<PredictionRequest> requests;
  for (int k = -steps; k <= steps; ++k) {
    requests.push_back({fit->at, {}});
    requests.back().at[row] += k * step_m;
  }
  ASSIGN_OR_RETURN(const auto ends, predictor.attempt(requests));
  double best = INFINITY, place = fit->at.at(row);
  JointFit tried = *fit;
  // From the middle outward: of two equal places the closer one.
  for (int k = 0; k <= 2 * steps; ++k) {
    const int off = k % 2 == 0 ? k / 2 : -(k + 1) / 2;
    const auto at = static_cast<std::size_t>(steps + off);
    if (!ends[at]) continue;
    tried.residuals = study.residuals_about(*ends[at]);
    const double misfit = misfit_of(study, tried, nuisances);
    const double least = off == 0 ? misfit : misfit + kWorthMoving;
    if (least >= best) continue;
    best = misfit;
    place = requests[at].at.at(row);
  }
  fit->at[row] = place;
  return best;
}

// Readings shifted along an axis of the world, ends by `by` more than starts.
Eigen::VectorXd shifted(const Study& study, int axis, const Feature& by) {
  return study.whiten(mapped(study.trials, [&](const ResidualTrial& t) -> Eigen::Vector3d {
    return rotation_about_z(-t.X_WP.theta).col(axis) * by(t);
  }));
}

}  // namespace

bool is_seam(const std::string& effect) { return kind_of(effect) == "camera_seam"; }

bool is_seam_position(const std::string& key) {
  return key.ends_with(".position") && is_seam(key.substr(0, key.find('.')));
}

Signature renamed(Signature signature, const std::string& effect) {
  const std::size_t own = signature.effect.size();
  for (std::string& key : signature.parameters) key = effect + key.substr(own);
  std::map<std::string, double> fixed;
  for (const auto& [key, value] : signature.fixed) {
    const bool is_own = key.rfind(signature.effect + ".", 0) == 0;
    fixed[is_own ? effect + key.substr(own) : key] = value;
  }
  signature.fixed = std::move(fixed);
  signature.effect = effect;
  return signature;
}

bool are_two_seams(const Signature& a, const Signature& b) {
  return value_in(a, "axis") != value_in(b, "axis") ||
         std::abs(value_in(a, "position") - value_in(b, "position")) >= kLeastApart_m;
}

Signature seam_signature(const Study& study, int axis, double position_m) {
  const Eigen::Vector2d middle = middle_of(study);
  Signature seam;
  seam.columns.resize(static_cast<Eigen::Index>(3 * study.size()), 4);
  Eigen::Index column = 0;
  for (bool sloped : {false, true}) {
    const auto shift = [&](const Pose& X) {
      if ((axis == 0 ? X.x : X.y) <= position_m) return 0.0;
      return sloped ? (axis == 0 ? X.y - middle.y() : X.x - middle.x()) : 1.0;
    };
    for (int component = 0; component < 2; ++component) {
      seam.columns.col(column++) = shifted(
          study, component, [&](const ResidualTrial& t) { return shift(t.X_WP) - shift(t.X_WS); });
    }
  }
  seam.effect = "camera_seam";
  seam.parameters = {"camera_seam.offset_x", "camera_seam.offset_y", "camera_seam.slope_x",
                     "camera_seam.slope_y"};
  seam.fixed = {{"camera_seam.axis", axis}, {"camera_seam.position", position_m}};
  seam.penalty = 6.5;
  return seam;
}

Signature linear_view_signature(const Study& study) {
  Signature view;
  view.columns.resize(static_cast<Eigen::Index>(3 * study.size()), 4);
  using T = const ResidualTrial&;
  for (int shown = 0; shown < 2; ++shown) {
    view.columns.col(2 * shown) = shifted(study, shown, [](T t) { return t.X_WP.x - t.X_WS.x; });
    view.columns.col(2 * shown + 1) =
        shifted(study, shown, [](T t) { return t.X_WP.y - t.X_WS.y; });
  }
  view.penalty = 2;
  return view;
}

double seam_position(const Study& study, const Regression& others, const Signature& seam,
                     const Eigen::Vector4d& coefficients) {
  const bool across_x = value_in(seam, "axis") == 0;
  const Eigen::Vector2d middle = middle_of(study);
  const auto shift = [&](const Pose& X, double line) {
    if ((across_x ? X.x : X.y) <= line) return Pose{};
    const double along = across_x ? X.y - middle.y() : X.x - middle.x();
    return Pose{coefficients[0] + coefficients[2] * along,
                coefficients[1] + coefficients[3] * along, 0};
  };
  const double about = value_in(seam, "position");
  // Of signatures that are nearly alike a coefficient may be of any size; no shift is.
  const Parameter& offset = (*study.table)[study.table->row(seam.effect + ".offset_x")];
  const double shifted = std::min(std::abs(coefficients[across_x ? 0 : 1]), offset.upper);
  const double reach = shifted + 4 * kFineSeamStep_m;
  const auto motions =
      mapped(study.trials, [](const ResidualTrial& t) { return between(t.X_WS, t.X_WP); });
  const Eigen::VectorXd left = others.left();
  double best = about, least = INFINITY;
  for (double line = about - reach; line <= about + reach; line += kFineSeamStep_m) {
    std::vector<Eigen::Vector3d> d;
    for (std::size_t i = 0; i < study.size(); ++i) {
      const ResidualTrial& t = study.trials[i];
      Pose start = t.X_WS;
      for (int round = 0; round < 3; ++round) {  // as the simulated camera's readings are undone
        const Pose s = shift(start, line);
        start = {t.X_WS.x - s.x, t.X_WS.y - s.y, t.X_WS.theta};
      }
      const Pose end = start * motions[i];
      const Pose s = shift(end, line);
      d.push_back(difference_of(t, t.X_WP, {end.x + s.x, end.y + s.y, end.theta}));
    }
    Eigen::VectorXd mark = study.whiten(d);
    study.drop_ignored(mark);
    // What would be left with this mark taken out, less what is left without.
    const double change = others.own_squares(mark) - 2 * mark.dot(left);
    if (change >= least) continue;
    least = change;
    best = line;
  }
  return best;
}

Result<bool> move_seams(Predictor& predictor, const Study& study, const Eigen::MatrixXd& nuisances,
                        JointFit* fit) {
  const Overrides before = fit->at;
  for (const auto& [step_m, steps] :
       {std::pair(kWideStep_m, kWideSteps), std::pair(kFineSeamStep_m, kFineSteps)}) {
    for (const auto& [row, value] : before) {
      if (!is_seam_position((*study.table)[row].key)) continue;
      RETURN_IF_ERROR(search_line(predictor, study, nuisances, row, step_m, steps, fit));
    }
  }
  return fit->at != before;
}

}  // namespace gapfarm
