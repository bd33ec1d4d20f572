#include "master/diagnose/fit/estimate.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "common/base/ranges.h"
#include "common/math/algebra.h"
#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/fit/slopes.h"
#include "master/diagnose/places/seam.h"
#include "master/diagnose/subject.h"
#include "master/infer/certificate.h"
#include "master/infer/fit.h"

namespace gapfarm {
namespace {

// One unit of a coordinate: of a parameter's range; of its logarithm.
constexpr double kUnitOfRange = 0.1, kUnitOfLogarithm = 0.15;

// Of the fit's parameter `k`, whose valleys run along products and quotients: a nap drags as far
// where the floor grips as much better.
infer::Coordinate coordinate_of(const Study& study, const JointFit& fit, std::size_t k) {
  using Kind = infer::Coordinate::Kind;
  const bool base = k < fit.base_parameters;
  infer::Coordinate c;
  c.row = fit.parameters[k].row;
  const Parameter& row = (*study.table)[c.row];
  const bool turns = row.key.ends_with(".direction");
  c.kind = turns ? Kind::kAngle : row.lower >= 0 || base ? Kind::kLogarithm : Kind::kLinear;
  c.size = c.kind == Kind::kLogarithm ? kUnitOfLogarithm : kUnitOfRange * (row.upper - row.lower);
  if (base) {
    c.prior_sd = study.base_parameters[k].prior_log_sd / c.size;
    c.centre = std::log(study.base.at(c.row)) / c.size;
  }
  return c;
}

// What a unit of each coordinate is in the parameters' own, at these values.
Eigen::VectorXd units_of(const Study& study, const JointFit& fit) {
  Eigen::VectorXd units(static_cast<Eigen::Index>(fit.parameters.size()));
  for (Eigen::Index k = 0; k < units.size(); ++k) {
    const infer::Coordinate c = coordinate_of(study, fit, static_cast<std::size_t>(k));
    const bool log = c.kind == infer::Coordinate::Kind::kLogarithm;
    units[k] = log ? c.size * infer::positive((*study.table)[c.row], fit.at.at(c.row)) : c.size;
  }
  return units;
}

// Step of a finite difference in a parameter: a hundredth of its value, but no less than what the
// catalogue's bounds make a small change.
double step_of(const Parameter& row, double value) {
  return std::max(0.01 * std::abs(value), 0.002 * (row.upper - row.lower) / 2);
}

std::vector<FittedParameter> parameters_of(const Study& study, const Overrides& start,
                                           const std::vector<EffectCandidate>& effects,
                                           BaseParameters base, std::size_t* base_count) {
  std::vector<FittedParameter> parameters;
  if (base == BaseParameters::kFitted) {
    for (const BaseParameter& p : study.base_parameters) {
      parameters.push_back({p.row, start.at(p.row), 0});
    }
  }
  *base_count = parameters.size();
  for (const EffectCandidate& effect : effects) {
    for (const auto& [row, value] : start) {
      const Parameter& p = (*study.table)[row];
      // Where a seam runs is searched, not sloped: residuals jump as a trial changes sides.
      const bool jumps = p.kind != ParameterKind::kReal || is_seam_position(p.key);
      if (p.effect == effect.effect() && !jumps) parameters.push_back({row, value, 0});
    }
  }
  return parameters;
}

infer::Forward coarse_forward(Predictor& predictor, const Study& study) {
  return [&](std::vector<PredictionRequest> points) {
    for (PredictionRequest& point : points) point = *coarser(predictor, study, point.at);
    return predictor.attempt(points);
  };
}

infer::Fitter linear_fitter(const infer::Observations& observations, infer::Space space) {
  static const infer::Forward nobody;  // is asked
  return {nobody, observations, std::move(space)};
}

// What the nuisances take of the fit's residuals.
infer::Fit beside_nuisances(const Study& study, const JointFit& fit,
                            const infer::Observations& observations) {
  const infer::Space space(*study.table, infer::columns(observations.columns.cols()));
  const infer::Fitter fitter = linear_fitter(observations, space);
  infer::Fit none =
      fitter.known(Eigen::VectorXd::Zero(space.dimensions()), study.whiten(fit.residuals));
  if (space.dimensions() == 0) return none;
  none.slopes = -observations.columns;
  return fitter.linear_step(none);
}

// Parameters, standard errors and derivatives of what was found.
void take(const Study& study, const infer::Fitter& fitter, const infer::Fit& found, JointFit* fit) {
  const Eigen::Index before = found.u.size() - static_cast<Eigen::Index>(fit->parameters.size());
  const Eigen::MatrixXd inverse = inverse_of_symmetric(fitter.normal(found).matrix);
  fit->jacobian.resize(found.z.size(), static_cast<Eigen::Index>(fit->parameters.size()));
  const Eigen::VectorXd units = units_of(study, *fit);
  for (std::size_t k = 0; k < fit->parameters.size(); ++k) {
    FittedParameter& p = fit->parameters[k];
    const Eigen::Index at = before + static_cast<Eigen::Index>(k);
    const double unit = units[static_cast<Eigen::Index>(k)];
    p.value = fit->at.at(p.row);
    p.standard_error = unit * std::sqrt(std::max(0.0, inverse(at, at)));
    fit->jacobian.col(static_cast<Eigen::Index>(k)) = -found.slopes.col(at) / unit;
  }
}

}  // namespace

Eigen::MatrixXd no_nuisances(const Study& study) { return Eigen::MatrixXd(3 * study.size(), 0); }

double prior_sd(const Study& study, const BaseParameter& p) {
  return p.prior_log_sd * study.base.at(p.row);
}

Eigen::MatrixXd information_of(const Study& study, const JointFit& fit,
                               const Eigen::MatrixXd& nuisances) {
  Eigen::MatrixXd slopes = fit.jacobian;
  study.drop_ignored(slopes);
  Eigen::MatrixXd information = infer::information(slopes, nuisances);
  for (std::size_t k = 0; k < fit.base_parameters; ++k) {
    const BaseParameter& p = study.base_parameters[k];
    information(k, k) += 1 / std::pow(p.prior_log_sd * fit.at.at(p.row), 2);
  }
  return information;
}

infer::Observations observations_of(const Study& study, const Eigen::MatrixXd& nuisances,
                                    Loss loss) {
  infer::Observations all;
  all.difference = [&study](std::size_t i, const Pose& X_WP) {
    return residual_of(study.trials[i], X_WP);
  };
  all.whitener = study.whitener;
  all.columns = nuisances;
  all.least_scale = all.most_scale = 1;
  all.loss = loss;
  all.weight = mapped(study.ignored, [](bool ignored) { return ignored ? 0.0 : 1.0; });
  return all;
}

infer::Space space_of(const Study& study, const JointFit& fit, Eigen::Index nuisances) {
  std::vector<infer::Coordinate> all = infer::columns(nuisances);
  for (std::size_t k = 0; k < fit.parameters.size(); ++k) {
    all.push_back(coordinate_of(study, fit, k));
  }
  return {*study.table, std::move(all), fit.at};
}

infer::Fit as_searched(const Study& study, const JointFit& fit, const infer::Fitter& fitter,
                       const infer::Space& space) {
  infer::Fit searched = fitter.known(space.from(fit.at), study.whiten(fit.residuals));
  searched.slopes = -fit.jacobian * units_of(study, fit).asDiagonal();
  return searched;
}

double misfit_of(const Study& study, const JointFit& fit, const Eigen::MatrixXd& nuisances) {
  return -2 * beside_nuisances(study, fit, observations_of(study, nuisances, fit.loss)).score;
}

std::map<std::string, double> start_values(const Study& study, const Regression& others,
                                           const Signature& signature, double times) {
  // Coefficients of the columns, given everything else.
  const Eigen::MatrixXd& columns = signature.columns;
  Eigen::MatrixXd ridged = columns.transpose() * columns;
  ridged.diagonal() *= 1 + 1e-6;
  return values_at(study, others, signature,
                   times * solve_symmetric(ridged, columns.transpose() * others.left()));
}

std::map<std::string, double> values_at(const Study& study, const Regression& others,
                                        const Signature& signature, const Eigen::VectorXd& c) {
  std::map<std::string, double> values = signature.fixed;
  const EffectDiagnosis& effect = study.subject->effects->row(signature.effect);
  const EffectStart at{study, others, signature, c};
  const ParameterTable& table = *study.table;
  if (signature.whole) {
    // All of them are known.
  } else if (effect.polar) {
    start_polar(*effect.polar, at, &values);
  } else if (effect.start != nullptr) {
    effect.start(at, &values);
  } else {
    for (std::size_t k = 0; k < signature.parameters.size(); ++k) {
      const std::string& key = signature.parameters[k];
      values[key] = table[table.row(key)].nominal + c[k];
    }
  }
  for (auto& [key, value] : values) {
    const Parameter& row = table[table.row(key)];
    value = std::clamp(value, row.lower, row.upper);
  }
  return values;
}

Result<JointFit> fit_jointly(Predictor& predictor, const Study& study,
                             const std::vector<EffectCandidate>& effects, const Overrides& start,
                             BaseParameters base, const Eigen::MatrixXd& nuisances, int rounds,
                             Loss loss, infer::Sides sides) {
  JointFit fit;
  fit.at = start;
  fit.parameters = parameters_of(study, start, effects, base, &fit.base_parameters);
  fit.loss = loss;
  const infer::Forward forward = infer::remembering(
      [&](const std::vector<PredictionRequest>& points) { return predictor.attempt(points); });
  const auto predict = [&]() -> Status {
    ASSIGN_OR_RETURN(auto ends, forward({{fit.at, {}}}));
    if (!ends.front()) return predictor.failed("the model to begin at");
    fit.ends = std::move(*ends.front());
    fit.residuals = study.residuals_about(fit.ends);
    return {};
  };
  RETURN_IF_ERROR(predict());
  fit.jacobian.resize(3 * study.size(), 0);
  if (fit.parameters.empty()) return fit;
  const infer::Observations observations = observations_of(study, nuisances, loss);
  const infer::Space space = space_of(study, fit, nuisances.cols());
  const infer::Forward coarse = coarse_forward(predictor, study);
  const bool is_coarser = coarser(predictor, study, start).has_value();
  const infer::Fitter fitter(forward, observations, space, is_coarser ? &coarse : nullptr, sides);
  Eigen::VectorXd u = space.from(start);
  u.head(nuisances.cols()) = beside_nuisances(study, fit, observations).u;
  ASSIGN_OR_RETURN(auto found, fitter.start(u));
  found.differences = Eigen::VectorXd::Ones(u.size());
  const Eigen::VectorXd units = units_of(study, fit);
  for (std::size_t k = 0; k < fit.parameters.size(); ++k) {
    const FittedParameter& p = fit.parameters[k];
    const auto at = static_cast<Eigen::Index>(k);
    found.differences[nuisances.cols() + at] = step_of((*study.table)[p.row], p.value) / units[at];
  }
  RETURN_IF_ERROR(fitter.improve(&found, rounds));
  // What a step showed beside the slopes of before it is bend as much as slope.
  const bool exact = sides == infer::Sides::kOne || found.fresh;
  if (found.slopes.size() == 0 || !exact) RETURN_IF_ERROR(fitter.differentiate(&found));
  fit.at = space.values(found.u);
  RETURN_IF_ERROR(predict());
  take(study, fitter, found, &fit);
  return fit;
}

std::vector<Eigen::Vector3d> held_out_residuals(const Study& study, const JointFit& fit,
                                                const std::vector<std::size_t>& fold_of) {
  std::vector<Eigen::Vector3d> held_out = fit.residuals;
  const std::size_t folds = 1 + *std::max_element(fold_of.begin(), fold_of.end());
  for (std::size_t f = 0; f < folds; ++f) {
    const std::vector<Eigen::Vector3d> left = left_without(study, fit, fold_of, f);
    for (std::size_t i = 0; i < study.size(); ++i) {
      if (fold_of[i] == f) held_out[i] = left[i];
    }
  }
  return held_out;
}

std::vector<Eigen::Vector3d> left_without(const Study& study, const JointFit& fit,
                                          const std::vector<std::size_t>& fold_of, std::size_t f) {
  if (fit.parameters.empty()) return fit.residuals;
  infer::Observations observations = observations_of(study, no_nuisances(study), fit.loss);
  observations.fold = fold_of;
  const infer::Space space = space_of(study, fit, 0);
  const infer::Fitter fitter = linear_fitter(observations, space);
  const infer::Fit all = as_searched(study, fit, fitter, space);
  const bool only = *std::ranges::max_element(fold_of) == 0;
  return study.unwhiten(fitter.linear_step(all, only ? std::nullopt : std::optional(f)).z);
}

std::vector<double> scores_of(const Study& study, const std::vector<Eigen::Vector3d>& residuals,
                              double outlier_share) {
  return predictive_scores(study.trials, residuals, study.predictive_noise(), *study.subject,
                           outlier_share);
}

std::vector<std::size_t> folds_of(const Study& study) {
  std::vector<std::size_t> folds;
  for (std::size_t i = 0; i < study.size(); ++i) {
    folds.push_back(study.sessions > 1 ? study.trials[i].session : i * 5 / study.size());
  }
  return folds;
}

double floor_score(const Study& study, double outlier_share) {
  double sum = 0;
  for (const Eigen::Matrix3d& cov : study.covariances()) {
    // Gaussian: -(3 log 2 pi + log det S + 3) / 2, and the share of the tail, which adds little.
    sum += -0.5 * (3 * std::log(2 * M_PI) + std::log(cov.determinant()) + 3) +
           std::log1p(-outlier_share);
  }
  return sum / static_cast<double>(study.size());
}

}  // namespace gapfarm
