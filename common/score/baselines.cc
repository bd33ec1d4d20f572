#include "common/score/baselines.h"

#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <map>
#include <numbers>

#include "common/base/text.h"
#include "common/math/laws.h"
#include "common/math/statistics.h"
#include "common/score/density.h"
#include "common/score/fitness.h"
#include "common/score/motion_model.h"

namespace gapfarm {
namespace {

constexpr double kLeastFreedom = 1;
constexpr double kMostFreedom = 200;
constexpr int kStudentRounds = 60;    // of expectation and maximisation; 20 settle
constexpr unsigned kMcdStarts = 100;  // a log of many sessions is fitted many times
constexpr int kDigits = 12;           // bits of the freedom's logarithm
constexpr double kLeastScale = 1e-5;  // m and rad: identical trials would have no density
constexpr double kLeastVariance = 1e-10;

using Ends = std::map<CommandSpec, std::vector<Eigen::Vector3d>>;

// Of Student's t about a place, without its scale: n dimensions at the squared distance.
double log_t(double squared, double freedom, int n) {
  return log_gamma((freedom + n) / 2) - log_gamma(freedom / 2) -
         n / 2.0 * std::log(freedom * std::numbers::pi) -
         (freedom + n) / 2 * std::log1p(squared / freedom);
}

// The freedom of the greatest likelihood.
template <class Nats>
double best_freedom(const Nats& nats) {
  const auto worse = [&](double log_freedom) { return -nats(std::exp(log_freedom)); };
  return std::exp(boost::math::tools::brent_find_minima(worse, std::log(kLeastFreedom),
                                                        std::log(kMostFreedom), kDigits)
                      .first);
}

// One component of one command's ends: Student's t at a place.
struct Student {
  double place = 0;
  double scale = 1;

  static Student fit(const std::vector<double>& values, double freedom) {
    Student t;
    std::vector<double> sorted = values;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    t.place = *middle;
    double squares = 0;
    for (double v : values) squares += (v - t.place) * (v - t.place);
    t.scale = std::max(kLeastScale, std::sqrt(squares / static_cast<double>(values.size())));
    for (int round = 0; round < kStudentRounds; ++round) {
      double weights = 0, sum = 0, spread = 0;
      for (double v : values) {
        const double z = (v - t.place) / t.scale;
        const double w = (freedom + 1) / (freedom + z * z);
        weights += w;
        sum += w * v;
      }
      t.place = sum / weights;
      for (double v : values) {
        const double z = (v - t.place) / t.scale;
        spread += (freedom + 1) / (freedom + z * z) * (v - t.place) * (v - t.place);
      }
      t.scale = std::max(kLeastScale, std::sqrt(spread / static_cast<double>(values.size())));
    }
    return t;
  }

  double log_density(double value, double freedom) const {
    const double z = (value - place) / scale;
    return log_t(z * z, freedom, 1) - std::log(scale);
  }
};

// Headings are near their command's robust mean, so that they do not wrap.
class ConstantMotion {
 public:
  explicit ConstantMotion(const Ends& ends) {
    for (int k = 0; k < 3; ++k) {
      std::map<CommandSpec, std::vector<double>> values;
      for (const auto& [key, all] : ends) {
        for (const Eigen::Vector3d& end : all) values[key].push_back(end[k]);
      }
      freedom_[k] = best_freedom([&](double freedom) {
        double sum = 0;
        for (const auto& [key, own] : values) {
          const Student t = Student::fit(own, freedom);
          for (double v : own) sum += t.log_density(v, freedom);
        }
        return sum;
      });
      for (const auto& [key, own] : values) {
        places_[key][static_cast<std::size_t>(k)] = Student::fit(own, freedom_[k]);
      }
    }
  }

  double log_density(const CommandSpec& key, const Eigen::Vector3d& end) const {
    const std::array<Student, 3>& own = places_.at(key);
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      sum += own[static_cast<std::size_t>(k)].log_density(end[k], freedom_[k]);
    }
    return sum;
  }

 private:
  Eigen::Vector3d freedom_;
  std::map<CommandSpec, std::array<Student, 3>> places_;
};

// About each command's robust mean and covariance.
class MinedMotion {
 public:
  MinedMotion(const MotionModel& model, const Ends& ends) {
    std::vector<double> squares;
    for (const CommandMotion& motion : model.commands()) {
      const auto own = ends.find(motion.command);
      if (own == ends.end()) continue;
      Eigen::Matrix3d covariance = motion.motion.covariance;
      covariance.diagonal().array() += kLeastVariance;
      const auto factor = Covariance3::factorise(covariance);
      if (!factor) continue;
      factors_.emplace(own->first, *factor);
      for (const Eigen::Vector3d& end : own->second) {
        squares.push_back(factor->squared_distance(end));
      }
    }
    if (squares.empty()) return;
    freedom_ = best_freedom([&](double freedom) {
      const double scale = scale_of(squares, freedom);
      double sum = 0;
      for (double q : squares) sum += log_t(q / scale, freedom, 3) - 1.5 * std::log(scale);
      return sum;
    });
    scale_ = scale_of(squares, freedom_);
  }

  std::optional<double> log_density(const CommandSpec& key, const Eigen::Vector3d& end) const {
    const auto factor = factors_.find(key);
    if (factor == factors_.end()) return std::nullopt;
    return log_t(factor->second.squared_distance(end) / scale_, freedom_, 3) -
           1.5 * std::log(scale_) - 0.5 * factor->second.log_determinant();
  }

 private:
  // Factor of the covariances, of the greatest likelihood at that freedom.
  static double scale_of(const std::vector<double>& squares, double freedom) {
    double scale = 1;
    for (int round = 0; round < kStudentRounds; ++round) {
      double sum = 0;
      for (double q : squares) sum += (freedom + 3) / (freedom + q / scale) * q;
      scale = std::max(kLeastVariance, sum / (3 * static_cast<double>(squares.size())));
    }
    return scale;
  }

  std::map<CommandSpec, Covariance3> factors_;
  double freedom_ = 1;
  double scale_ = 1;
};

std::string number(double value) { return formatted("%.3f", value); }

}  // namespace

Result<std::vector<BaselineScores>> baseline_scores(const TrialLog& train, const TrialLog& test,
                                                    std::span<const CommandSpec> commands) {
  MotionModelSettings settings;
  settings.least_trials = kLeastBaselineTrials;
  settings.mcd.starts = kMcdStarts;
  ASSIGN_OR_RETURN(const auto mined, MotionModel::mine(train, commands, settings));
  MotionModelSettings names;  // no command has trials enough to be fitted
  names.least_trials = test.trials.size() + 1;
  ASSIGN_OR_RETURN(const auto check, MotionModel::mine(test, commands, names));
  // Ends about each command's robust mean, in the start's axes.
  std::map<CommandSpec, Pose> about;
  for (const CommandMotion& motion : mined.commands()) {
    if (motion.trials >= kLeastBaselineTrials) about[motion.command] = motion.motion.mean;
  }
  const auto seen = [&](const Trial& trial) {
    const CommandSpec key = resolved_command(trial, commands);
    const Pose end = between(trial.X_WS, trial.X_WE);
    const auto mean = about.find(key);
    std::optional<Eigen::Vector3d> offset;
    if (mean != about.end()) {
      offset = Eigen::Vector3d(end.x - mean->second.x, end.y - mean->second.y,
                               wrap_angle(end.theta - mean->second.theta));
    }
    return std::pair{key, offset};
  };
  Ends ends;
  for (const Trial& trial : train.trials) {
    const auto [key, offset] = seen(trial);
    if (offset) ends[key].push_back(*offset);
  }
  std::vector<BaselineScores> all = {{"constant motion", {}}, {"mined motion", {}}};
  std::optional<ConstantMotion> constant;
  std::optional<MinedMotion> motion;
  if (!ends.empty()) {
    constant.emplace(ends);
    motion.emplace(mined, ends);
  }
  for (const Trial& trial : test.trials) {
    const auto [key, offset] = seen(trial);
    all[0].scores.push_back(offset ? std::optional(constant->log_density(key, *offset))
                                   : std::nullopt);
    all[1].scores.push_back(offset ? motion->log_density(key, *offset) : std::nullopt);
  }
  return all;
}

Result<std::vector<BaselineScores>> crossfitted_baselines(const TrialLog& log,
                                                          std::span<const CommandSpec> commands,
                                                          std::span<const std::size_t> fold_of) {
  const std::size_t folds = 1 + *std::max_element(fold_of.begin(), fold_of.end());
  if (folds == 1) return baseline_scores(log, log, commands);
  std::vector<BaselineScores> all;
  for (std::size_t f = 0; f < folds; ++f) {
    TrialLog train, test;
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < log.trials.size(); ++i) {
      (fold_of[i] == f ? test : train).trials.push_back(log.trials[i]);
      if (fold_of[i] == f) places.push_back(i);
    }
    if (test.trials.empty() || train.trials.empty()) continue;
    ASSIGN_OR_RETURN(const auto scores, baseline_scores(train, test, commands));
    all.resize(scores.size());
    for (std::size_t b = 0; b < all.size(); ++b) {
      all[b].name = scores[b].name;
      all[b].scores.resize(log.trials.size());
      for (std::size_t i = 0; i < places.size(); ++i) {
        all[b].scores[places[i]] = scores[b].scores[i];
      }
    }
  }
  return all;
}

std::vector<std::size_t> session_folds(const TrialLog& log) {
  std::map<std::string, std::size_t> sessions;
  std::vector<std::size_t> folds;
  for (const Trial& trial : log.trials) {
    folds.push_back(sessions.try_emplace(trial.session, sessions.size()).first->second);
  }
  if (sessions.size() > 1) return folds;
  for (std::size_t i = 0; i < folds.size(); ++i) folds[i] = i * 5 / folds.size();
  return folds;
}

std::vector<BaselineComparison> compare_with_baselines(std::span<const BaselineScores> baselines,
                                                       std::span<const double> model_scores) {
  std::vector<BaselineComparison> all;
  for (const BaselineScores& baseline : baselines) {
    BaselineComparison c{baseline.name};
    double squares = 0;
    for (std::size_t i = 0; i < model_scores.size(); ++i) {
      if (!baseline.scores[i]) continue;
      const double gain = model_scores[i] - *baseline.scores[i];
      ++c.trials;
      c.baseline += *baseline.scores[i];
      c.model += model_scores[i];
      squares += gain * gain;
    }
    if (c.trials < kLeastBaselineTrials) continue;
    const auto n = static_cast<double>(c.trials);
    c.baseline /= n;
    c.model /= n;
    const double mean = c.model - c.baseline;
    c.error = std::sqrt(std::max(0.0, squares / n - mean * mean) / n);
    all.push_back(c);
  }
  return all;
}

std::string baseline_sentence(std::span<const BaselineComparison> comparisons,
                              const std::string& model) {
  std::string text, beat_by;
  for (const BaselineComparison& c : comparisons) {
    text += (text.empty() ? "" : ", ") + c.name + " " + number(c.baseline) + " (" + model + " " +
            number(c.model) + ")";
    if (!c.beaten()) beat_by += (beat_by.empty() ? "" : " and ") + c.name;
  }
  if (text.empty()) return text;
  text += " nats a trial on " + std::to_string(comparisons.front().trials) + " trials";
  if (!beat_by.empty()) {
    text +=
        ". " + model + " does not beat " + beat_by + ": as it is, predictions need no simulation";
  }
  return text;
}

namespace {

void fit(const std::vector<Pose>& ends, ConstantVelocity* model) {
  std::vector<double> along, turned;
  for (const Pose& X_SE : ends) {
    const Twist twist = log(X_SE);
    along.push_back(twist[0]);
    turned.push_back(twist[2]);
  }
  model->trials = ends.size();
  model->speed_m_s = median(along) / model->command.duration_s;
  model->turn_rad_s = median(turned) / model->command.duration_s;
  const Pose predicted = model->at(model->command.duration_s);
  for (const Pose& X_SE : ends) {
    const Eigen::Vector3d residual = local_difference(predicted, X_SE);
    model->covariance += residual * residual.transpose() / static_cast<double>(ends.size());
  }
  // A single trial, or identical ones, would have no density.
  model->covariance += 1e-10 * Eigen::Matrix3d::Identity();
}

}  // namespace

Pose ConstantVelocity::at(double t_s) const {
  const double t = std::clamp(t_s, 0.0, command.duration_s);
  return exp({speed_m_s * t, 0, turn_rad_s * t});
}

Result<std::vector<ConstantVelocity>> constant_velocities(const TrialLog& log,
                                                          std::span<const CommandSpec> commands) {
  ASSIGN_OR_RETURN(const auto mined, MotionModel::mine(log, commands));
  std::vector<ConstantVelocity> models;
  for (const CommandMotion& motion : mined.commands()) {
    if (!(motion.command.duration_s > 0)) {
      return Error{"command '" + motion.command.name +
                   "' lasts 0 s, so it has no velocity; give its duration"};
    }
    std::vector<Pose> ends;
    for (const Trial& trial : log.trials) {
      if (resolved_command(trial, commands) == motion.command) {
        ends.push_back(between(trial.X_WS, trial.X_WE));
      }
    }
    ConstantVelocity model;
    model.command = motion.command;
    fit(ends, &model);
    models.push_back(model);
  }
  return models;
}

Result<double> constant_velocity_fitness(const Problem& problem) {
  ASSIGN_OR_RETURN(const auto models, constant_velocities(problem.log, problem.commands));
  if (problem.fitness.kind == FitnessKind::kRobustMahalanobis) {
    const auto mined = MotionModel::mine(problem.log, problem.commands);
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < models.size(); ++i) {
      const CommandMotion& real = mined->commands()[i];
      if (real.trials < MotionModelSettings{}.least_trials) continue;
      ASSIGN_OR_RETURN(const auto distance, robust_distance(models[i].at(real.command.duration_s),
                                                            {real.command.name, real.motion.mean,
                                                             real.motion.covariance}));
      sum += distance;
      ++count;
    }
    if (count == 0) return Error{"no command has trials enough for robust_mahalanobis"};
    return sum / static_cast<double>(count);
  }
  std::vector<ScoredTrial> scored;
  for (const Trial& trial : problem.log.trials) {
    const CommandSpec command = resolved_command(trial, problem.commands);
    const auto model = std::ranges::find(models, command, &ConstantVelocity::command);
    const Pose X_WP = trial.X_WS * model->at(command.duration_s);
    scored.push_back({local_difference(X_WP, trial.X_WE), model->covariance});
  }
  return problem.fitness.kind == FitnessKind::kLogScore
             ? log_score(scored, problem.fitness.outlier_share)
             : energy_score(scored);
}

}  // namespace gapfarm
