// Scenario push through the worker's front door.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/worker/push_problem.h"

namespace gapfarm::push_scenario_test {

using tests::end_of;
using tests::predicted;
using tests::push_problem;
using tests::push_value;

TEST(PushScenario, MovesEveryPieceSomewhere) {
  const Problem problem = push_problem();
  const v1::TaskResult result = predicted(problem);
  ASSERT_EQ(result.outcome(), v1::OK) << result.message();
  for (int i = 0; i < result.predict().predictions_size(); ++i) {
    const Trial& trial = problem.log.trials[static_cast<std::size_t>(i)];
    EXPECT_GT(corner_distance(problem.piece(trial.command), trial.X_WS, end_of(result, i)), 0.005)
        << i;
  }
}

// To the bit, whatever its other parameters say.
TEST(PushEffects, NeutralEffectsChangeNothing) {
  const std::string plain = predicted(push_problem(), false).SerializeAsString();
  const ParameterTable& table = push_table();
  for (std::size_t e = 0; e < table.effects().size(); ++e) {
    const Effect& effect = table.effects()[e];
    Problem problem = push_problem();
    for (std::size_t i = effect.strengths; i < effect.parameters.size(); ++i) {
      problem.values[table.effect_row(e) + i] = effect.parameters[i].upper;
    }
    EXPECT_EQ(predicted(problem, false).SerializeAsString(), plain) << effect.name;
  }
}

TEST(PushEffects, EveryEffectMovesSomeEnd) {
  const v1::TaskResult plain = predicted(push_problem());
  const ParameterTable& table = push_table();
  for (std::size_t e = 0; e < table.effects().size(); ++e) {
    const Effect& effect = table.effects()[e];
    Problem problem = push_problem();
    const Parameter& strength = effect.parameters.front();
    problem.values[table.effect_row(e)] =
        strength.nominal + 0.3 * (strength.upper - strength.nominal);
    if (effect.name == "friction_patch") {
      push_value(problem, "friction_patch.x") = 0.35;
      push_value(problem, "friction_patch.y") = 0.2;
    }
    if (effect.name == "table_tilt") push_value(problem, "table_tilt.angle") = 0.05;
    const v1::TaskResult result = predicted(problem);
    ASSERT_EQ(result.outcome(), v1::OK) << effect.name << " " << result.message();
    double greatest = 0;
    for (int i = 0; i < result.predict().predictions_size(); ++i) {
      const Pose d = between(end_of(plain, i), end_of(result, i));
      greatest = std::max(greatest, std::hypot(d.x, d.y, 0.1 * d.theta));
    }
    EXPECT_GT(greatest, 1e-5) << effect.name;
  }
}

// A log whose starts say b too little is predicted as the true one is.
TEST(PushEffects, PlacementBiasMovesTheStartOnly) {
  const Problem problem = push_problem();
  Problem biased = problem;
  push_value(biased, "placement_bias.x") = 0.004;
  push_value(biased, "placement_bias.y") = -0.003;
  push_value(biased, "placement_bias.angle") = 0.05;
  for (Trial& trial : biased.log.trials) {
    trial.X_WS.x -= 0.004;
    trial.X_WS.y += 0.003;
    trial.X_WS.theta = wrap_angle(trial.X_WS.theta - 0.05);
  }
  const v1::TaskResult plain = predicted(problem);
  const v1::TaskResult result = predicted(biased);
  for (int i = 0; i < 8; ++i) {
    EXPECT_NEAR(end_of(result, i).x, end_of(plain, i).x, 1e-6);
    EXPECT_NEAR(end_of(result, i).y, end_of(plain, i).y, 1e-6);
    EXPECT_NEAR(end_of(result, i).theta, end_of(plain, i).theta, 1e-5);
  }
}

// A marker beside the frame is at X * offset before and after; a camera that stretches does so to
// both readings.
TEST(PushEffects, CameraEffectsActOnBothReadings) {
  const Problem problem = push_problem();
  const v1::TaskResult plain = predicted(problem);
  Problem marked = problem;
  push_value(marked, "marker_offset.x") = 0.01;
  push_value(marked, "camera_aspect.ratio") = 1.21;
  const auto seen = [](const Pose& X) {
    const Pose marker = X * Pose{0.01, 0, 0};
    return Pose{marker.x / 1.1, marker.y * 1.1, marker.theta};
  };
  for (Trial& trial : marked.log.trials) trial.X_WS = seen(trial.X_WS);
  const v1::TaskResult result = predicted(marked);
  for (int i = 0; i < 8; ++i) {
    EXPECT_NEAR(end_of(result, i).x, seen(end_of(plain, i)).x, 1e-6);
    EXPECT_NEAR(end_of(result, i).y, seen(end_of(plain, i)).y, 1e-6);
  }
}

// Pieces and finger are logged in two frames that lie beside one another.
TEST(PushEffects, FrameOffsetMovesBothReadingsAndNotTheFinger) {
  const Problem problem = push_problem();
  const v1::TaskResult plain = predicted(problem);
  Problem beside = problem;
  push_value(beside, "frame_offset.x") = 0.003;
  push_value(beside, "frame_offset.y") = -0.002;
  for (Trial& trial : beside.log.trials) {
    trial.X_WS.x += 0.003;
    trial.X_WS.y -= 0.002;
  }
  const v1::TaskResult result = predicted(beside);
  for (int i = 0; i < 8; ++i) {
    EXPECT_NEAR(end_of(result, i).x, end_of(plain, i).x + 0.003, 1e-6);
    EXPECT_NEAR(end_of(result, i).y, end_of(plain, i).y - 0.002, 1e-6);
  }
}

// A camera whose scale is not the finger's.
TEST(PushEffects, PoseScaleStretchesBothReadingsAndNotTheFinger) {
  const Problem problem = push_problem();
  const v1::TaskResult plain = predicted(problem);
  Problem stretched = problem;
  push_value(stretched, "pose_scale.ratio") = 1.06;
  for (Trial& trial : stretched.log.trials) {
    trial.X_WS.x *= 1.06;
    trial.X_WS.y *= 1.06;
  }
  const v1::TaskResult result = predicted(stretched);
  for (int i = 0; i < 8; ++i) {
    EXPECT_NEAR(end_of(result, i).x, 1.06 * end_of(plain, i).x, 1e-6);
    EXPECT_NEAR(end_of(result, i).y, 1.06 * end_of(plain, i).y, 1e-6);
    EXPECT_NEAR(end_of(result, i).theta, end_of(plain, i).theta, 1e-6);
  }
}

// What influence and stability look at: without noise a trace ends where a prediction does, with
// it beside, and equal streams give equal traces.
TEST(PushScenario, TracesThePushOfATrial) {
  const Problem problem = push_problem();
  const auto prepared = prepare(to_proto(problem));
  const v1::TaskResult plain = predicted(problem);
  v1::Task task;
  v1::TraceTask* trace = task.mutable_trace();
  trace->set_interval(0.05);
  for (std::uint32_t i = 0; i < problem.log.trials.size(); ++i) {
    trace->set_trial(i);
    trace->mutable_command()->set_name(problem.log.trials[i].command);
    trace->set_noisy(false);
    const v1::TaskResult result = evaluate(prepared->get(), task);
    ASSERT_EQ(result.outcome(), v1::OK) << result.message();
    const auto& samples = result.trace().samples();
    ASSERT_GT(samples.size(), 10);
    const Pose from = between(problem.log.trials[i].X_WS, from_proto(samples.begin()->pose()));
    const Pose to =
        between(end_of(plain, static_cast<int>(i)), from_proto(samples.rbegin()->pose()));
    EXPECT_LT(std::hypot(from.x, from.y, from.theta), 1e-9);
    EXPECT_LT(std::hypot(to.x, to.y, to.theta), 1e-9);
    trace->set_noisy(true);
    const v1::TaskResult noisy = evaluate(prepared->get(), task);
    EXPECT_EQ(noisy.SerializeAsString(), evaluate(prepared->get(), task).SerializeAsString());
    const Pose beside =
        between(problem.log.trials[i].X_WS, from_proto(noisy.trace().samples().begin()->pose()));
    EXPECT_GT(std::hypot(beside.x, beside.y), 0);
    EXPECT_LT(std::hypot(beside.x, beside.y), 0.006);  // six standard deviations
  }
  trace->set_trial(8);
  EXPECT_EQ(evaluate(prepared->get(), task).outcome(), v1::INVALID_REQUEST);
}

// Pushes and tables turned together end turned.
TEST(PushScenario, TurningTheWorldTurnsTheEnds) {
  Problem problem = push_problem();
  push_value(problem, "friction_anisotropy.ratio") = 1.5;
  push_value(problem, "friction_anisotropy.direction") = 0.2;
  push_value(problem, "table_tilt.angle") = 0.04;
  Problem turned = problem;
  const Pose turn{0.5, -0.3, 0.7};
  push_value(turned, "friction_anisotropy.direction") += 0.7;
  push_value(turned, "table_tilt.direction") += 0.7;
  for (Trial& trial : turned.log.trials) {
    trial.X_WS = turn * trial.X_WS;
    for (TipSample& s : trial.tip) {
      const Pose p = turn * Pose{s.x, s.y, 0};
      s.x = p.x;
      s.y = p.y;
    }
  }
  const v1::TaskResult a = predicted(problem);
  const v1::TaskResult b = predicted(turned);
  for (int i = 0; i < 8; ++i) {
    const Pose d = between(turn * end_of(a, i), end_of(b, i));
    EXPECT_NEAR(std::hypot(d.x, d.y), 0, 1e-4) << i;
    EXPECT_NEAR(d.theta, 0, 1e-3) << i;
  }
}

TEST(PushScenario, APieceWithAShapeFactorOfItsOwnUsesIt) {
  Problem problem = push_problem();
  const v1::TaskResult shared = predicted(problem);
  push_value(problem, "shape_factor_2") = 0.9;
  const v1::TaskResult own = predicted(problem);
  EXPECT_EQ(end_of(own, 0), end_of(shared, 0));
  EXPECT_NE(end_of(own, 1), end_of(shared, 1));
}

// A derivative moves some pushes and not the others: those that a worker remembers are what it
// would simulate, to the bit.
TEST(PushScenario, RemembersWhatItWouldSimulate) {
  Problem problem = push_problem();
  problem.values[row_of(Push::kModel)] = 2;
  const auto worker = prepare(to_proto(problem));
  ASSERT_TRUE(worker.ok());
  for (const char* moved : {"step_rate", "pressure_1", "pressure_2", "ground_friction",
                            "friction_patch.ratio", "placement_bias.x", "camera_scale"}) {
    const std::size_t row = push_table().row(moved);
    v1::Task task;
    task.mutable_predict()->set_means_only(true);
    v1::Override* there = task.mutable_predict()->mutable_point()->add_overrides();
    there->set_parameter(static_cast<std::uint32_t>(row));
    there->set_value(problem.values[row] * 1.1 + (problem.values[row] == 0 ? 0.3 : 0));
    const auto fresh = prepare(to_proto(problem));
    EXPECT_EQ(evaluate(worker->get(), task).SerializeAsString(),
              evaluate(fresh->get(), task).SerializeAsString())
        << moved;
  }
}

TEST(PushScenario, FitnessIsTheMeanCornerDistance) {
  const Problem problem = push_problem();
  const v1::TaskResult ends = predicted(problem);
  double sum = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    const Trial& trial = problem.log.trials[i];
    sum += corner_distance(problem.piece(trial.command), end_of(ends, static_cast<int>(i)),
                           trial.X_WE);
  }
  const auto prepared = prepare(to_proto(problem));
  v1::Task task;
  task.mutable_evaluate();
  const v1::TaskResult result = evaluate(prepared->get(), task);
  EXPECT_NEAR(result.evaluate().fitness(), sum / 8, 1e-12);
}

// What is simulated is what is predicted, within the spread that is predicted.
TEST(PushScenario, SimulatedEndsLieWithinThePredictedSpread) {
  Problem problem = push_problem();
  const auto prepared = prepare(to_proto(problem));
  v1::Task task;
  for (const Trial& trial : problem.log.trials) {
    *task.mutable_simulate()->add_plan()->mutable_trial() = to_proto(trial);
  }
  task.mutable_simulate()->mutable_stream()->set_run_seed(3);
  const v1::TaskResult simulated = evaluate(prepared->get(), task);
  ASSERT_EQ(simulated.outcome(), v1::OK) << simulated.message();
  problem.log.trials.clear();
  for (const v1::Trial& t : simulated.simulate().trials()) {
    problem.log.trials.push_back(from_proto(t));
    EXPECT_EQ(t.tip_size(), 2);
  }
  problem.fitness.kind = FitnessKind::kLogScore;
  const v1::TaskResult result = predicted(problem, false);
  for (int i = 0; i < 8; ++i) {
    const auto& p = result.predict().predictions(i);
    const Eigen::Vector3d r =
        local_difference(end_of(result, i), problem.log.trials[static_cast<std::size_t>(i)].X_WE);
    EXPECT_LT(std::abs(r[0]), 5 * std::sqrt(p.cov(0))) << i;
    EXPECT_LT(std::abs(r[1]), 5 * std::sqrt(p.cov(3))) << i;
    EXPECT_LT(std::abs(r[2]), 5 * std::sqrt(p.cov(5))) << i;
  }
}

TEST(PushScenario, CornersOfTheParameterBoxEndInAnOutcome) {
  const ParameterTable& table = push_table();
  for (const char* key : {"shape_factor", "ground_friction", "finger_friction", "mass_factor",
                          "length_scale", "error_reduction", "contact_softness", "restitution",
                          "finger_height", "contact_margin", "solver_iterations"}) {
    for (const bool upper : {false, true}) {
      Problem problem = push_problem();
      const Parameter& row = table[table.row(key)];
      push_value(problem, key) = upper ? row.upper : row.lower;
      const v1::TaskResult result = predicted(problem);
      EXPECT_NE(result.outcome(), v1::INVALID_REQUEST) << key << " " << result.message();
      if (result.outcome() != v1::OK) continue;
      for (int i = 0; i < 8; ++i) EXPECT_TRUE(std::isfinite(end_of(result, i).x)) << key;
    }
  }
}

TEST(PushScenario, RefusesTrialsWithoutAFinger) {
  Problem problem = push_problem();
  problem.log.trials[3].tip.resize(1);
  const auto prepared = prepare(to_proto(problem));
  ASSERT_FALSE(prepared.ok());
  EXPECT_NE(prepared.error().message.find("s1/3: has 1 samples of the finger's way"),
            std::string::npos)
      << prepared.error().message;
}

TEST(Piece, SymmetricPiecesAreComparedAtThePoseThatLooksAlike) {
  Piece square = push_problem().pieces[0];
  const Pose turned{0, 0, M_PI / 2};
  EXPECT_NEAR(corner_distance(square, {}, turned), 0.12, 1e-12);
  square.symmetry = 4;
  EXPECT_NEAR(corner_distance(square, {}, turned), 0, 1e-12);
  EXPECT_NEAR(nearest_alike(square, {}, {0, 0, 1.5}).theta, M_PI / 2, 1e-12);
}

TEST(Piece, MomentsOfATriangleAreTheClosedForms) {
  const Piece triangle = push_problem().pieces[1];
  EXPECT_NEAR(area(triangle), 0.15 * 0.15 / 2, 1e-15);
  EXPECT_NEAR((centroid(triangle) - Eigen::Vector2d(0.05, 0.05)).norm(), 0, 1e-15);
  const Eigen::Vector3d m = second_moments(triangle);  // over the area: b^2 / 18 and -b h / 36
  EXPECT_NEAR(m[0], 0.15 * 0.15 / 18, 1e-15);
  EXPECT_NEAR(m[1], 0.15 * 0.15 / 18, 1e-15);
  EXPECT_NEAR(m[2], -0.15 * 0.15 / 36, 1e-15);
}

}  // namespace gapfarm::push_scenario_test
