// A small push problem: a square and a triangle, four pushes each.
#pragma once

#include "common/parameters/table.h"
#include "common/problem/problem.h"
#include "worker/evaluate.h"

namespace gapfarm::tests {

inline Problem push_problem() {
  Problem problem;
  problem.scenario = "push";
  problem.values = push_table().nominal();
  problem.values[row_of(Push::kStepRate)] = 120;
  problem.values[row_of(Push::kShapeFactor)] = 0.5;
  problem.values[row_of(Push::kGroundFriction)] = 0.3;
  problem.values[row_of(Push::kFingerFriction)] = 0.2;
  problem.fitness.kind = FitnessKind::kCornerDistance;
  problem.pieces = {
      {"square", {{-0.06, -0.06}, {0.06, -0.06}, {0.06, 0.06}, {-0.06, 0.06}}, 0.01, 0.15, 1},
      {"triangle", {{0, 0}, {0.15, 0}, {0, 0.15}}, 0.012, 0.2, 1}};
  for (const Piece& piece : problem.pieces) problem.commands.push_back({piece.name, 0, 0, 0});
  for (int i = 0; i < 8; ++i) {
    Trial trial;
    trial.session = "s1";
    trial.trial = i;
    trial.command = problem.pieces[i % 2].name;
    const Pose X_WP{0.3 + 0.02 * i, 0.2, 0.4 * i};
    const Eigen::Vector2d middle = centroid(problem.pieces[i % 2]);
    trial.X_WS = X_WP * Pose{-middle[0], -middle[1], 0};
    trial.X_WE = X_WP * Pose{0.01, 0.02, 0.3};
    const Pose begin = X_WP * Pose{0.02 - 0.01 * i, -0.12, 0};
    const Pose end = X_WP * Pose{0.02 - 0.01 * i, -0.03, 0};
    trial.tip = {{0, begin.x, begin.y}, {0.9, end.x, end.y}};
    problem.log.trials.push_back(trial);
  }
  return problem;
}

inline double& push_value(Problem& problem, const std::string& key) {
  return problem.values[push_table().row(key)];
}

// What the worker answers to a prediction of all trials.
inline v1::TaskResult predicted(const Problem& problem, bool means_only = true) {
  const auto prepared = prepare(to_proto(problem));
  v1::Task task;
  task.mutable_predict()->set_means_only(means_only);
  return evaluate(prepared.value().get(), task);
}

inline Pose end_of(const v1::TaskResult& result, int trial) {
  return from_proto(result.predict().predictions(trial).end());
}

}  // namespace gapfarm::tests
