#include "master/diagnose/evidence/path_lag.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "common/math/algebra.h"

namespace gapfarm {
namespace {

constexpr double kInterval_s = 0.02;  // of the simulated paths
constexpr double kFirstTau_s = 0.05;
constexpr int kRounds = 3;                 // the way's delay is not quite linear in tau
constexpr std::size_t kFewestSamples = 5;  // in a path, or it says nothing of a course in time
constexpr double kLeastTau_s = 1e-3;

// Pose in the start frame at time t; beyond the ends, the pose there.
Pose at_time(const std::vector<PathSample>& path, double t_s) {
  const auto after = std::lower_bound(path.begin(), path.end(), t_s,
                                      [](const PathSample& s, double t) { return s.t_s < t; });
  if (after == path.begin()) return path.front().pose;
  if (after == path.end()) return path.back().pose;
  const PathSample& before = *std::prev(after);
  const double share = (t_s - before.t_s) / (after->t_s - before.t_s);
  return before.pose * exp(Twist(log(between(before.pose, after->pose)) * share));
}

// What is left of `columns` once a trial's own nuisances have taken their part.
Eigen::MatrixXd cleaned(const Eigen::MatrixXd& nuisances, const Eigen::MatrixXd& columns) {
  return columns - nuisances * least_squares_of(nuisances, columns);
}

// Sums over trials of products of the lag's mark and of what was measured.
struct Sums {
  double mark2 = 0, product = 0, measured2 = 0;
  Eigen::Index freedom = 0;
};

class PathFit {
 public:
  PathFit(Predictor& predictor, const Study& study) : predictor_(predictor), study_(study) {
    const std::vector<Trial>& trials = predictor.problem().log.trials;
    for (std::size_t i = 0; i < trials.size(); ++i) {
      if (trials[i].path.size() >= kFewestSamples && !study.ignores(i)) with_path_.push_back(i);
    }
  }

  std::size_t trials() const { return with_path_.size(); }

  // One path a cell.
  Result<std::vector<std::vector<PathSample>>> simulate(double tau_s) {
    Overrides at = study_.base;
    at[predictor_.problem().table().row("motor_lag.tau")] = tau_s;
    std::vector<CommandSpec> commands;
    for (const Cell& cell : study_.cells) commands.push_back(cell.command);
    return predictor_.paths(at, commands, kInterval_s);
  }

  void add(std::size_t trial, const std::vector<PathSample>& without,
           const std::vector<PathSample>& with, double tau_s, Sums* sums) const {
    const Trial& logged = predictor_.problem().log.trials[trial];
    const ResidualTrial& known = study_.trials[trial];
    const auto n = static_cast<Eigen::Index>(logged.path.size());
    Eigen::MatrixXd nuisances(3 * n, 5), columns(3 * n, 2);
    const Eigen::Vector3d sd(study_.noise.pose.position_m, study_.noise.pose.position_m,
                             study_.noise.pose.heading_rad);
    const Pose end = without.back().pose;
    const double whole = std::hypot(end.x, end.y) + 0.05 * std::abs(end.theta);
    for (Eigen::Index k = 0; k < n; ++k) {
      const PathSample& sample = logged.path[static_cast<std::size_t>(k)];
      const Pose predicted = at_time(without, sample.t_s);
      const Pose delayed = at_time(with, sample.t_s);
      // The start reading's error, carried to here.
      const double c = std::cos(predicted.theta), s = std::sin(predicted.theta);
      Eigen::Matrix3d carried;
      carried << c, s, s * predicted.x - c * predicted.y, -s, c, c * predicted.x + s * predicted.y,
          0, 0, 1;
      const double share =
          (std::hypot(predicted.x, predicted.y) + 0.05 * std::abs(predicted.theta)) /
          std::max(whole, 1e-9);
      Eigen::Matrix<double, 3, 5> own;
      own << carried, share * known.left, share * known.right;
      Eigen::Matrix<double, 3, 2> here;
      here << local_difference(predicted, delayed) / tau_s,
          local_difference(predicted, between(known.X_WS, sample.pose));
      nuisances.middleRows<3>(3 * k) = sd.cwiseInverse().asDiagonal() * own;
      columns.middleRows<3>(3 * k) = sd.cwiseInverse().asDiagonal() * here;
    }
    const Eigen::MatrixXd left = cleaned(nuisances, columns);
    sums->mark2 += left.col(0).squaredNorm();
    sums->product += left.col(0).dot(left.col(1));
    sums->measured2 += left.col(1).squaredNorm();
    sums->freedom += 3 * n - 5;
  }

  Result<Sums> sums(const std::vector<std::vector<PathSample>>& without, double tau_s) {
    const auto with = simulate(tau_s);
    if (!with) return with.error();
    Sums sums;
    for (std::size_t i : with_path_) {
      const std::size_t cell = study_.trials[i].cell;
      add(i, without[cell], (*with)[cell], tau_s, &sums);
    }
    return sums;
  }

 private:
  Predictor& predictor_;
  const Study& study_;
  std::vector<std::size_t> with_path_;
};

}  // namespace

Result<PathLag> fit_path_lag(Predictor& predictor, const Study& study) {
  PathFit fit(predictor, study);
  PathLag lag;
  lag.trials = fit.trials();
  if (lag.trials == 0 || study.noise.pose.position_m <= 0 || study.noise.pose.heading_rad <= 0) {
    return lag;
  }
  const auto without = fit.simulate(0);
  if (!without) return without.error();
  const Parameter& row =
      predictor.problem().table()[predictor.problem().table().row("motor_lag.tau")];
  double tau_s = kFirstTau_s;
  for (int round = 0; round < kRounds; ++round) {
    const auto sums = fit.sums(*without, tau_s);
    if (!sums) return sums.error();
    if (!(sums->mark2 > 0) || sums->product <= 0) return lag;
    const double explained = sums->product * sums->product / sums->mark2;
    // What the nuisances and a lag leave over spreads more than readings alone where the base's
    // ways differ from the robot's.
    const double spread =
        std::max(1.0, (sums->measured2 - explained) /
                          static_cast<double>(std::max<Eigen::Index>(sums->freedom, 1)));
    lag.gain = explained / 2 / spread;
    lag.tau_s = std::min(sums->product / sums->mark2, row.upper);
    lag.standard_error_s = std::sqrt(spread / sums->mark2);
    tau_s = std::max(lag.tau_s, kLeastTau_s);
  }
  return lag;
}

}  // namespace gapfarm
