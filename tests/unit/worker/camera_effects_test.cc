// What each camera effect does to the log, and that it does nothing to the robot.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/unit/worker/effect_util.h"
#include "worker/evaluate.h"

namespace gapfarm::camera_effects_test {

using tests::Changes;
using tests::commands;
using tests::driven;
using tests::effects;
using tests::end_of;
using tests::full_speed;
using tests::noiseless;
using tests::random_pose;
using tests::small_problem;
using tests::value;

v1::TaskResult run(const Problem& problem, const v1::Task& task) {
  const auto prepared = prepare(to_proto(problem));
  EXPECT_TRUE(prepared.ok()) << (prepared.ok() ? "" : prepared.error().message);
  v1::TaskResult result = evaluate(prepared->get(), task);
  EXPECT_EQ(result.outcome(), v1::OK) << result.message();
  return result;
}

// A value for each strength of an effect, far from neutral, and for the places.
ParameterValues with_effect(const ParameterTable& table, std::size_t e) {
  ParameterValues values = noiseless();
  const Effect& effect = table.effects()[e];
  for (std::size_t i = 0; i < effect.parameters.size(); ++i) {
    const Parameter& p = effect.parameters[i];
    const double place = p.choices.empty() && i >= effect.strengths ? 0.5 : 0;
    values[table.effect_row(e) + i] =
        i < effect.strengths ? p.nominal + 0.1 * (p.upper - p.nominal) : place;
  }
  return values;
}

TEST(CameraEffects, LeaveTheTrueMotionAlone) {
  const ParameterTable& table = srv1_table();
  Situation situation;
  situation.X_WR = {0.7, 1.2, 0.4};
  for (std::size_t e = 0; e < table.effects().size(); ++e) {
    if (table.effects()[e].stage != EffectStage::kCamera) continue;
    Srv1Robot robot(with_effect(table, e));
    ASSERT_TRUE(robot.effects().any());
    for (const CommandSpec& c : commands()) {
      EXPECT_EQ(robot.run({c.left, c.right, 1}, situation, {}).X_SE,
                end_of({}, {c.left, c.right, 1}))
          << table.effects()[e].name;
    }
  }
}

// What is predicted is the logged view of the true end: from the true start, which the logged one
// gives back, by the motion, through the camera.
TEST(CameraEffects, PredictionsDriveTheTrueRobotAndLogItsEnd) {
  const ParameterTable& table = srv1_table();
  for (std::size_t e = 0; e < table.effects().size(); ++e) {
    if (table.effects()[e].stage != EffectStage::kCamera) continue;
    Problem problem = small_problem(12);
    problem.values = with_effect(table, e);
    v1::Task task;
    task.mutable_predict()->set_means_only(true);
    const v1::TaskResult result = run(problem, task);
    Srv1Robot robot(problem.values);
    for (const v1::Predicted& p : result.predict().predictions()) {
      const Trial& trial = problem.log.trials[p.trial()];
      const Pose X_WR = robot.effects().recover(trial.X_WS);
      const Pose true_end = X_WR * end_of({}, driven(trial.command));
      EXPECT_LT(local_difference(robot.effects().observe(true_end), from_proto(p.end())).norm(),
                1e-9)
          << table.effects()[e].name;
    }
  }
}

TEST(CameraEffects, RecoverUndoesObserve) {
  const ActiveEffects all = effects({{"camera_aspect.ratio", 0.9},
                                     {"camera_distortion.k1", 0.04},
                                     {"camera_distortion.x", 1},
                                     {"camera_distortion.y", 0.8},
                                     {"heading_offset.angle", 0.07},
                                     {"marker_offset.x", 0.006},
                                     {"marker_offset.y", -0.004}});
  Stream stream({1, Purpose::kTest, 0, 0, 0});
  for (int i = 0; i < 100; ++i) {
    const Pose X = random_pose(stream);
    EXPECT_LT(local_difference(X, all.recover(all.observe(X))).norm(), 1e-9);
  }
}

// Every value that the table allows gives a finite pose back, also where a lens sees nothing.
TEST(CameraEffects, RecoverIsFiniteInTheCornersOfTheTable) {
  for (const char* name :
       {"camera_aspect", "camera_distortion", "camera_seam", "heading_offset", "marker_offset"}) {
    const ParameterTable& table = srv1_table();
    const auto at = std::find_if(table.effects().begin(), table.effects().end(),
                                 [&](const Effect& effect) { return effect.name == name; });
    const std::size_t first = table.effect_row(at - table.effects().begin());
    for (unsigned corner = 0; corner < 1u << at->parameters.size(); ++corner) {
      ParameterValues values = table.nominal();
      for (std::size_t i = 0; i < at->parameters.size(); ++i) {
        values[first + i] = corner >> i & 1 ? table[first + i].upper : table[first + i].lower;
      }
      const ActiveEffects all(table, values);
      for (const Pose& X : {Pose{0.1, 0.2, 1}, Pose{2, 1.5, -3}, Pose{0, 0, 0}}) {
        const Pose back = all.recover(X);
        EXPECT_TRUE(std::isfinite(back.x) && std::isfinite(back.y)) << name << " " << corner;
        // A barrel's circle of sight is small in its corners; elsewhere the way back is exact.
        const bool folds = std::string(name) == "camera_distortion" && values[first] < 0;
        const bool seam = std::string(name) == "camera_seam";
        if (!folds && !seam) {
          EXPECT_LT(local_difference(X, all.observe(back)).norm(), 1e-9) << name << " " << corner;
        }
      }
    }
  }
}

TEST(EffectSignature, CameraAspectScalesDisplacementsAlongTheAxes) {
  const ActiveEffects wide = effects({{"camera_aspect.ratio", 1.21}});
  Stream stream({2, Purpose::kTest, 0, 0, 0});
  for (int i = 0; i < 20; ++i) {
    const Pose a = random_pose(stream), b = random_pose(stream);
    const Pose seen_a = wide.observe(a), seen_b = wide.observe(b);
    EXPECT_NEAR(seen_b.x - seen_a.x, (b.x - a.x) / 1.1, 1e-12);
    EXPECT_NEAR(seen_b.y - seen_a.y, (b.y - a.y) * 1.1, 1e-12);
    EXPECT_EQ(seen_a.theta, a.theta);
  }
}

TEST(EffectSignature, CameraDistortionMovesPointsAlongRadiiAboutItsCentre) {
  for (const double k1 : {0.1, -0.1}) {
    const ActiveEffects lens = effects(
        {{"camera_distortion.k1", k1}, {"camera_distortion.x", 1}, {"camera_distortion.y", 0.5}});
    EXPECT_EQ(lens.observe({1, 0.5, 2}), (Pose{1, 0.5, 2}));
    for (double angle = 0; angle < 6; angle += 0.7) {
      constexpr double r = 0.8;
      const Pose X{1 + r * std::cos(angle), 0.5 + r * std::sin(angle), 0.3};
      const Pose seen = lens.observe(X);
      EXPECT_NEAR(std::hypot(seen.x - 1, seen.y - 0.5), r * (1 + k1 * r * r), 1e-12);
      EXPECT_NEAR(std::atan2(seen.y - 0.5, seen.x - 1), std::atan2(X.y - 0.5, X.x - 1), 1e-12);
      EXPECT_EQ(seen.theta, X.theta);
      EXPECT_LT(local_difference(X, lens.recover(seen)).norm(), 1e-12);
    }
  }
}

// A barrel that folds at r = 1: what is logged outside of its image lies on the fold.
TEST(EffectSignature, CameraDistortionRecoversTheFoldForWhatALensCannotSee) {
  const ActiveEffects lens = effects({{"camera_distortion.k1", -1.0 / 3}});
  const Pose back = lens.recover({0.9, 0, 0.2});
  EXPECT_NEAR(back.x, 1, 1e-12);
  EXPECT_EQ(back.theta, 0.2);
}

// Beyond the line poses shift by offset + slope * place along it; before it nothing happens.
TEST(EffectSignature, CameraSeamShiftsTheFarSideOnly) {
  for (const bool along_y : {true, false}) {
    const ActiveEffects seam = effects({{"camera_seam.offset_x", 0.02},
                                        {"camera_seam.slope_y", 0.05},
                                        {"camera_seam.position", 1},
                                        {"camera_seam.axis", along_y ? 0 : 1}});
    const Pose near = along_y ? Pose{0.9, 0.5, 0.1} : Pose{0.5, 0.9, 0.1};
    const Pose far = along_y ? Pose{1.2, 0.5, 0.1} : Pose{0.5, 1.2, 0.1};
    EXPECT_EQ(seam.observe(near), near);
    const Pose seen = seam.observe(far);
    EXPECT_NEAR(seen.x, far.x + 0.02, 1e-12);
    EXPECT_NEAR(seen.y, far.y + 0.05 * 0.5, 1e-12);
    EXPECT_EQ(seen.theta, far.theta);
    const Pose back = seam.recover(seen);
    EXPECT_NEAR(back.x, far.x, along_y ? 1e-4 : 2e-3);
    EXPECT_NEAR(back.y, far.y, along_y ? 1e-4 : 2e-3);
  }
}

// Seen from the logged start, every drive is turned back by the angle; headings change as before.
TEST(EffectSignature, HeadingOffsetTurnsDisplacementsSeenFromTheStart) {
  const ActiveEffects turned = effects({{"heading_offset.angle", 0.1}});
  const Pose X_WS{0.6, 1.1, 3.1};
  for (const CommandSpec& c : commands()) {
    const Pose X_SE = end_of({}, {c.left, c.right, 1});
    const Pose seen = between(turned.observe(X_WS), turned.observe(X_WS * X_SE));
    EXPECT_NEAR(seen.x, std::cos(0.1) * X_SE.x + std::sin(0.1) * X_SE.y, 1e-12) << c.name;
    EXPECT_NEAR(seen.y, std::cos(0.1) * X_SE.y - std::sin(0.1) * X_SE.x, 1e-12) << c.name;
    EXPECT_NEAR(wrap_angle(seen.theta - X_SE.theta), 0, 1e-12) << c.name;
  }
}

// Turning in place by a moves the log by (R(a) - I) (x, y); driving straight shows nothing.
TEST(EffectSignature, MarkerOffsetCirclesTheTurningCentre) {
  const ActiveEffects ahead = effects({{"marker_offset.x", 0.01}, {"marker_offset.y", 0.002}});
  const Pose before = ahead.observe({1, 1, 0});
  const Pose after = ahead.observe({1, 1, 1.5});
  const double c = std::cos(1.5), s = std::sin(1.5);
  EXPECT_NEAR(after.x - before.x, 0.01 * (c - 1) - 0.002 * s, 1e-12);
  EXPECT_NEAR(after.y - before.y, 0.01 * s + 0.002 * (c - 1), 1e-12);
  const Pose straight = ahead.observe({1.3, 1, 0});
  EXPECT_NEAR(straight.x - before.x, 0.3, 1e-12);
  EXPECT_NEAR(straight.y - before.y, 0, 1e-12);
}

v1::Task drives(int count, double path_interval = 0) {
  v1::Task task;
  task.mutable_simulate()->set_path_interval(path_interval);
  for (int i = 0; i < count; ++i) {
    v1::PlannedTrial* planned = task.mutable_simulate()->add_plan();
    planned->set_moved(i == 0);
    planned->mutable_trial()->set_session("s");
    planned->mutable_trial()->set_trial(i);
    planned->mutable_trial()->set_command(i % 2 == 0 ? "forward" : "backward");
    planned->mutable_trial()->mutable_start();
  }
  return task;
}

// A stale end pose lies short of the end by what was driven in its last moments; the robot itself
// drove on, so the next start shows the rest of the way.
TEST(EffectSignature, PoseLatencyReadsItsShareOfEndsTooEarly) {
  constexpr double kAge_s = 0.3, kShare = 0.25;
  constexpr int n = 400;
  Problem problem = small_problem(0);
  problem.values = noiseless({{"pose_latency.share", kShare}, {"pose_latency.latency", kAge_s}});
  const v1::TaskResult result = run(problem, drives(n));
  Srv1Robot robot(noiseless());
  std::vector<MotionSample> path;
  const Motion motion = robot.run(driven("forward"), {}, {}, &path, 0.01);
  double early = path.front().X_SB.x;
  for (const MotionSample& s : path) {
    if (s.t_s <= motion.duration_s - kAge_s) early = s.X_SB.x;
  }
  int stale = 0;
  for (int i = 0; i + 1 < n; ++i) {
    const v1::Trial& trial = result.simulate().trials(i);
    const double driven_m = std::abs(trial.end().x() - trial.start().x());
    const bool is_stale = driven_m < motion.X_SE.x - 0.01;
    stale += is_stale;
    EXPECT_NEAR(driven_m, is_stale ? early : motion.X_SE.x, is_stale ? 4e-3 : 1e-3);
    const double rest = result.simulate().trials(i + 1).start().x() - trial.start().x();
    EXPECT_NEAR(std::abs(rest), motion.X_SE.x, 1e-3);
  }
  EXPECT_NEAR(stale, n * kShare, 4 * std::sqrt(n * kShare * (1 - kShare)));
}

TEST(EffectSignature, PoseLatencyIsPredictedAsAMixture) {
  Problem problem = small_problem(6);
  problem.values = noiseless({{"pose_latency.share", 0.25}, {"pose_latency.latency", 0.3}});
  v1::Task task;
  task.mutable_predict();
  const v1::TaskResult with = run(problem, task);
  problem.values = noiseless();
  const v1::TaskResult without = run(problem, task);
  Srv1Robot robot(problem.values);
  for (int i = 0; i < 6; ++i) {
    const DrivenCommand drive = driven(problem.log.trials[i].command);
    std::vector<MotionSample> path;
    const Motion motion = robot.run(drive, {}, {}, &path, 0.02);
    const Eigen::Vector3d back = local_difference(motion.X_SE, pose_before_end(path, 0.3));
    const Eigen::Vector3d moved =
        local_difference(from_proto(without.predict().predictions(i).end()),
                         from_proto(with.predict().predictions(i).end()));
    EXPECT_LT((moved - 0.25 * back).norm(), 1e-6) << problem.log.trials[i].command;
  }
}

// The heading of a start that a hand still holds is off by up to the angle, all angles alike; its
// place is not, and neither is any start that follows a drive.
TEST(EffectSignature, UnsettledStartTurnsItsShareOfStartsAfterMoves) {
  constexpr double kAngle = 0.4, kShare = 0.3;
  constexpr int n = 800;
  Problem problem = small_problem(0);
  problem.values =
      noiseless({{"unsettled_start.share", kShare}, {"unsettled_start.angle", kAngle}});
  v1::Task task = drives(n);
  for (int i = 0; i < n; i += 2) task.mutable_simulate()->mutable_plan(i)->set_moved(true);
  const v1::TaskResult result = run(problem, task);
  int turned = 0;
  double squares = 0;
  for (int i = 0; i < n; ++i) {
    const v1::Trial& trial = result.simulate().trials(i);
    const Pose before = i % 2 == 0 ? Pose{} : from_proto(result.simulate().trials(i - 1).end());
    const Eigen::Vector3d off = local_difference(before, from_proto(trial.start()));
    EXPECT_LT(off.head<2>().norm(), 1e-3);
    if (std::abs(off[2]) < 1e-3) continue;
    EXPECT_EQ(i % 2, 0);
    EXPECT_LT(std::abs(off[2]), kAngle + 1e-3);
    squares += off[2] * off[2];
    ++turned;
  }
  EXPECT_NEAR(turned, n / 2 * kShare, 4 * std::sqrt(n / 2 * kShare * (1 - kShare)));
  EXPECT_NEAR(squares / turned, kAngle * kAngle / 3, 0.3 * kAngle * kAngle / 3);
}

// As a mixture about the same mean: trials after moves are spread as that law spreads them.
TEST(EffectSignature, UnsettledStartIsForeseenAfterMovesAlone) {
  constexpr double kAngle = 0.4, kShare = 0.3;
  Problem problem = small_problem(12);
  problem.values =
      noiseless({{"unsettled_start.share", kShare}, {"unsettled_start.angle", kAngle}});
  for (std::size_t i = 1; i < problem.log.trials.size(); ++i) {
    // Every second one goes on from where the last one ended.
    if (i % 2 == 1) problem.log.trials[i].X_WS = problem.log.trials[i - 1].X_WE;
  }
  for (Trial& trial : problem.log.trials) trial.session = "s", trial.command = "forward";
  v1::Task task;
  task.mutable_predict();
  const v1::TaskResult result = run(problem, task);
  for (const v1::Predicted& p : result.predict().predictions()) {
    const double heading_variance = p.cov(5);
    const double expected = p.trial() % 2 == 0 ? kShare * kAngle * kAngle / 3 : 0;
    EXPECT_NEAR(heading_variance, expected, 0.05 * kAngle * kAngle / 3) << p.trial();
  }
}

TEST(EffectSignature, PoseQuantisationRoundsPositionsAndLeavesHeadings) {
  constexpr double kStep = 0.01;
  Problem problem = small_problem(0);
  problem.values = noiseless();
  const v1::TaskResult fine = run(problem, drives(20, 0.1));
  problem.values = noiseless({{"pose_quantisation.step", kStep}});
  const v1::TaskResult coarse = run(problem, drives(20, 0.1));
  const auto check = [&](const v1::Pose& on_grid, const v1::Pose& free) {
    EXPECT_NEAR(std::remainder(on_grid.x(), kStep), 0, 1e-12);
    EXPECT_NEAR(std::remainder(on_grid.y(), kStep), 0, 1e-12);
    EXPECT_LE(std::abs(on_grid.x() - free.x()), kStep / 2 + 1e-12);
    EXPECT_LE(std::abs(on_grid.y() - free.y()), kStep / 2 + 1e-12);
    EXPECT_EQ(on_grid.theta(), free.theta());
  };
  for (int i = 0; i < 20; ++i) {
    const v1::Trial& a = coarse.simulate().trials(i);
    const v1::Trial& b = fine.simulate().trials(i);
    check(a.end(), b.end());
    check(a.start(), b.start());
    for (int k = 0; k < a.path_size(); ++k) check(a.path(k).pose(), b.path(k).pose());
  }
}

// The variance of a uniform error, of both readings of each axis.
TEST(EffectSignature, PoseQuantisationAddsTheVarianceOfRounding) {
  constexpr double kStep = 0.01;
  Problem problem = small_problem(6);
  problem.values = noiseless();
  v1::Task task;
  task.mutable_predict();
  const v1::TaskResult fine = run(problem, task);
  value(problem, "pose_quantisation.step") = kStep;
  const v1::TaskResult coarse = run(problem, task);
  for (int i = 0; i < 6; ++i) {
    for (const int k : {0, 3}) {  // xx and yy
      EXPECT_NEAR(coarse.predict().predictions(i).cov(k) - fine.predict().predictions(i).cov(k),
                  2 * kStep * kStep / 12, 1e-12);
    }
    EXPECT_EQ(coarse.predict().predictions(i).end().x(), fine.predict().predictions(i).end().x());
  }
}

}  // namespace gapfarm::camera_effects_test
