#include "master/ground/watch/changes.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/base/ranges.h"
#include "common/math/algebra.h"
#include "common/math/laws.h"
#include "common/math/statistics.h"
#include "common/random/stream.h"
#include "master/ground/watch/fleet_steps.h"
#include "master/infer/certificate.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// That offsets of commands differ by from run to run: half a percent of a wheel by a thousandth;
// fast turns slip as they like.
constexpr double kOffsetShare = 0.001, kTurnSpeedShare = 0.03;
constexpr int kWarmRounds = 4;       // from values nearby
constexpr double kOddWeight = 0.25;  // of a run that is off by itself

ScaledFleet scaled(const WatchedRows& rows, const std::vector<std::vector<OffsetFit>>& robots,
                   const std::vector<std::vector<double>>& times) {
  const VectorXd per = tolerances_of(rows).cwiseInverse();
  ScaledFleet fleet;
  fleet.owned = rows.owned.cwiseProduct(per).cwiseAbs2();
  for (const WatchedValue& value : rows.values) {
    fleet.directions.push_back(value.direction.cwiseProduct(per));
  }
  for (const std::vector<OffsetFit>& runs : robots) {
    RobotRuns& to = fleet.robots.emplace_back();
    for (const OffsetFit& run : runs) {
      to.values.push_back(run.values.cwiseProduct(per));
      to.covariances.emplace_back(per.asDiagonal() * run.covariance * per.asDiagonal());
    }
    to.weights.assign(runs.size(), 1);
    const std::size_t u = fleet.robots.size() - 1;
    const std::vector<double> all = flattened(times, std::identity());
    to.moments = mapped(indices(runs.size()), [&](std::size_t i) -> std::size_t {
      if (times.empty()) return i;
      return std::ranges::count_if(all, [&](double t) { return t < times[u][i]; });
    });
  }
  return fleet;
}

// The robot that is farthest from the others in one value.
OddRobot farthest_robot(const ScaledFleet& fleet, const std::vector<RobotFit>& fits) {
  OddRobot best;
  const Index p = fleet.owned.size();
  for (std::size_t u = 0; u < fits.size(); ++u) {
    const Shared others = estimate_shared(fits, fleet.owned, static_cast<int>(u));
    MatrixXd V = fits[u].covariance.topLeftCorner(p, p) + others.covariance;
    V.diagonal() += others.between;
    const Eigen::LLT<MatrixXd> factors(V);
    const VectorXd away = factors.solve(fits[u].beta.head(p) - others.mean);
    for (std::size_t k = 0; k < fleet.directions.size(); ++k) {
      const VectorXd& d = fleet.directions[k];
      const double precision = d.dot(factors.solve(d));
      const double change = d.dot(away) / precision;
      if (change * change * precision <= best.statistic) continue;
      const double half = kNormal90 / std::sqrt(precision);
      best = {u, k, change, change - half, change + half, change * change * precision};
    }
  }
  return best;
}

// Runs of robots without changes: normal ones, with the covariances and variances of these; or
// these themselves, the fleet's steps taken out, in another order.
class NullRuns {
 public:
  NullRuns(const ScaledFleet& fleet, const RunVariances& variances) : fleet_(fleet), flat_(fleet) {
    std::vector<RobotFit> fits = fit_robots(fleet, variances);
    for (std::size_t u = 0; u < fits.size(); ++u) {
      flat_.robots[u].values = fits[u].residuals;
      flat_.robots[u].steps.clear();
      auto& roots = roots_.emplace_back();
      for (const MatrixXd& covariance : fleet.robots[u].covariances) {
        MatrixXd V = variances.dispersion * covariance;
        V.diagonal() += variances.between;
        roots.emplace_back(V.llt().matrixL());
      }
    }
    between_ = estimate_shared(fits, fleet.owned, -1).between;
  }

  ScaledFleet draw(Stream* stream, bool in_order) const {
    ScaledFleet drawn = flat_;
    for (std::size_t u = 0; u < drawn.robots.size(); ++u) {
      RobotRuns& to = drawn.robots[u];
      const RobotRuns& from = flat_.robots[u];
      const std::vector<std::size_t> order = stream->permutation(to.values.size());
      for (std::size_t i = 0; i < order.size(); ++i) {
        if (in_order) {
          VectorXd white(fleet_.owned.size());
          for (double& w : white) w = stream->normal();
          to.values[i] = roots_[u][i] * white;
          to.weights[i] = 1;
        } else {
          to.values[i] = from.values[order[i]];
          to.covariances[i] = from.covariances[order[i]];
          to.weights[i] = from.weights[order[i]];
        }
      }
    }
    return drawn;
  }

  // What robots of a kind differ by, into fits of such runs.
  void differ(Stream* stream, std::vector<RobotFit>* fits) const {
    for (RobotFit& fit : *fits) {
      for (Index k = 0; k < between_.size(); ++k) {
        fit.beta[k] += std::sqrt(between_[k]) * stream->normal();
      }
    }
  }

 private:
  const ScaledFleet& fleet_;
  ScaledFleet flat_;  // without what each robot owns
  std::vector<std::vector<MatrixXd>> roots_;
  VectorXd between_;
};

// `fleet`: with steps that are no scatter.
WatchThresholds draw_thresholds(const ScaledFleet& fleet, const RunVariances& variances,
                                std::uint64_t seed, bool in_order) {
  const NullRuns null(fleet, variances);
  std::vector<std::vector<double>> steps(fleet.directions.size());
  std::vector<double> robots;
  const bool compared = fleet.robots.size() > 2;
  for (int d = 0; d < kDraws; ++d) {
    Stream stream({seed, Purpose::kStatistics, in_order ? 5U : 6U, static_cast<std::uint64_t>(d)});
    ScaledFleet drawn = null.draw(&stream, in_order);
    RunVariances at = variances;
    estimate_variances(&drawn.robots, &at, kWarmRounds);
    if (compared) {
      std::vector<RobotFit> fits = fit_robots(drawn, at);
      null.differ(&stream, &fits);
      robots.push_back(farthest_robot(drawn, fits).statistic);
    }
    for (const StepCandidate& step : best_steps(&drawn, kWarmRounds, &at)) {
      steps[step.value].push_back(step.statistic);
    }
  }
  double runs = 0;
  for (const RobotRuns& robot : fleet.robots) runs += static_cast<double>(robot.values.size());
  const double alarms = std::min(kFalseAlarmsPerRun * runs, kMostFalseAlarms);
  const double each = compared ? alarms / 2 : alarms;
  WatchThresholds thresholds{alarms, {}, compared ? threshold_of(robots, each) : 0};
  for (const std::vector<double>& of_value : steps) {
    thresholds.steps.push_back(threshold_of(of_value, each / static_cast<double>(steps.size())));
  }
  return thresholds;
}

// The higher ones of normal runs and of these in another order.  A step that is left in these
// would pass for their scatter and hide the others: all that normal runs do not show are taken out.
WatchThresholds thresholds_of(ScaledFleet fleet, RunVariances variances, std::uint64_t seed) {
  ScaledFleet stepped = fleet;
  const StepCandidate best = best_of(best_steps(&stepped, kEstimateRounds, &variances));
  if (best.statistic > 0) add_step(best, &stepped);
  WatchThresholds most = draw_thresholds(stepped, variances, seed, true);
  if (!add_steps_beyond(most.steps, &fleet, &variances).empty()) stepped = std::move(fleet);
  const WatchThresholds again = draw_thresholds(stepped, variances, seed, false);
  for (std::size_t k = 0; k < most.steps.size(); ++k) {
    most.steps[k] = std::max(most.steps[k], again.steps[k]);
  }
  most.robot = std::max(most.robot, again.robot);
  return most;
}

std::vector<std::vector<RunReading>> readings_of(const WatchedRows& rows, const ScaledFleet& fleet,
                                                 const RobotFit& fit, const VectorXd& owned) {
  std::vector<std::vector<RunReading>> readings;
  const Index p = owned.size(), q = fit.beta.size();
  for (std::size_t k = 0; k < fleet.directions.size(); ++k) {
    const VectorXd& d = fleet.directions[k];
    auto& of_value = readings.emplace_back();
    for (std::size_t i = 0; i < fit.precisions.size(); ++i) {
      const double precision = d.dot(fit.precisions[i] * d);
      const VectorXd off =
          fit.residuals[i] + fit.designs[i].rightCols(q - p) * fit.beta.tail(q - p);
      of_value.push_back({value_at(rows, k, owned) + d.dot(fit.precisions[i] * off) / precision,
                          1 / std::sqrt(precision)});
    }
  }
  return readings;
}

std::vector<std::vector<double>> detectable_of(const ScaledFleet& fleet, RobotRuns robot,
                                               const RunVariances& variances,
                                               const WatchThresholds& thresholds) {
  robot.steps.clear();
  std::vector<std::vector<double>> detectable;
  for (const auto& scores : score_steps(fit_robot(robot, variances), robot, fleet.directions)) {
    const double squares =
        infer::noncentrality_for(kDetectablePower, thresholds.steps[detectable.size()], 1);
    detectable.push_back(mapped(
        scores, [&](const StepScore& score) { return std::sqrt(squares / score.precision); }));
  }
  return detectable;
}

}  // namespace

FleetChanges find_changes(const WatchedRows& rows,
                          const std::vector<std::vector<OffsetFit>>& robots, std::uint64_t seed,
                          const std::vector<std::vector<double>>& times) {
  ScaledFleet fleet = scaled(rows, robots, times);
  const Index p = fleet.owned.size();
  RunVariances variances{1, VectorXd::Ones(p)};
  estimate_variances(&fleet.robots, &variances, kEstimateRounds);
  FleetChanges result;
  result.thresholds = thresholds_of(fleet, variances, seed);
  const WatchThresholds& most = result.thresholds;
  const auto found = add_steps_beyond(most.steps, &fleet, &variances);
  estimate_variances(&fleet.robots, &variances, kEstimateRounds);
  result.steps = describe_steps(rows, fleet, variances, found);
  std::vector<RobotFit> fits = fit_robots(fleet, variances);
  const Shared shared = estimate_shared(fits, fleet.owned, -1);
  const VectorXd units = tolerances_of(rows);
  for (Index k = 0; k < p; ++k) {
    result.shared.push_back(
        {shared.mean[k] * units[k], std::sqrt(shared.covariance(k, k)) * units[k],
         std::sqrt(shared.between[k]) * units[k], std::sqrt(variances.between[k]) * units[k]});
  }
  for (std::size_t u = 0; u < fits.size(); ++u) {
    const RobotFit& fit = fits[u];
    const RobotRuns& robot = fleet.robots[u];
    result.owned.emplace_back(fit.beta.head(p).cwiseProduct(units));
    result.owned_errors.emplace_back(
        fit.covariance.diagonal().head(p).cwiseSqrt().cwiseProduct(units));
    for (std::size_t i = 0; i < robot.weights.size(); ++i) {
      if (robot.weights[i] < kOddWeight) result.odd_runs.push_back({u, i, robot.weights[i]});
    }
    result.detectable.push_back(detectable_of(fleet, robot, variances, most));
    result.readings.push_back(readings_of(rows, fleet, fit, result.owned.back()));
  }
  std::vector<std::size_t> names = indices(fits.size());
  while (fits.size() > 2) {
    OddRobot odd = farthest_robot(fleet, fits);
    if (odd.statistic <= most.robot) break;
    const auto at = static_cast<std::ptrdiff_t>(odd.robot);
    odd.robot = names[odd.robot];
    fits.erase(fits.begin() + at);
    names.erase(names.begin() + at);
    result.odd_robots.push_back(odd);
  }
  return result;
}

WatchedRows watched_rows(const GroundRobot& robot) {
  WatchedRows watched;
  watched.rows = change_rows(robot);
  std::vector<GroundHypothesis> catalogue = ground_hypotheses(robot);
  append(catalogue, change_hypotheses(robot, watched.rows));
  for (KinematicRow& row : command_offsets(robot)) {
    row.tolerance = row.name.ends_with("_speed") ? kTurnSpeedShare : kOffsetShare;
    watched.rows.push_back(std::move(row));
  }
  const auto p = static_cast<Eigen::Index>(watched.rows.size());
  watched.owned.resize(p);
  const std::vector<KinematicRow> kept = kinematic_rows(robot);
  const auto add = [&](const GroundHypothesis& h, const KinematicRow& row,
                       Eigen::VectorXd direction) {
    watched.values.push_back({h.name, row.name, h.thing, row.unit, row.nominal,
                              plausible_error(row), least_value(row), direction});
  };
  for (Eigen::Index k = 0; k < p; ++k) {
    const KinematicRow& row = watched.rows[k];
    const KinematicRow* own = find_by(kept, row.name, &KinematicRow::name);
    watched.owned[k] = (own == nullptr ? row : *own).tolerance;
    // Wheels that stand farther out turn the robot less far.
    const bool inverse = row.name == "turn";
    const std::string name = inverse ? "arm" : row.name;
    const auto h = std::ranges::find_if(catalogue, [&](const GroundHypothesis& of) {
      return contains(of.freed, name, &KinematicRow::name);
    });
    if (h == catalogue.end()) continue;
    add(*h, inverse ? h->freed.front() : row, (inverse ? -1 : 1) * Eigen::VectorXd::Unit(p, k));
  }
  // All wheels alike.
  const auto is_wheel = [](const KinematicRow& row) {
    return contains(std::array{"left", "right", "ahead", "aside", "turn"}, row.name) ? 1.0 : 0.0;
  };
  const GroundHypothesis* travel = find_by(catalogue, true, [](const GroundHypothesis& h) {
    return h.freed.size() == 1 && h.freed[0].name == "travel";
  });
  if (travel != nullptr) add(*travel, travel->freed[0], vector_of(watched.rows, is_wheel));
  return watched;
}

}  // namespace gapfarm
