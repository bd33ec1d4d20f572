#include "master/diagnose/fit/estimate.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/base/try.h"
#include "common/math/algebra.h"
#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/fit/slopes.h"
#include "master/diagnose/places/seam.h"
#include "master/diagnose/subject.h"

namespace gapfarm {
namespace {

constexpr int kMostHalvings = 4;
// Of the objective (twice nats): less is no progress, where the noise is as large as it was taken
// for.
constexpr double kSettled = 1;
constexpr double kMostOfRange = 0.3;  // of a parameter's range, that one step may go
// Of a finite difference, root mean square in standard deviations a row.
constexpr double kLeastMove = 1e-4, kMostMove = 5, kGoodMove = 0.3;
constexpr double kFarSquared = 16;  // squared distance beyond which a trial is far out

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

Status predict(Predictor& predictor, const Study& study, JointFit* fit) {
  ASSIGN_OR_RETURN(auto ends, predictor.ends({{fit->at, {}}}));
  fit->ends = std::move(ends.front());
  fit->residuals = study.residuals_about(fit->ends);
  return {};
}

// Steps that moved the ends by many standard deviations, or by next to nothing, are taken again so
// that they move them by a part of one: what a small change is, the motion says, not the bounds.
Status rescale(Predictor& predictor, const Study& study, const SlopePoint& from,
               std::vector<SlopeRequest>* requests, std::vector<std::optional<Slope>>* slopes) {
  std::vector<SlopeRequest> again;
  std::vector<std::size_t> of;
  for (std::size_t k = 0; k < requests->size(); ++k) {
    if (!(*slopes)[k]) continue;
    const auto [parameter, step] = (*requests)[k];
    const double rows = static_cast<double>(3 * study.size());
    const double a_unit = std::sqrt(study.whiten(*(*slopes)[k]).squaredNorm() / rows);
    const double moved = a_unit * step;
    if (!(a_unit > 0) || (moved > kLeastMove && moved < kMostMove)) continue;
    const Parameter& row = predictor.problem().table()[parameter];
    again.push_back(
        {parameter, std::min(kGoodMove / a_unit, kMostOfRange * (row.upper - row.lower))});
    of.push_back(k);
  }
  if (again.empty()) return {};
  ASSIGN_OR_RETURN(auto better, slopes_at(predictor, from, again));
  for (std::size_t j = 0; j < of.size(); ++j) {
    if (!better[j]) continue;
    (*slopes)[of[j]] = std::move(better[j]);
    (*requests)[of[j]] = again[j];
  }
  return {};
}

// A trial that jumps, across the rim of a patch, say, weighs no more than one that is far out.
void bound_jumps(double step, Eigen::Ref<Eigen::VectorXd> slope) {
  for (Eigen::Index i = 0; i < slope.size(); i += 3) {
    const double moved2 = slope.segment<3>(i).squaredNorm() * step * step;
    if (moved2 > kFarSquared) slope.segment<3>(i) *= std::sqrt(kFarSquared / moved2);
  }
}

// Derivatives of the predictions there.  What cannot be moved at all has none, and stays.
Status differentiate(Predictor& predictor, const Study& study, JointFit* fit) {
  std::vector<SlopeRequest> requests;
  for (const FittedParameter& p : fit->parameters) {
    requests.push_back({p.row, step_of(predictor.problem().table()[p.row], p.value)});
  }
  fit->jacobian.setZero(3 * study.size(), fit->parameters.size());
  if (requests.empty()) return {};
  ASSIGN_OR_RETURN(const auto from, slope_point(predictor, study, fit->at, fit->ends));
  ASSIGN_OR_RETURN(auto slopes, slopes_at(predictor, from, requests));
  if (Status s = rescale(predictor, study, from, &requests, &slopes); !s) return s;
  for (std::size_t k = 0; k < slopes.size(); ++k) {
    if (!slopes[k]) continue;
    fit->jacobian.col(k) = study.whiten(*slopes[k]);
    bound_jumps(requests[k].step, fit->jacobian.col(k));
  }
  return {};
}

double within(const Parameter& row, double value) {
  if (!goes_round(row)) return std::clamp(value, row.lower, row.upper);
  const double turn = row.upper - row.lower;
  return value - turn * std::floor((value - row.lower) / turn);
}

double scaled_step(const Parameter& row, double from, double to) {
  if (!goes_round(row)) return to - from;
  const double turn = row.upper - row.lower;
  return to - from - turn * std::round((to - from) / turn);
}

// Prior of the base parameters about the tuned base, in their own units.
void add_prior(const Study& study, const JointFit& fit, StepEquations* normal) {
  add_base_prior(study, fit, &normal->matrix);
  for (std::size_t k = 0; k < fit.base_parameters; ++k) {
    const BaseParameter& p = study.base_parameters[k];
    const double sd = prior_sd(study, p);
    normal->right[k] += (study.base.at(p.row) - fit.parameters[k].value) / (sd * sd);
  }
  // Keeps a direction that the data do not see where it is.
  const double scale = normal->matrix.diagonal().maxCoeff();
  normal->matrix.diagonal().array() += 1e-12 * scale;
}

// Bounded for trials far out; 0 of what is ignored.
Eigen::VectorXd weights_of(const Study& study, const JointFit& fit, const Eigen::VectorXd& z) {
  Eigen::VectorXd weight(z.size());
  for (Eigen::Index i = 0; i < z.size(); i += 3) {
    const double d2 = z.segment<3>(i).squaredNorm();
    const double own = d2 > kFarSquared ? kFarSquared / d2 : 1;
    const double far = fit.loss == Loss::kHuber ? std::sqrt(own) : own;
    weight.segment<3>(i).setConstant(study.ignores(i / 3) ? 0 : far);
  }
  return weight;
}

// The fit's parameters first, then what the nuisances take.
StepEquations equations_of(const Study& study, const JointFit& fit,
                           const Eigen::MatrixXd& nuisances, const Eigen::VectorXd& weight) {
  Eigen::MatrixXd all(fit.jacobian.rows(), fit.jacobian.cols() + nuisances.cols());
  all << fit.jacobian, nuisances;
  const Eigen::MatrixXd weighted = weight.asDiagonal() * all;
  StepEquations normal{all.transpose() * weighted,
                       weighted.transpose() * study.whiten(fit.residuals)};
  normal.matrix.diagonal().tail(nuisances.cols()).array() += 1;
  add_prior(study, fit, &normal);
  return normal;
}

// One step, with bounded weights for trials far out; fills in the standard errors.
void step(const Problem& problem, const Study& study, const Eigen::MatrixXd& nuisances,
          JointFit* fit) {
  const Eigen::Index p = fit->jacobian.cols(), q = nuisances.cols();
  const Eigen::VectorXd weight = weights_of(study, *fit, study.whiten(fit->residuals));
  const StepEquations normal = equations_of(study, *fit, nuisances, weight);
  const Eigen::MatrixXd inverse = inverse_of_symmetric(normal.matrix);
  Eigen::VectorXd lower = Eigen::VectorXd::Constant(p + q, -INFINITY), upper = -lower;
  for (Eigen::Index k = 0; k < p; ++k) {
    const FittedParameter& parameter = fit->parameters[k];
    const Parameter& row = problem.table()[parameter.row];
    upper[k] = kMostOfRange * (row.upper - row.lower);
    lower[k] = -upper[k];
    if (goes_round(row)) continue;
    upper[k] = std::min(upper[k], row.upper - parameter.value);
    lower[k] = std::max(lower[k], row.lower - parameter.value);
  }
  const Eigen::VectorXd delta = bounded_minimum(normal.matrix, normal.right, lower, upper);
  shift(problem.table(), delta, fit);
  for (Eigen::Index k = 0; k < p; ++k) {
    fit->parameters[k].standard_error = std::sqrt(std::max(0.0, inverse(k, k)));
  }
}

// Residuals that are larger than their noise show as much less.
double settled_within(const Study& study, double misfit) {
  return kSettled * std::max(1.0, misfit / static_cast<double>(3 * study.size()));
}

struct Moved {
  JointFit fit;
  double misfit = 0;
};

// One step downhill, with the derivatives of before; where there is none, the fit with the standard
// errors found here.  A step may lead past the optimum, or to where the robot nearly falls over:
// half of it, then.
Result<Moved> moved_on(Predictor& predictor, const Study& study, const Eigen::MatrixXd& nuisances,
                       double best, const JointFit& fit) {
  Moved next{fit, 0};
  step(predictor.problem(), study, nuisances, &next.fit);
  const std::vector<FittedParameter> whole = next.fit.parameters;
  for (int half = 0;; ++half) {
    const Status moved = predict(predictor, study, &next.fit);
    if (moved) next.misfit = misfit_of(study, next.fit, nuisances);
    if (moved && next.misfit <= best) return next;
    if (!moved && moved.error().code != ErrorCode::kSimulation) return moved.error();
    const bool level = moved && next.misfit < best + settled_within(study, best);
    if (level || half == kMostHalvings) break;
    for (std::size_t k = 0; k < whole.size(); ++k) {
      FittedParameter& p = next.fit.parameters[k];
      const double last = fit.parameters[k].value;
      const Parameter& row = predictor.problem().table()[p.row];
      next.fit.at[p.row] = p.value = within(row, last + scaled_step(row, last, p.value) / 2);
    }
  }
  next = {fit, best};
  for (std::size_t k = 0; k < whole.size(); ++k) {
    next.fit.parameters[k].standard_error = whole[k].standard_error;
  }
  return next;
}

// To the parameters that fit without fold `f`, to first order.
Eigen::VectorXd step_without(const Study& study, const JointFit& fit,
                             const std::vector<std::size_t>& fold_of, std::size_t f) {
  const Eigen::VectorXd z = study.whiten(fit.residuals);
  const bool only = *std::max_element(fold_of.begin(), fold_of.end()) == 0;
  Eigen::VectorXd weight = weights_of(study, fit, z);
  for (std::size_t i = 0; i < study.size() && !only; ++i) {
    if (fold_of[i] == f) weight.segment<3>(static_cast<Eigen::Index>(3 * i)).setZero();
  }
  const StepEquations normal = equations_of(study, fit, no_nuisances(study), weight);
  return solve_symmetric(normal.matrix, normal.right);
}

}  // namespace

Eigen::MatrixXd no_nuisances(const Study& study) { return Eigen::MatrixXd(3 * study.size(), 0); }

bool goes_round(const Parameter& row) { return row.key.ends_with(".direction"); }

double prior_sd(const Study& study, const BaseParameter& p) {
  return p.prior_log_sd * study.base.at(p.row);
}

void add_base_prior(const Study& study, const JointFit& fit, Eigen::MatrixXd* information) {
  for (std::size_t k = 0; k < fit.base_parameters; ++k) {
    const double sd = prior_sd(study, study.base_parameters[k]);
    (*information)(k, k) += 1 / (sd * sd);
  }
}

StepEquations step_equations(const Study& study, const JointFit& fit) {
  return equations_of(study, fit, no_nuisances(study),
                      weights_of(study, fit, study.whiten(fit.residuals)));
}

void shift(const ParameterTable& table, const Eigen::VectorXd& move, JointFit* fit) {
  for (std::size_t k = 0; k < fit->parameters.size(); ++k) {
    FittedParameter& p = fit->parameters[k];
    fit->at[p.row] = p.value = within(table[p.row], p.value + move[k]);
  }
}

double misfit_of(const Study& study, const JointFit& fit, const Eigen::MatrixXd& nuisances) {
  const Eigen::VectorXd z = study.whiten(fit.residuals);
  const Eigen::VectorXd weight = weights_of(study, fit, z);
  Eigen::MatrixXd normal = nuisances.transpose() * weight.asDiagonal() * nuisances;
  normal.diagonal().array() += 1;
  const Eigen::VectorXd taken =
      solve_symmetric(normal, nuisances.transpose() * weight.asDiagonal() * z);
  const Eigen::VectorXd left = z - nuisances * taken;
  double sum = taken.squaredNorm();
  for (Eigen::Index i = 0; i < left.size() / 3; ++i) {
    if (study.ignores(i)) continue;
    const double d2 = left.segment<3>(3 * i).squaredNorm();
    const double beyond = std::max(1.0, d2 / kFarSquared);
    sum +=
        std::min(d2, kFarSquared) +
        kFarSquared * (fit.loss == Loss::kHuber ? 2 * (std::sqrt(beyond) - 1) : std::log(beyond));
  }
  for (std::size_t k = 0; k < fit.base_parameters; ++k) {
    const BaseParameter& p = study.base_parameters[k];
    const double away = (fit.parameters[k].value / study.base.at(p.row) - 1) / p.prior_log_sd;
    sum += away * away;
  }
  return sum;
}

std::map<std::string, double> start_values(const Study& study, const Regression& others,
                                           const Signature& signature) {
  // Coefficients of the columns, given everything else.
  const Eigen::MatrixXd& columns = signature.columns;
  Eigen::MatrixXd ridged = columns.transpose() * columns;
  ridged.diagonal() *= 1 + 1e-6;
  return values_at(study, others, signature,
                   solve_symmetric(ridged, columns.transpose() * others.left()));
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
                             Loss loss) {
  JointFit fit;
  fit.at = start;
  fit.parameters = parameters_of(study, start, effects, base, &fit.base_parameters);
  fit.loss = loss;
  if (Status s = predict(predictor, study, &fit); !s) return s.error();
  if (Status s = differentiate(predictor, study, &fit); !s) return s.error();
  if (fit.parameters.empty()) return fit;
  double best = misfit_of(study, fit, nuisances);
  for (int round = 0; round < rounds; ++round) {
    ASSIGN_OR_RETURN(auto moved, moved_on(predictor, study, nuisances, best, fit));
    const bool settled = moved.misfit > best - settled_within(study, best);
    best = moved.misfit;
    fit = std::move(moved.fit);
    // So near, the derivatives of before will do.
    if (settled) break;
    if (Status s = differentiate(predictor, study, &fit); !s) return s.error();
  }
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
  if (fit.jacobian.cols() == 0) return fit.residuals;
  const Eigen::VectorXd step = fit.jacobian * step_without(study, fit, fold_of, f);
  return study.unwhiten(study.whiten(fit.residuals) - step);
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
