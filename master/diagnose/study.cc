#include "master/diagnose/study.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "common/score/motion_model.h"
#include "common/score/statistics.h"
#include "master/diagnose/distribution.h"
#include "master/diagnose/free_commands.h"
#include "master/diagnose/nuisance.h"
#include "master/diagnose/subject.h"

namespace gapfarm {
namespace {

constexpr int kTuningRounds = 6;
constexpr double kRelativeStep = 0.02;
constexpr double kLargestLogStep = 0.4;
// Before anything is known of the drive's noise.
constexpr double kFirstCommon = 0.012;
constexpr double kFirstSide = 0.010;

DriveKind kind_of(double left, double right) {
  if (left == right) return DriveKind::kStraight;
  return left == -right ? DriveKind::kTurn : DriveKind::kWide;
}

Cell make_cell(const CommandSpec& driven, const CommandSpec& own) {
  Cell cell;
  cell.command = driven;
  cell.kind = kind_of(driven.left, driven.right);
  const double most = std::max(std::abs(own.left), std::abs(own.right));
  const double duty = std::max(std::abs(driven.left), std::abs(driven.right));
  cell.level = most > 0 ? duty / most : duty;
  cell.path = cell.level * driven.duration_s;
  const double sense = cell.kind == DriveKind::kStraight ? driven.left : driven.right - driven.left;
  cell.mirror = sense < 0 ? -1 : 1;
  return cell;
}

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
    for (int k = 0; k < 3; ++k)
      values[t.cell][static_cast<std::size_t>(k)].push_back(t.residual[k]);
    cells[t.cell].trial = i;
    cells[t.cell].count += 1;
  }
  for (std::size_t c = 0; c < cells.size(); ++c) {
    for (int k = 0; k < 3; ++k) cells[c].median[k] = median(values[c][static_cast<std::size_t>(k)]);
  }
  return cells;
}

void set_predictions(const std::vector<Pose>& ends, Study* study) {
  for (std::size_t i = 0; i < study->size(); ++i) {
    ResidualTrial& t = study->trials[i];
    t.X_WP = ends[i];
    t.residual = residual_of(t, t.X_WP);
  }
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

struct TuningStep {
  double length = 0;   // greatest change of a logarithm
  bool of_all = true;  // no trial was left out
};

struct Normal {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right;
};

// Soft L1 beyond three standard errors: what the base cannot fit must not rule.
double soft_weight(const Eigen::Vector3d& z) { return 1 / std::sqrt(1 + z.squaredNorm() / 27); }

// Change of a trial's end for each logarithm.
Eigen::MatrixXd log_slopes(const Study& study, const std::vector<std::vector<Pose>>& ends,
                           std::size_t trial, Eigen::Index parameters) {
  Eigen::MatrixXd j(3, parameters);
  for (Eigen::Index k = 0; k < parameters; ++k) {
    j.col(k) =
        local_difference(study.trials[trial].X_WP, ends[static_cast<std::size_t>(k) + 1][trial]) /
        std::log1p(kRelativeStep);
  }
  return j;
}

// By the cells' medians.
Normal normal_of_cells(const Study& study, const std::vector<std::vector<Pose>>& ends,
                       Eigen::Index p, int round, bool* of_all) {
  Normal normal{Eigen::MatrixXd::Zero(p, p), Eigen::VectorXd::Zero(p)};
  const std::vector<CellResidual> cells = cell_residuals(study);
  std::vector<double> turns;
  for (const CellResidual& cell : cells) {
    turns.push_back(log_slopes(study, ends, cell.trial, 1)(2, 0));
  }
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
    const Eigen::MatrixXd wj = factor.matrixL().solve(log_slopes(study, ends, cell.trial, p));
    const Eigen::Vector3d z = factor.matrixL().solve(cell.median);
    const double weight = soft_weight(z);
    normal.matrix += weight * wj.transpose() * wj;
    normal.right += weight * wj.transpose() * z;
  }
  return normal;
}

// By every trial, beside the misfits that neighbouring commands have in common; their coefficients
// come after the parameters.
Normal normal_of_trials(const Study& study, const std::vector<std::vector<Pose>>& ends,
                        Eigen::Index p, int round, bool* of_all) {
  const std::vector<Eigen::VectorXd> misfits = smooth_misfits(study);
  const auto q = static_cast<Eigen::Index>(misfits.size());
  Normal normal{Eigen::MatrixXd::Zero(p + q, p + q), Eigen::VectorXd::Zero(p + q)};
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
    rows.leftCols(p) = study.whitener[i] * log_slopes(study, ends, i, p);
    for (Eigen::Index k = 0; k < q; ++k) {
      rows.col(p + k) =
          misfits[static_cast<std::size_t>(k)].segment<3>(static_cast<Eigen::Index>(3 * i));
    }
    const Eigen::Vector3d z = study.whitener[i] * study.trials[i].residual;
    const double weight = soft_weight(z);
    normal.matrix += weight * rows.transpose() * rows;
    normal.right += weight * rows.transpose() * z;
  }
  return normal;
}

// One Gauss-Newton step on the logarithms of the base parameters, of which the speed is the first.
TuningStep tuning_step(const Problem& problem, const std::vector<BaseParameter>& parameters,
                       const std::vector<std::vector<Pose>>& ends, int round, Study* study) {
  const auto p = static_cast<Eigen::Index>(parameters.size());
  TuningStep taken;
  auto [normal, right] = study->free_commands
                             ? normal_of_trials(*study, ends, p, round, &taken.of_all)
                             : normal_of_cells(*study, ends, p, round, &taken.of_all);
  for (Eigen::Index k = 0; k < p; ++k) {
    const BaseParameter& parameter = parameters[static_cast<std::size_t>(k)];
    const double precision = 1 / (parameter.prior_log_sd * parameter.prior_log_sd);
    const double away = std::log(study->base[parameter.row] / problem.values[parameter.row]);
    normal(k, k) += precision;
    right[k] -= precision * away;
  }
  const Eigen::VectorXd step = normal.ldlt().solve(right).head(p);
  for (Eigen::Index k = 0; k < p; ++k) {
    const std::size_t row = parameters[static_cast<std::size_t>(k)].row;
    const Parameter& bounds = problem.table()[row];
    double& value = study->base[row];
    value *= std::exp(std::clamp(step[k], -kLargestLogStep, kLargestLogStep));
    value = std::clamp(value, bounds.lower * 1.1, bounds.upper * 0.9);
  }
  taken.length = step.cwiseAbs().maxCoeff();
  return taken;
}

}  // namespace

// Gauge and friction stay: turns depend on them as on length and ratio, and rest poses of another
// robot's physics would drag them away from anything real.  So would they the ratio, which trades
// with the length: it is held close.
std::vector<BaseParameter> tuned_base_parameters() {
  return {{row_of(Srv1::kFullSpeed), 1},
          {row_of(Srv1::kContactLength), 0.5},
          {row_of(Srv1::kFrictionRatio), 0.1}};
}

Eigen::VectorXd Study::whiten(const std::vector<Eigen::Vector3d>& values) const {
  Eigen::VectorXd rows(static_cast<Eigen::Index>(3 * values.size()));
  for (std::size_t i = 0; i < values.size(); ++i) {
    rows.segment<3>(static_cast<Eigen::Index>(3 * i)) = whitener[i] * values[i];
  }
  return rows;
}

void Study::drop_ignored(Eigen::Ref<Eigen::MatrixXd> rows) const {
  for (std::size_t i = 0; i < ignored.size(); ++i) {
    if (ignored[i]) rows.middleRows(static_cast<Eigen::Index>(3 * i), 3).setZero();
  }
}

Eigen::VectorXd Study::whitened_residuals() const {
  std::vector<Eigen::Vector3d> residuals;
  for (const ResidualTrial& t : trials) residuals.push_back(t.residual);
  return whiten(residuals);
}

std::vector<Eigen::Vector3d> Study::unwhiten(const Eigen::VectorXd& rows) const {
  std::vector<Eigen::Vector3d> values;
  for (std::size_t i = 0; i < size(); ++i) {
    const Eigen::Vector3d z = rows.segment<3>(static_cast<Eigen::Index>(3 * i));
    values.push_back(whitener[i].triangularView<Eigen::Lower>().solve(z));
  }
  return values;
}

std::vector<Eigen::Matrix3d> Study::covariances() const {
  std::vector<Eigen::Matrix3d> all;
  for (const ResidualTrial& t : trials) all.push_back(subject->covariance(t, noise));
  return all;
}

void Study::use_noise(const NoiseEstimate& estimate) {
  noise = estimate;
  whitener.clear();
  for (const ResidualTrial& t : trials) {
    const Eigen::Matrix3d lower = subject->covariance(t, noise).llt().matrixL();
    whitener.push_back(lower.triangularView<Eigen::Lower>().solve(Eigen::Matrix3d::Identity()));
    if (!trust.empty()) whitener.back() *= trust[whitener.size() - 1];
  }
}

Eigen::MatrixXd Study::rewhitened(const Study& other, const Eigen::MatrixXd& rows) const {
  Eigen::MatrixXd changed(rows.rows(), rows.cols());
  for (std::size_t i = 0; i < size(); ++i) {
    const auto at = static_cast<Eigen::Index>(3 * i);
    const auto lower = other.whitener[i].triangularView<Eigen::Lower>();
    changed.middleRows(at, 3) = whitener[i] * lower.solve(Eigen::MatrixXd(rows.middleRows(at, 3)));
  }
  return changed;
}

Result<Study> make_study(const Problem& problem) {
  if (problem.log.trials.empty())
    return Error{"the trial log is empty; there is nothing to explain"};
  Study study;
  study.subject = diagnosis_subject(problem.scenario);
  study.table = &problem.table();
  study.base_parameters = tuned_base_parameters();
  std::vector<DrivenCommand> driven;
  for (const Trial& trial : problem.log.trials) {
    const CommandSpec c = resolved_command(trial, problem.commands);
    driven.push_back({c.left, c.right, c.duration_s});
  }
  const std::vector<TrialContext> contexts = trial_contexts(problem.log, driven);
  std::map<std::tuple<std::string, double, double, double>, std::size_t> cells;
  std::map<std::string, std::size_t> sessions;
  for (std::size_t i = 0; i < driven.size(); ++i) {
    const Trial& trial = problem.log.trials[i];
    const CommandSpec c = resolved_command(trial, problem.commands);
    const auto [cell, fresh] =
        cells.try_emplace({c.name, c.left, c.right, c.duration_s}, study.cells.size());
    if (fresh) study.cells.push_back(make_cell(c, problem.command(c.name)));
    ++study.cells[cell->second].trials;
    ResidualTrial t;
    t.cell = cell->second;
    t.session = sessions.try_emplace(trial.session, sessions.size()).first->second;
    while (problem.commands[t.command].name != c.name) ++t.command;
    t.context = contexts[i];
    t.X_WS = trial.X_WS;
    t.X_WE = trial.X_WE;
    study.trials.push_back(t);
  }
  study.free_commands = commands_are_free(study.cells);
  for (Cell& cell : study.cells) {
    if (!study.free_commands) break;
    // No command of the config is what such a trial is a level of.
    cell.level = std::max(std::abs(cell.command.left), std::abs(cell.command.right));
    cell.path = cell.level * cell.command.duration_s;
  }
  study.sessions = sessions.size();
  study.gaps = reading_gaps(problem.log, contexts);
  study.quantum_m = quantisation_step(problem.log.trials);
  study.noise.pose = reading_noise(study.gaps, study.quantum_m);
  // Logs whose trials share one reading say nothing of it.
  study.reading_noise_known = study.noise.pose.position_m > 0 && study.noise.pose.heading_rad > 0;
  if (study.noise.pose.position_m <= 0) {
    study.noise.pose.position_m = std::max(problem.values[row_of(Srv1::kPoseNoisePosition)],
                                           study.quantum_m / std::sqrt(12.0));
  }
  if (study.noise.pose.heading_rad <= 0) {
    study.noise.pose.heading_rad = problem.values[row_of(Srv1::kPoseNoiseHeading)];
  }
  study.noise.drive_common = kFirstCommon;
  study.noise.drive_side = kFirstSide;
  return study;
}

std::vector<Eigen::Vector3d> differences(const Study& study, const std::vector<Pose>& ends,
                                         double scale) {
  std::vector<Eigen::Vector3d> d;
  for (std::size_t i = 0; i < study.size(); ++i) {
    d.push_back(local_difference(study.trials[i].X_WP, ends[i]) / scale);
  }
  return d;
}

Status tune_base(Predictor& predictor, bool keep, Study* study) {
  const Problem& problem = predictor.problem();
  const std::vector<BaseParameter> parameters = tuned_base_parameters();
  for (const BaseParameter& p : parameters) study->base[p.row] = problem.values[p.row];
  for (Srv1 kept : {Srv1::kFriction, Srv1::kTrackGauge, Srv1::kTreadCreep, Srv1::kMassHeight}) {
    study->base[row_of(kept)] = problem.values[row_of(kept)];
  }
  constexpr double kGainStep = 0.02;
  const std::size_t asymmetry = problem.table().row("motor_asymmetry.ratio");
  const auto with_asymmetry = [&](double ratio) {
    Overrides at = study->base;
    at[asymmetry] = ratio;
    return at;
  };
  for (int round = 0; !keep && round < kTuningRounds; ++round) {
    std::vector<PredictionRequest> requests = {{study->base, {}}};
    for (const BaseParameter& p : parameters) {
      requests.push_back({scaled(study->base, p.row, 1 + kRelativeStep), {}});
    }
    if (study->free_commands) requests.push_back({with_asymmetry(kGainStep), {}});
    const auto ends = predictor.ends(requests);
    if (!ends) return ends.error();
    set_predictions(ends->front(), study);
    study->speed_m_s = study->base[row_of(Srv1::kFullSpeed)];
    if (study->free_commands) {
      const std::vector<Eigen::Vector3d> both =
          differences(*study, (*ends)[1], std::log1p(kRelativeStep));
      const std::vector<Eigen::Vector3d> apart = differences(*study, ends->back(), kGainStep);
      for (std::size_t i = 0; i < study->size(); ++i) set_gains(both[i], apart[i], i, study);
    }
    study->use_noise(study->noise);
    const TuningStep taken = tuning_step(problem, parameters, *ends, round, study);
    if (taken.of_all && taken.length < 1e-3) break;
  }
  study->speed_m_s = study->base[row_of(Srv1::kFullSpeed)];

  const std::size_t speed = row_of(Srv1::kFullSpeed);
  const auto ends = predictor.ends({{study->base, {}},
                                    {scaled(study->base, speed, 1 + kGainStep), {}},
                                    {scaled(study->base, speed, 1 - kGainStep), {}},
                                    {with_asymmetry(kGainStep), {}},
                                    {with_asymmetry(-kGainStep), {}}});
  if (!ends) return ends.error();
  set_predictions(ends->front(), study);
  for (std::size_t i = 0; i < study->size(); ++i) {
    const Eigen::Vector3d both = local_difference((*ends)[2][i], (*ends)[1][i]) / (2 * kGainStep);
    const Eigen::Vector3d apart = local_difference((*ends)[4][i], (*ends)[3][i]) / (2 * kGainStep);
    set_gains(both, apart, i, study);
  }
  study->use_noise(study->noise);
  return {};
}

}  // namespace gapfarm
