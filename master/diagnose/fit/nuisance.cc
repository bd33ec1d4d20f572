#include "master/diagnose/fit/nuisance.h"

#include <cmath>
#include <set>
#include <tuple>

#include "master/diagnose/fit/free_commands.h"
#include "master/diagnose/fit/slopes.h"

namespace gapfarm {
namespace {

struct Misfit {
  MotionKind kind;
  int component;   // 0 x, 1 y, 2 heading
  double fixed;    // m or rad
  double growing;  // per second at full level
};

constexpr Misfit kMisfits[] = {
    {MotionKind::kStraight, 0, 0.0002, 0.0003}, {MotionKind::kTurn, 2, 0.002, 0.005},
    {MotionKind::kWide, 0, 0.0005, 0.0025},     {MotionKind::kWide, 1, 0.0005, 0.0025},
    {MotionKind::kWide, 2, 0.003, 0.008},
};

double misfit_size(const Misfit& misfit, double path, double speed_m_s) {
  return (misfit.fixed + misfit.growing * path) * speed_m_s / kMeasuredSpeed_m_s;
}

void add_column(const Study& study, const std::vector<Eigen::Vector3d>& values, double prior,
                std::vector<Eigen::VectorXd>* columns) {
  columns->push_back(prior * study.whiten(values));
}

// A misfit of one kind of drive at one level and duration.
void add_misfits(const Study& study, std::vector<Eigen::VectorXd>* columns) {
  std::set<std::tuple<MotionKind, double, double>> conditions;
  for (const Cell& c : study.cells) {
    conditions.insert({c.kind, std::round(c.level * 100) / 100, c.command.duration_s});
  }
  for (const auto& [kind, level, duration_s] : conditions) {
    for (const Misfit& misfit : kMisfits) {
      if (misfit.kind != kind) continue;
      std::vector<Eigen::Vector3d> values(study.size(), Eigen::Vector3d::Zero());
      for (std::size_t i = 0; i < study.size(); ++i) {
        const Cell& c = study.cells[study.trials[i].cell];
        const bool here = c.kind == kind && std::abs(c.level - level) < 0.006 &&
                          c.command.duration_s == duration_s;
        if (!here) continue;
        const bool mirrors = misfit.component != 0 || kind == MotionKind::kStraight;
        values[i][misfit.component] = mirrors ? c.mirror : 1;
      }
      add_column(study, values, misfit_size(misfit, level * duration_s, study.speed_m_s), columns);
    }
  }
}

// The base with a parameter moved by a share of its prior's unit.
Overrides retuned(const Study& study, const RetunedParameter& parameter, double share) {
  Overrides at = study.base;
  if (parameter.unit == 0) {
    at[parameter.row] *= 1 + share;
  } else {
    at[parameter.row] += share * parameter.unit;
  }
  return at;
}

}  // namespace

Eigen::Vector3d misfit_sd(const Cell& cell, double speed_m_s) {
  Eigen::Vector3d sd = Eigen::Vector3d::Zero();
  for (const Misfit& misfit : kMisfits) {
    if (misfit.kind == cell.kind) sd[misfit.component] = misfit_size(misfit, cell.path, speed_m_s);
  }
  return sd;
}

Result<Eigen::MatrixXd> nuisance_columns(Predictor& predictor, const Study& study) {
  constexpr double kStep = 0.05;
  constexpr double kLagStep = 0.02;  // s
  std::vector<PredictionRequest> requests;
  for (const RetunedParameter& r : study.drive.retuned) {
    for (double share : {kStep, -kStep}) requests.push_back({retuned(study, r, share), {}});
  }
  const auto lag = predictor.problem().table().find("motor_lag.tau");
  if (lag) {
    requests.push_back({study.base, {}});
    requests.back().at[*lag] = kLagStep;
  }
  const auto ends = predictor.attempt(requests);
  if (!ends) return ends.error();

  std::vector<Pose> middle;
  for (const ResidualTrial& t : study.trials) middle.push_back(t.X_WP);
  std::vector<Eigen::VectorXd> columns;
  std::vector<Eigen::Vector3d> faster;
  for (const ResidualTrial& t : study.trials) faster.push_back(t.left + t.right);
  add_column(study, faster, 0.3, &columns);
  for (std::size_t r = 0; r < study.drive.retuned.size(); ++r) {
    const RetunedParameter& parameter = study.drive.retuned[r];
    const auto slope = central_slope(middle, (*ends)[2 * r], (*ends)[2 * r + 1], kStep);
    if (slope) {
      add_column(study, *slope, parameter.prior_sd, &columns);
    } else {
      predictor.exclude("retuning " + predictor.problem().table()[parameter.row].key);
    }
  }
  // Motors of some hundredths of a second are part of any robot.
  if (lag && ends->back()) {
    add_column(study, differences(study, *ends->back(), kLagStep), 0.02, &columns);
  }
  if (study.free_commands) {
    for (Eigen::VectorXd& column : smooth_misfits(study)) columns.push_back(std::move(column));
  } else {
    add_misfits(study, &columns);
  }

  Eigen::MatrixXd all(static_cast<Eigen::Index>(3 * study.size()),
                      static_cast<Eigen::Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k)
    all.col(static_cast<Eigen::Index>(k)) = columns[k];
  return all;
}

}  // namespace gapfarm
