// Tuning the base of drives.

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "common/base/try.h"
#include "common/math/algebra.h"
#include "common/math/statistics.h"
#include "master/diagnose/fit/estimate.h"
#include "master/diagnose/fit/free_commands.h"
#include "master/diagnose/fit/slopes.h"
#include "master/diagnose/study.h"

namespace gapfarm {
namespace {

constexpr int kTuningRounds = 6;
constexpr double kRelativeStep = 0.02;
constexpr double kLargestLogStep = 0.4;
constexpr int kMostBaseHalvings = 4;
constexpr double kGainStep = 0.02;
constexpr double kSameSlope = 0.05;   // relative: a parameter that moves the ends as the gain does
constexpr double kLeastAhead = 0.05;  // mean duty of a drive that does
// How near to its bounds a parameter may be tuned.
constexpr double kAboveLower = 1.1, kBelowUpper = 0.9;

// The cell's median residual, and where its derivatives are looked up.
struct CellResidual {
  Eigen::Vector3d median = Eigen::Vector3d::Zero();
  std::size_t trial = 0;  // any of it
  double count = 0;
};

std::vector<CellResidual> cell_residuals(const Study& study) {
  std::vector<std::array<std::vector<double>, 3>> values(study.cells.size());
  std::vector<CellResidual> cells(study.cells.size());
  for (std::size_t i = 0; i < study.size(); ++i) {
    const ResidualTrial& t = study.trials[i];
    for (int k = 0; k < 3; ++k) values[t.cell][k].push_back(t.residual[k]);
    cells[t.cell].trial = i;
    cells[t.cell].count += 1;
  }
  for (std::size_t c = 0; c < cells.size(); ++c) {
    for (int k = 0; k < 3; ++k) cells[c].median[k] = median(values[c][k]);
  }
  return cells;
}

// From both sides faster, and the right side faster than the left: each side's derivative.
void set_gains(const Eigen::Vector3d& both, const Eigen::Vector3d& apart, std::size_t trial,
               Study* study) {
  study->trials[trial].right = both / 2 + apart;
  study->trials[trial].left = both / 2 - apart;
}

Overrides scaled(const Overrides& at, std::size_t row, double factor) {
  Overrides moved = at;
  moved[row] *= factor;
  return moved;
}

// The turn beyond which a trial says nothing yet: a heading off by half a turn looks as if it were
// off the other way.  In the first rounds the speed of turning may be off by these shares.
double most_turn(std::vector<double> turns, int round) {
  constexpr double kSureTurn = 2;  // rad
  constexpr double kShares[] = {0.35, 0.15, 0.05};
  constexpr std::size_t kFewest = 12;
  if (round >= static_cast<int>(std::size(kShares))) return INFINITY;
  for (double& turn : turns) turn = std::abs(turn);
  std::sort(turns.begin(), turns.end());
  return std::max(kSureTurn / kShares[round], turns[std::min(kFewest, turns.size()) - 1]);
}

// Where a parameter may be tuned to; a program may declare narrow bounds.
std::pair<double, double> tunable(const Parameter& p) {
  const double lower = p.lower * kAboveLower, upper = p.upper * kBelowUpper;
  if (lower < upper) return {lower, upper};
  const double edge = (1 - kBelowUpper) * (p.upper - p.lower);
  return {p.lower + edge, p.upper - edge};
}

struct TuningStep {
  double length = 0;   // greatest change of a logarithm
  bool of_all = true;  // no trial was omitted
};

// Soft L1 beyond three standard errors: what the base cannot fit must not rule.
double soft_weight(const Eigen::Vector3d& z) { return 1 / std::sqrt(1 + z.squaredNorm() / 27); }

// Change of a trial's end for each logarithm.
Eigen::MatrixXd log_slopes(const std::vector<Slope>& slopes, std::size_t trial,
                           Eigen::Index parameters) {
  Eigen::MatrixXd j(3, parameters);
  for (Eigen::Index k = 0; k < parameters; ++k) {
    j.col(k) = slopes[k][trial];
  }
  return j;
}

// By the cells' medians.
StepEquations normal_of_cells(const Study& study, const std::vector<Slope>& slopes,
                              const Slope& both, Eigen::Index p, int round, bool* of_all) {
  StepEquations normal{Eigen::MatrixXd::Zero(p, p), Eigen::VectorXd::Zero(p)};
  const std::vector<CellResidual> cells = cell_residuals(study);
  std::vector<double> turns =
      mapped(cells, [&](const CellResidual& cell) { return both[cell.trial][2]; });
  const double most = most_turn(turns, round);
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const CellResidual& cell = cells[c];
    if (cell.count == 0) continue;
    if (std::abs(turns[c]) > most) {
      *of_all = false;
      continue;
    }
    // A cell's mean is known to its standard error, but no simulation gets it right to that.
    const ResidualTrial& trial = study.trials[cell.trial];
    const Eigen::Vector3d misfit = misfit_sd(study.cells[trial.cell], study.speed_m_s);
    Eigen::Matrix3d cov = trial_covariance(trial, study.noise) / cell.count;
    cov.diagonal() += misfit.cwiseAbs2();
    const Eigen::LLT<Eigen::Matrix3d> factor(cov);
    const Eigen::MatrixXd wj = factor.matrixL().solve(log_slopes(slopes, cell.trial, p));
    const Eigen::Vector3d z = factor.matrixL().solve(cell.median);
    const double weight = soft_weight(z);
    normal.matrix += weight * wj.transpose() * wj;
    normal.right += weight * wj.transpose() * z;
  }
  return normal;
}

// By every trial, beside the misfits that neighbouring commands have in common; their coefficients
// come after the parameters.
StepEquations normal_of_trials(const Study& study, const std::vector<Slope>& slopes, Eigen::Index p,
                               int round, bool* of_all) {
  const std::vector<Eigen::VectorXd> misfits = smooth_misfits(study);
  const auto q = static_cast<Eigen::Index>(misfits.size());
  StepEquations normal{Eigen::MatrixXd::Zero(p + q, p + q), Eigen::VectorXd::Zero(p + q)};
  normal.matrix.diagonal().tail(q).setOnes();
  std::vector<double> turns;
  for (std::size_t i = 0; i < study.size(); ++i) {
    turns.push_back((study.trials[i].left + study.trials[i].right)[2]);
  }
  const double most = most_turn(turns, round);
  for (std::size_t i = 0; i < study.size(); ++i) {
    if (std::abs(turns[i]) > most) {
      *of_all = false;
      continue;
    }
    Eigen::MatrixXd rows(3, p + q);
    rows.leftCols(p) = study.whitener[i] * log_slopes(slopes, i, p);
    for (Eigen::Index k = 0; k < q; ++k) {
      rows.col(p + k) = misfits[k].segment<3>(3 * i);
    }
    const Eigen::Vector3d z = study.whitener[i] * study.trials[i].residual;
    const double weight = soft_weight(z);
    normal.matrix += weight * rows.transpose() * rows;
    normal.right += weight * rows.transpose() * z;
  }
  return normal;
}

// One Gauss-Newton step on the logarithms of the base parameters.  `both`: both sides' gain's
// slope.
TuningStep tuning_step(const Problem& problem, const std::vector<BaseParameter>& parameters,
                       const std::vector<Slope>& slopes, const Slope& both, int round,
                       Study* study) {
  const auto p = static_cast<Eigen::Index>(parameters.size());
  TuningStep taken;
  auto [normal, right] = study->free_commands
                             ? normal_of_trials(*study, slopes, p, round, &taken.of_all)
                             : normal_of_cells(*study, slopes, both, p, round, &taken.of_all);
  for (Eigen::Index k = 0; k < p; ++k) {
    const BaseParameter& parameter = parameters[k];
    const double precision = 1 / (parameter.prior_log_sd * parameter.prior_log_sd);
    const double away = std::log(study->base[parameter.row] / problem.values[parameter.row]);
    normal(k, k) += precision;
    right[k] -= precision * away;
  }
  const Eigen::VectorXd step = solve_symmetric(normal, right).head(p);
  for (Eigen::Index k = 0; k < p; ++k) {
    const std::size_t row = parameters[k].row;
    const auto [lower, upper] = tunable(problem.table()[row]);
    double& value = study->base[row];
    value *= std::exp(std::clamp(step[k], -kLargestLogStep, kLargestLogStep));
    value = std::clamp(value, lower, upper);
  }
  taken.length = step.cwiseAbs().maxCoeff();
  return taken;
}

// Of every end for each parameter's logarithm; zero where it cannot be moved.
Result<std::vector<Slope>> base_slopes(Predictor& predictor,
                                       const std::vector<BaseParameter>& parameters,
                                       const std::vector<Pose>& ends, const Study& study) {
  std::vector<SlopeRequest> steps = mapped(parameters, [&](const BaseParameter& p) {
    return SlopeRequest{p.row, kRelativeStep * study.base.at(p.row)};
  });
  ASSIGN_OR_RETURN(const auto found, slopes_at(predictor, {study.base, ends}, steps));
  std::vector<Slope> slopes;
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    Slope& slope = slopes.emplace_back(study.size(), Eigen::Vector3d::Zero());
    const double a_log = steps[k].step / std::log1p(kRelativeStep);
    for (std::size_t i = 0; found[k] && i < study.size(); ++i) {
      slope[i] = a_log * (*found[k])[i];
    }
  }
  return slopes;
}

// Ends of the base, or of what lies halfway to the last one that could be simulated.
Result<std::vector<Pose>> predict_base(Predictor& predictor, const Overrides& simulated,
                                       Study* study) {
  for (int half = 0;; ++half) {
    ASSIGN_OR_RETURN(auto ends, predictor.attempt({{study->base, {}}}));
    if (ends.front()) return std::move(*ends.front());
    if (simulated.empty() || half == kMostBaseHalvings) {
      return predictor.failed("the base model cannot be simulated");
    }
    for (auto& [row, value] : study->base) {
      value = half + 1 == kMostBaseHalvings ? simulated.at(row) : (value + simulated.at(row)) / 2;
    }
  }
}

// Change of every end for both sides' gain, from what lesser duties would do: no duty may be more
// than full.  The parabola through three points, at its end.
Result<Slope> slope_of_duties(Predictor& predictor, const Overrides& at,
                              const std::vector<Pose>& ends) {
  ASSIGN_OR_RETURN(const auto less, predictor.attempt_slower(at, 1 - kGainStep));
  ASSIGN_OR_RETURN(const auto least, predictor.attempt_slower(at, 1 - 2 * kGainStep));
  if (!less || !least) return predictor.failed("the base model cannot be driven a little slower");
  Slope slope;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    slope.push_back(
        (local_difference(ends[i], (*least)[i]) - 4 * local_difference(ends[i], (*less)[i])) /
        (2 * kGainStep));
  }
  return slope;
}

// Of drives that go ahead: at the end of theirs they do at the speed at full duty.
double speed_by(const Study& study, const Slope& both) {
  std::vector<double> speeds;
  for (std::size_t i = 0; i < study.size(); ++i) {
    const CommandSpec& c = study.cells[study.trials[i].cell].command;
    const double ahead = (c.left + c.right) / 2;
    if (std::abs(ahead) > kLeastAhead) speeds.push_back(both[i].x() / (ahead * c.duration_s));
  }
  return speeds.empty() ? kMeasuredSpeed_m_s : std::max(median(speeds), 1e-3);
}

// A program's parameter that does what the gain of both sides does, if it has one.
std::optional<std::size_t> speed_among(const std::vector<BaseParameter>& parameters,
                                       const std::vector<Slope>& slopes, const Slope& both) {
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    double apart = 0, all = 0;
    for (std::size_t i = 0; i < both.size(); ++i) {
      apart += (slopes[k][i] - both[i]).squaredNorm();
      all += both[i].squaredNorm();
    }
    if (all > 0 && apart < kSameSlope * kSameSlope * all) return parameters[k].row;
  }
  return std::nullopt;
}

Overrides with_asymmetry(const Predictor& predictor, const Study& study, double ratio) {
  Overrides at = study.base;
  at[predictor.problem().table().row("motor_asymmetry.ratio")] = ratio;
  return at;
}

// Both sides' gain at the base, whose ends are `ends`; sets the speed.
Result<Slope> both_sides(Predictor& predictor, const std::vector<Slope>& slopes,
                         const std::vector<Pose>& ends, Study* study) {
  if (!predictor.problem().external) {
    study->speed_m_s = study->base.at(*study->drive.speed);
    return slopes.front();
  }
  auto both = slope_of_duties(predictor, study->base, ends);
  if (!both) return both;
  study->speed_m_s = speed_by(*study, *both);
  study->drive.speed = speed_among(study->drive.tuned, slopes, *both);
  return both;
}

// The tuned base's ends and derivatives.
Status settle(Predictor& predictor, const std::vector<Pose>& ends, Study* study) {
  study->use_predicted_ends(ends);
  ASSIGN_OR_RETURN(const auto turned,
                   predictor.attempt({{with_asymmetry(predictor, *study, kGainStep), {}},
                                      {with_asymmetry(predictor, *study, -kGainStep), {}}}));
  const auto apart = central_slope(ends, turned[0], turned[1], kGainStep);
  std::optional<Slope> both;
  if (predictor.problem().external) {
    ASSIGN_OR_RETURN(const auto slopes, base_slopes(predictor, study->drive.tuned, ends, *study));
    ASSIGN_OR_RETURN(auto found, both_sides(predictor, slopes, ends, study));
    both = std::move(found);
  } else {
    const std::size_t speed = *study->drive.speed;
    study->speed_m_s = study->base.at(speed);
    ASSIGN_OR_RETURN(const auto moved,
                     predictor.attempt({{scaled(study->base, speed, 1 + kGainStep), {}},
                                        {scaled(study->base, speed, 1 - kGainStep), {}}}));
    both = central_slope(ends, moved[0], moved[1], kGainStep);
  }
  if (!both || !apart) return predictor.failed("the base model's sides cannot be moved by 2 %");
  for (std::size_t i = 0; i < study->size(); ++i) set_gains((*both)[i], (*apart)[i], i, study);
  study->use_noise(study->noise);
  return {};
}

}  // namespace

std::vector<std::size_t> base_on_bounds(const Study& study, const Overrides& at) {
  std::vector<std::size_t> rows;
  for (const BaseParameter& p : study.drive.tuned) {
    const auto [lower, upper] = tunable((*study.table)[p.row]);
    const double value = at.at(p.row);
    if (value <= lower * 1.001 || value >= upper * 0.999) rows.push_back(p.row);
  }
  return rows;
}

Status tune_base(Predictor& predictor, bool keep, Study* study) {
  const Problem& problem = predictor.problem();
  const std::vector<BaseParameter>& parameters = study->drive.tuned;
  for (const BaseParameter& p : parameters) study->base[p.row] = problem.values[p.row];
  for (const std::size_t row : study->drive.kept) study->base[row] = problem.values[row];
  Overrides simulated;  // the last base that could be
  for (int round = 0; !keep && !parameters.empty() && round < kTuningRounds; ++round) {
    ASSIGN_OR_RETURN(auto ends, predict_base(predictor, simulated, study));
    simulated = study->base;
    study->use_predicted_ends(ends);
    ASSIGN_OR_RETURN(const auto slopes, base_slopes(predictor, parameters, ends, *study));
    ASSIGN_OR_RETURN(const auto both, both_sides(predictor, slopes, ends, study));
    if (study->free_commands) {
      ASSIGN_OR_RETURN(const auto turned,
                       predictor.attempt({{with_asymmetry(predictor, *study, kGainStep), {}}}));
      if (!turned.front()) return predictor.failed("the base model's sides cannot be parted");
      const Slope apart = differences(ends, *turned.front(), kGainStep);
      for (std::size_t i = 0; i < study->size(); ++i) set_gains(both[i], apart[i], i, study);
    }
    study->use_noise(study->noise);
    const TuningStep taken = tuning_step(problem, parameters, slopes, both, round, study);
    if (taken.of_all && taken.length < 1e-3) break;
  }
  ASSIGN_OR_RETURN(const auto ends, predict_base(predictor, simulated, study));
  if (!keep) study->on_bounds = base_on_bounds(*study, study->base);
  return settle(predictor, ends, study);
}

}  // namespace gapfarm
