#include "worker/fitness.h"

#include <cmath>

#include "common/score/density.h"

namespace gapfarm {
namespace {

// Mean simulated displacement of some trials, each seen from its measured start.
Pose mean_displacement(const Problem& problem, const Prediction& prediction,
                       const std::vector<std::size_t>& members) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();  // x, y, cos, sin
  for (std::size_t i : members) {
    const Pose X_WM = collapsed(prediction.trials[i]).X_WM;
    const Pose d = between(problem.log.trials[i].X_WS, X_WM);
    sum += Eigen::Vector4d(d.x, d.y, std::cos(d.theta), std::sin(d.theta));
  }
  sum /= static_cast<double>(members.size());
  return {sum[0], sum[1], std::atan2(sum[3], sum[2])};
}

// The mean of what `score` gives each trial, by its number.
template <class Score>
Result<double> mean_over(const Prediction& prediction, Score score) {
  double sum = 0;
  for (std::size_t i = 0; i < prediction.trials.size(); ++i) {
    const Result<double> one = score(i);
    if (!one) return one;
    sum += *one;
  }
  return sum / static_cast<double>(prediction.trials.size());
}

Result<double> mean_log_score(
    const Problem& problem, const Prediction& prediction,
    decltype(&TailedDensity::log_density) of = &TailedDensity::log_density) {
  const TailedDensity density(prediction.tails);
  return mean_over(prediction, [&](std::size_t i) {
    return log_score_of(prediction.trials[i], density, problem.log.trials[i].X_WE,
                        problem.fitness.outlier_share, of);
  });
}

Result<double> mean_energy_score(const Problem& problem, const Prediction& prediction) {
  std::vector<ScoredTrial> trials;
  for (std::size_t i = 0; i < prediction.trials.size(); ++i) {
    const Alternative whole = collapsed(prediction.trials[i]);
    trials.push_back({local_difference(whole.X_WM, problem.log.trials[i].X_WE), whole.cov});
  }
  return energy_score(trials);
}

// The fitness of position or of heading alone.
Result<double> marginal_score(const Problem& problem, const Prediction& prediction,
                              const std::string& objective) {
  const bool position = objective == "position";
  if (problem.fitness.kind != FitnessKind::kEnergyScore) {
    return mean_log_score(
        problem, prediction,
        position ? &TailedDensity::log_position_density : &TailedDensity::log_heading_density);
  }
  return mean_over(prediction, [&](std::size_t i) -> Result<double> {
    const Alternative whole = collapsed(prediction.trials[i]);
    const Eigen::Vector3d r = local_difference(whole.X_WM, problem.log.trials[i].X_WE);
    return position ? energy_score_of(r.head<2>(), whole.cov.topLeftCorner<2, 2>())
                    : kHeadingLength_m *
                          energy_score_of(r.tail<1>(), whole.cov.bottomRightCorner<1, 1>());
  });
}

Result<double> mean_corner_distance(const Problem& problem, const Prediction& prediction) {
  return mean_over(prediction, [&](std::size_t i) -> Result<double> {
    const Trial& trial = problem.log.trials[i];
    return corner_distance(problem.piece(trial.command), collapsed(prediction.trials[i]).X_WM,
                           trial.X_WE);
  });
}

Result<RobustFitness> robust_score(const Problem& problem, const FitnessReference& reference,
                                   const Prediction& prediction) {
  std::vector<SimulatedMotion> simulated;
  for (std::size_t g = 0; g < reference.real.size(); ++g) {
    simulated.push_back({mean_displacement(problem, prediction, reference.members[g]),
                         prediction.facts[reference.command[g]]});
  }
  return robust_fitness(reference.real, simulated, problem.fitness);
}

}  // namespace

Result<FitnessReference> fitness_reference(const Problem& problem) {
  FitnessReference reference;
  if (problem.fitness.kind != FitnessKind::kRobustMahalanobis) return reference;
  ASSIGN_OR_RETURN(auto model, MotionModel::mine(problem.log, problem.commands));
  for (const CommandMotion& motion : model.commands()) {
    if (motion.trials < MotionModelSettings{}.least_trials) continue;
    reference.real.push_back({motion.command.name, motion.motion.mean, motion.motion.covariance});
    reference.members.emplace_back();
    for (std::size_t i = 0; i < problem.log.trials.size(); ++i) {
      if (resolved_command(problem.log.trials[i], problem.commands) == motion.command) {
        reference.members.back().push_back(i);
      }
    }
    const CommandSpec& named = problem.command(motion.command.name);
    reference.command.push_back(static_cast<std::size_t>(&named - problem.commands.data()));
  }
  if (reference.real.empty()) {
    return Error{"fitness robust_mahalanobis needs at least " +
                 std::to_string(MotionModelSettings{}.least_trials) +
                 " trials of one command at one duty and duration; add trials or choose log_score"};
  }
  return reference;
}

Alternative collapsed(const TrialPrediction& prediction) {
  const Alternative& first = prediction.alternatives.front();
  if (prediction.alternatives.size() == 1) return first;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Alternative& a : prediction.alternatives) {
    mean += a.weight * local_difference(first.X_WM, a.X_WM);
  }
  Alternative whole;
  whole.X_WM = first.X_WM * Pose{mean[0], mean[1], mean[2]};
  for (const Alternative& a : prediction.alternatives) {
    const Eigen::Vector3d d = local_difference(whole.X_WM, a.X_WM);
    const Eigen::Matrix3d turned = rotate_covariance(a.cov, a.X_WM.theta - whole.X_WM.theta);
    whole.cov += a.weight * (turned + d * d.transpose());
  }
  return whole;
}

Result<double> log_score_of(const TrialPrediction& prediction, const TailedDensity& density,
                            const Pose& X_WM, double outlier_share,
                            decltype(&TailedDensity::log_density) of) {
  std::vector<double> terms;
  for (const Alternative& a : prediction.alternatives) {
    if (a.weight <= 0) continue;
    ASSIGN_OR_RETURN(const auto term, (density.*of)(local_difference(a.X_WM, X_WM), a.cov,
                                                    a.reading_cov, outlier_share));
    terms.push_back(std::log(a.weight) + term);
  }
  return log_sum_exp(terms);
}

Result<v1::EvaluateResult> fitness_of(const Problem& problem, const FitnessReference& reference,
                                      const Prediction& prediction) {
  v1::EvaluateResult result;
  result.set_conditions(prediction.conditions);
  switch (problem.fitness.kind) {
    case FitnessKind::kLogScore: {
      ASSIGN_OR_RETURN(const auto score, mean_log_score(problem, prediction));
      result.set_fitness(score);
      break;
    }
    case FitnessKind::kEnergyScore: {
      ASSIGN_OR_RETURN(const auto score, mean_energy_score(problem, prediction));
      result.set_fitness(score);
      break;
    }
    case FitnessKind::kCornerDistance:
      result.set_fitness(mean_corner_distance(problem, prediction).value());
      break;
    case FitnessKind::kLeastValue:
    case FitnessKind::kGreatestValue:
      return Error{"the fitness is a value, and what was simulated are trials"};
    case FitnessKind::kRobustMahalanobis: {
      ASSIGN_OR_RETURN(const auto score, robust_score(problem, reference, prediction));
      result.set_fitness(score.fitness);
      break;
    }
  }
  bool finite = std::isfinite(result.fitness());
  for (const SearchedObjective& objective : problem.fitness.objectives) {
    ASSIGN_OR_RETURN(const auto score, marginal_score(problem, prediction, objective.name));
    result.add_objectives(score);
    finite = finite && std::isfinite(score);
  }
  if (!finite) {
    return Error{"the fitness is not finite; a pose of the log may lie impossibly far away"};
  }
  return result;
}

}  // namespace gapfarm
