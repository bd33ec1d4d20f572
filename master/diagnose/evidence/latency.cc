#include "master/diagnose/evidence/latency.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "common/base/ranges.h"
#include "common/math/algebra.h"

namespace gapfarm {
namespace {

// A squared standardised difference beyond this is an outlier of neither hypothesis.
constexpr double kCap = 25;

std::vector<double> tried_ages() {
  std::vector<double> ages;
  for (double a = 0.004; a < 0.04; a += 0.003) ages.push_back(a);
  for (double a = 0.04; a <= kOldestReading_s; a += 0.015) ages.push_back(a);
  return ages;
}

const double kLeastSided = std::log(20);  // nats: one chance in twenty

// Log density of each reading if it was that late, less if it was in time.
using Evidence = std::function<std::vector<double>(double age_s)>;

// Readings that are far off for another reason are so either way.  Nats for late ones alone over as
// many that fell behind as ran ahead, which none can.
double sided(const Evidence& evidence, const LatencyFit& fit) {
  const std::vector<double> late = evidence(fit.latency_s), early = evidence(-fit.latency_s);
  double nats = 0;
  for (std::size_t k = 0; k < late.size(); ++k) {
    const double behind = std::exp(std::min(late[k], 600.0)),
                 ahead = std::exp(std::min(early[k], 600.0));
    nats += std::log((1 - fit.share + fit.share * behind) /
                     (1 - fit.share + fit.share * (behind + ahead) / 2));
  }
  return nats;
}

// Best age and share of the mixture; no weights.
LatencyFit best_mixture(const Evidence& evidence, std::span<const double> shares) {
  LatencyFit best;
  for (double age : tried_ages()) {
    const std::vector<double> late = evidence(age);
    for (double share : shares) {
      double gain = 0;
      for (double l : late) gain += std::log(1 - share + share * std::exp(std::min(l, 600.0)));
      if (gain > best.gain) best = {gain, age, share, {}};
    }
  }
  return best;
}

double probability_of(double share, double log_ratio) {
  const double ratio = std::exp(std::clamp(log_ratio, -40.0, 40.0));
  return share * ratio / (1 - share + share * ratio);
}

struct SharedReading {
  std::size_t before = 0;
  std::size_t after = 0;
};

std::vector<SharedReading> shared_readings(const Study& study) {
  std::vector<SharedReading> all;
  for (const ReadingGap& g : study.gaps) {
    if (g.gap.isZero(1e-12)) all.push_back({g.previous, g.trial});
  }
  return all;
}

// Residual of a trial whose start reading was taken `age_s` too early, were all else right.
Eigen::Vector3d of_late_start(const ResidualTrial& after, const Eigen::Vector3d& velocity,
                              double age_s) {
  const Pose started = after.X_WS * exp(age_s * velocity);
  return local_difference(after.X_WP, started * between(after.X_WS, after.X_WP));
}

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
    std::vector<CommandSpec> commands = mapped(study_.cells, &Cell::command);
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
      const double share =
          (std::hypot(predicted.x, predicted.y) + 0.05 * std::abs(predicted.theta)) /
          std::max(whole, 1e-9);
      Eigen::Matrix<double, 3, 5> own;
      // The start reading's error and the sides' gains, carried to here.
      own << carry(predicted), share * known.left, share * known.right;
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
    ASSIGN_OR_RETURN(const auto with, simulate(tau_s));
    Sums sums;
    for (std::size_t i : with_path_) {
      const std::size_t cell = study_.trials[i].cell;
      add(i, without[cell], with[cell], tau_s, &sums);
    }
    return sums;
  }

 private:
  Predictor& predictor_;
  const Study& study_;
  std::vector<std::size_t> with_path_;
};

}  // namespace

LatencyFit fit_latency(std::span<const ReadingGap> gaps,
                       std::span<const Eigen::Vector3d> end_velocity, const PoseNoise& noise,
                       std::size_t trials) {
  LatencyFit best;
  best.weights.assign(trials, 0);
  if (gaps.empty() || noise.position_m <= 0 || noise.heading_rad <= 0) return best;
  const Eigen::Vector3d sd =
      std::sqrt(2.0) * Eigen::Vector3d(noise.position_m, noise.position_m, noise.heading_rad);
  // The reading at rest follows the late one by `age`: the gap is age times the end velocity.
  const auto log_density = [&](const ReadingGap& g, double age_s, double cap) {
    const Eigen::Vector3d z = (g.gap - age_s * end_velocity[g.previous]).cwiseQuotient(sd);
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum -= 0.5 * std::min(z[k] * z[k], cap);
    return sum;
  };
  constexpr double kShares[] = {0.03, 0.06, 0.1, 0.15, 0.2, 0.3,  0.4,
                                0.5,  0.6,  0.7, 0.8,  0.9, 0.999};
  const auto evidence = [&](double age_s) {
    std::vector<double> ratios = mapped(gaps, [&](const ReadingGap& g) {
      return log_density(g, age_s, kCap) - log_density(g, 0, kCap);
    });
    return ratios;
  };
  best = best_mixture(evidence, kShares);
  if (best.gain > 0 && sided(evidence, best) < kLeastSided) best.gain = 0;
  best.weights.assign(trials, best.share);
  for (const ReadingGap& g : gaps) {
    if (best.gain <= 0) break;
    best.weights[g.previous] = probability_of(
        best.share, log_density(g, best.latency_s, INFINITY) - log_density(g, 0, INFINITY));
  }
  return best;
}

LatencyFit fit_latency(const Study& study, std::span<const Eigen::Vector3d> end_velocity) {
  if (!study.reading_noise_known) return fit_shared_latency(study, end_velocity);
  const std::vector<ReadingGap> gaps =
      late_reading_gaps(study.trials, {end_velocity.begin(), end_velocity.end()}, study.noise.pose);
  LatencyFit fit = fit_latency(gaps, end_velocity, study.noise.pose, study.size());
  if (fit.gain <= 0) return fit;
  // Where no reading follows, only the trial's own end shows.
  std::vector<bool> followed(study.size(), false);
  for (const ReadingGap& g : gaps) followed[g.previous] = true;
  for (std::size_t i = 0; i < study.size(); ++i) {
    if (followed[i]) continue;
    const ResidualTrial& t = study.trials[i];
    const auto squares = [&](const Eigen::Vector3d& expected) {
      return (study.whitener[i] * (t.residual + t.late - expected)).squaredNorm();
    };
    const Eigen::Vector3d late = -fit.latency_s * end_velocity[i];
    fit.weights[i] =
        probability_of(fit.share, (squares(Eigen::Vector3d::Zero()) - squares(late)) / 2);
  }
  return fit;
}

LatencyFit fit_shared_latency(const Study& study, std::span<const Eigen::Vector3d> end_velocity) {
  const std::vector<SharedReading> readings = shared_readings(study);
  const auto squares = [&](std::size_t trial, const Eigen::Vector3d& expected) {
    const ResidualTrial& t = study.trials[trial];
    const Eigen::Vector3d z = study.whitener[trial] * (t.residual + t.late - expected);
    return std::min(z.squaredNorm(), kCap);
  };
  const auto evidence = [&](double age_s) {
    std::vector<double> ratios;
    for (const SharedReading& r : readings) {
      const Eigen::Vector3d& velocity = end_velocity[r.before];
      const Eigen::Vector3d over = of_late_start(study.trials[r.after], velocity, age_s);
      const Eigen::Vector3d none = Eigen::Vector3d::Zero();
      ratios.push_back((squares(r.before, none) + squares(r.after, none) -
                        squares(r.before, -age_s * velocity) - squares(r.after, over)) /
                       2);
    }
    return ratios;
  };
  constexpr double kShares[] = {0.005, 0.01, 0.02, 0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.5};
  LatencyFit best = best_mixture(evidence, kShares);
  best.weights.assign(study.size(), 0);
  if (best.gain <= 0) return best;
  const std::vector<double> late = evidence(best.latency_s);
  for (std::size_t k = 0; k < readings.size(); ++k) {
    best.weights[readings[k].before] = probability_of(best.share, late[k]);
  }
  return best;
}

std::vector<Eigen::Vector3d> late_marks(const Study& study, const LatencyFit& fit,
                                        std::span<const Eigen::Vector3d> end_velocity) {
  std::vector<Eigen::Vector3d> marks;
  for (std::size_t i = 0; i < study.size(); ++i) {
    marks.push_back(-fit.weights[i] * fit.latency_s * end_velocity[i]);
  }
  for (const SharedReading& r : shared_readings(study)) {
    if (study.reading_noise_known) break;  // of a coarse grid: two readings of one pose
    marks[r.after] += fit.weights[r.before] *
                      of_late_start(study.trials[r.after], end_velocity[r.before], fit.latency_s);
  }
  return marks;
}

Result<PathLag> fit_path_lag(Predictor& predictor, const Study& study) {
  PathFit fit(predictor, study);
  PathLag lag;
  lag.trials = fit.trials();
  if (lag.trials == 0 || study.noise.pose.position_m <= 0 || study.noise.pose.heading_rad <= 0) {
    return lag;
  }
  ASSIGN_OR_RETURN(const auto without, fit.simulate(0));
  const Parameter& row =
      predictor.problem().table()[predictor.problem().table().row("motor_lag.tau")];
  double tau_s = kFirstTau_s;
  for (int round = 0; round < kRounds; ++round) {
    ASSIGN_OR_RETURN(const auto sums, fit.sums(without, tau_s));
    if (!(sums.mark2 > 0) || sums.product <= 0) return lag;
    const double explained = sums.product * sums.product / sums.mark2;
    // What the nuisances and a lag leave over spreads more than readings alone where the base's
    // ways differ from the robot's.
    const double spread =
        std::max(1.0, (sums.measured2 - explained) /
                          static_cast<double>(std::max<Eigen::Index>(sums.freedom, 1)));
    lag.gain = explained / 2 / spread;
    lag.tau_s = std::min(sums.product / sums.mark2, row.upper);
    lag.standard_error_s = std::sqrt(spread / sums.mark2);
    tau_s = std::max(lag.tau_s, kLeastTau_s);
  }
  return lag;
}

}  // namespace gapfarm
