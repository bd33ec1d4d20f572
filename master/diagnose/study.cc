#include "master/diagnose/study.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "common/base/ranges.h"
#include "common/math/statistics.h"
#include "common/score/motion_model.h"
#include "master/diagnose/fit/free_commands.h"
#include "master/diagnose/subject.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

// Before anything is known of the drive's noise.
constexpr double kFirstCommon = 0.012;
constexpr double kFirstSide = 0.010;

MotionKind kind_of(double left, double right) {
  if (left == right) return MotionKind::kStraight;
  return left == -right ? MotionKind::kTurn : MotionKind::kWide;
}

Cell make_cell(const CommandSpec& driven, const CommandSpec& own) {
  Cell cell;
  cell.command = driven;
  cell.kind = kind_of(driven.left, driven.right);
  const double most = std::max(std::abs(own.left), std::abs(own.right));
  const double duty = std::max(std::abs(driven.left), std::abs(driven.right));
  cell.level = most > 0 ? duty / most : duty;
  cell.path = cell.level * driven.duration_s;
  const double sense =
      cell.kind == MotionKind::kStraight ? driven.left : driven.right - driven.left;
  cell.mirror = sense < 0 ? -1 : 1;
  return cell;
}

// Gauge and friction stay: turns depend on them as on length and ratio, and rest poses of another
// robot's physics would drag them away from anything real.  So would they the ratio, which trades
// with the length: it is held close.
DriveBase srv1_base() {
  DriveBase base;
  base.tuned = {{row_of(Srv1::kFullSpeed), 1},
                {row_of(Srv1::kContactLength), 0.5},
                {row_of(Srv1::kFrictionRatio), 0.1}};
  base.kept = {row_of(Srv1::kFriction), row_of(Srv1::kTrackGauge), row_of(Srv1::kTreadCreep),
               row_of(Srv1::kMassHeight)};
  base.retuned = {{row_of(Srv1::kContactLength), 0.5}, {row_of(Srv1::kFrictionRatio), 0.5},
                  {row_of(Srv1::kFriction), 0.5},      {row_of(Srv1::kTrackGauge), 0.2},
                  {row_of(Srv1::kTreadCreep), 1},      {row_of(Srv1::kMassHeight), 1}};
  base.speed = row_of(Srv1::kFullSpeed);
  return base;
}

bool has_logarithm(const Parameter& p, double value) { return p.lower >= 0 && value > 0; }

DriveBase program_base(const Problem& problem, std::span<const Gene> genes) {
  const std::vector<Parameter>& declared = problem.external->table.declaration().parameters;
  const auto searched = [&](std::size_t row) { return contains(genes, row, &Gene::row); };
  bool any = false;
  for (std::size_t row = 0; row < declared.size(); ++row) any |= searched(row);
  DriveBase base;
  for (std::size_t row = 0; row < declared.size(); ++row) {
    const Parameter& p = declared[row];
    if (p.kind != ParameterKind::kReal) {  // nothing slopes along it: it stays as the config has it
      base.kept.push_back(row);
      continue;
    }
    const bool moves = searched(row) || !any;
    if (!has_logarithm(p, problem.values[row])) {
      base.kept.push_back(row);
      base.retuned.push_back({row, kShareOfRange, p.upper - p.lower});
      continue;
    }
    if (moves) {
      base.tuned.push_back({row, 1});
    } else {
      base.kept.push_back(row);
    }
    base.retuned.push_back({row, moves ? kSearchedSd : kOtherSd, 0});
  }
  return base;
}

}  // namespace

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

std::vector<Eigen::Vector3d> Study::residuals() const {
  return mapped(trials, &ResidualTrial::residual);
}

std::vector<Eigen::Vector3d> Study::residuals_about(const std::vector<Pose>& ends) const {
  std::vector<Eigen::Vector3d> residuals;
  for (std::size_t i = 0; i < size(); ++i) residuals.push_back(residual_of(trials[i], ends[i]));
  return residuals;
}

void Study::use_residuals(const std::vector<Eigen::Vector3d>& residuals) {
  for (std::size_t i = 0; i < size(); ++i) trials[i].residual = residuals[i];
}

std::vector<Pose> Study::predicted_ends() const { return mapped(trials, &ResidualTrial::X_WP); }

void Study::use_predicted_ends(const std::vector<Pose>& ends) {
  for (std::size_t i = 0; i < size(); ++i) trials[i].X_WP = ends[i];
  use_residuals(residuals_about(ends));
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
  return mapped(trials, [&](const ResidualTrial& t) { return subject->covariance(t, noise); });
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

Result<Study> make_study(const Problem& problem, std::span<const Gene> genes) {
  if (problem.log.trials.empty())
    return Error{"the trial log is empty; there is nothing to explain"};
  Study study;
  study.subject = diagnosis_subject(problem);
  study.table = &problem.table();
  study.drive = drive_base(problem, genes);
  study.scale = problem.treads().scale();
  study.base_parameters = study.drive.tuned;
  const std::vector<DrivenCommand> driven = driven_commands(problem.log, problem.commands);
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
  study.grid = pose_grid(problem.log.trials);
  study.noise.pose = reading_noise(study.gaps, study.grid);
  // Logs whose trials share one reading say nothing of it.
  study.reading_noise_known = study.noise.pose.position_m > 0 && study.noise.pose.heading_rad > 0;
  if (study.noise.pose.position_m <= 0) {
    study.noise.pose.position_m = std::max(problem.values[study.subject->pose_position.row],
                                           study.grid.step_m / std::sqrt(12.0));
  }
  if (study.noise.pose.heading_rad <= 0) {
    study.noise.pose.heading_rad = std::max(problem.values[study.subject->pose_heading.row],
                                            study.grid.heading_step_rad / std::sqrt(12.0));
  }
  study.noise.drive_common = kFirstCommon;
  study.noise.drive_side = kFirstSide;
  return study;
}

std::vector<Eigen::Vector3d> differences(const std::vector<Pose>& from, const std::vector<Pose>& to,
                                         double scale) {
  std::vector<Eigen::Vector3d> d;
  for (std::size_t i = 0; i < from.size(); ++i) {
    d.push_back(local_difference(from[i], to[i]) / scale);
  }
  return d;
}

DriveBase drive_base(const Problem& problem, std::span<const Gene> genes) {
  return problem.external ? program_base(problem, genes) : srv1_base();
}

}  // namespace gapfarm
