#include "master/experiments/blind_check/cases/sizing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "common/problem/problem.h"
#include "master/experiments/blind_check/blind_check.h"
#include "master/experiments/blind_check/cases/design.h"
#include "tests/unit/blind/worker_farm.h"

namespace gapfarm::sizing_test {

unsigned run_search(StrengthSearch& search,
                    const std::function<std::optional<double>(double)>& size) {
  unsigned steps = 0;
  while (!search.done()) {
    search.tell(size(search.strength()));
    ++steps;
  }
  return steps;
}

TEST(StrengthSearch, HitsTheTargetOnPowerLaws) {
  for (const double target : {1.6, 5.0, 40.0}) {
    for (const double power : {1.0, 2.0, 3.0}) {
      for (const double scale : {1e-3, 0.03, 0.9}) {
        StrengthSearch search(target);
        const auto size = [&](double s) { return 1 + 4 * std::pow(s / scale, power); };
        const unsigned steps = run_search(search, size);
        const double needed = scale * std::pow((target - 1) / 4, 1 / power);
        if (needed > 1.001) {
          EXPECT_FALSE(search.found()) << target << ' ' << power << ' ' << scale;
          continue;
        }
        ASSERT_TRUE(search.found()) << target << ' ' << power << ' ' << scale;
        EXPECT_NEAR((size(search.strength()) - 1) / (target - 1), 1, 0.011);
        EXPECT_LE(steps, 15u);
      }
    }
  }
}

TEST(StrengthSearch, GoesRoundStrengthsThatDoNotSurvive) {
  StrengthSearch search(5);
  run_search(search, [](double s) {
    return s > 0.02 ? std::nullopt : std::optional(1 + 4 * s * s / (0.015 * 0.015));
  });
  ASSERT_TRUE(search.found());
  EXPECT_NEAR(search.strength(), 0.015, 2e-4);
}

TEST(StrengthSearch, CopesWithKinksAndDeadZones) {
  StrengthSearch kink(5);
  run_search(kink, [](double s) { return 1 + (s < 0.4 ? 1e-9 : 50 * (s - 0.4)); });
  ASSERT_TRUE(kink.found());
  EXPECT_NEAR(kink.strength(), 0.48, 2e-3);
  StrengthSearch nothing(5);
  run_search(nothing, [](double) { return 1.0; });
  EXPECT_FALSE(nothing.found());
  StrengthSearch jump(5);  // no strength has this size
  run_search(jump, [](double s) { return s < 0.3 ? 1.0 : 100.0; });
  EXPECT_FALSE(jump.found());
}

v1::Predicted predicted(double x, double theta, const std::array<double, 3>& variances) {
  v1::Predicted p;
  p.mutable_end()->set_x(x);
  p.mutable_end()->set_theta(theta);
  const double cov[] = {variances[0], 0, 0, variances[1], 0, variances[2]};
  for (const double c : cov) p.add_cov(c);
  return p;
}

TEST(SizeOf, IsTheMahalanobisShift) {
  v1::PredictResult base, same, shifted, wide;
  for (int i = 0; i < 4; ++i) {
    *base.add_predictions() = predicted(0, 0.5, {4e-6, 4e-6, 1e-4});
    *same.add_predictions() = predicted(0, 0.5, {4e-6, 4e-6, 1e-4});
    // 2 standard deviations of heading in half of the trials.
    *shifted.add_predictions() = predicted(0, i % 2 ? 0.52 : 0.5, {4e-6, 4e-6, 1e-4});
    *wide.add_predictions() = predicted(0, 0.5, {8e-6, 8e-6, 2e-4});
  }
  EXPECT_DOUBLE_EQ(*size_of(base, same, false), 1);
  EXPECT_NEAR(*size_of(base, same, true), 1, 1e-12);
  EXPECT_NEAR(*size_of(base, shifted, false), 1 + 0.5 * 4 / 3, 1e-9);
  EXPECT_NEAR(*size_of(base, shifted, true), 1 + 0.5 * 4 / 3, 1e-9);
  EXPECT_NEAR(*size_of(base, wide, false), 1, 1e-12);
  EXPECT_NEAR(*size_of(base, wide, true), 2, 1e-12);
  *base.mutable_predictions(0) = predicted(0, 0, {0, 0, 0});
  EXPECT_FALSE(size_of(base, same, false).has_value());
}

TEST(DrawEffect, IsNeutralAtZeroAndWithinBoundsAtOne) {
  const ParameterTable& table = srv1_table();
  for (std::size_t e = 0; e < table.effects().size(); ++e) {
    Stream stream({7, Purpose::kTest, 0, e, 0});
    for (int repeat = 0; repeat < 20; ++repeat) {
      const EffectDraw draw = draw_effect(table, e, {}, stream);
      for (const double strength : {0.0, 1e-6, 0.3, 1.0}) {
        ParameterValues values = table.nominal();
        const std::vector<double> own = effect_values(table, draw, strength);
        ASSERT_EQ(own.size(), table.effects()[e].parameters.size());
        for (std::size_t i = 0; i < own.size(); ++i) {
          const std::size_t row = table.effect_row(e) + i;
          EXPECT_TRUE(table.check(row, own[i]).ok()) << table[row].key << ' ' << own[i];
          values[row] = own[i];
        }
        EXPECT_EQ(table.is_neutral(e, values), strength == 0) << table.effects()[e].name;
      }
    }
  }
}

TEST(DrawRobot, StaysWithinTheGenes) {
  Problem problem = tests::small_config().problem;
  problem.genes = {{row_of(Srv1::kMass), 0.34, 0.36, ParameterScale::kLinear}};
  Stream stream({1, Purpose::kTest, 0, 0, 0});
  for (int i = 0; i < 50; ++i) {
    const auto robot = draw_robot(problem, stream);
    EXPECT_GE(robot.at("mass"), 0.34);
    EXPECT_LE(robot.at("mass"), 0.36);
    EXPECT_EQ(robot.count("friction"), 0u);  // known, since it is no gene
    EXPECT_EQ(robot.count("pose_noise_position"), 1u);
  }
}

TEST(Design, SizesAreWhatWasAskedForAndShuffled) {
  tests::WorkerFarm farm;
  const Config config = tests::small_config();
  const auto planned = planned_problem(config, {}, 3, farm);
  ASSERT_TRUE(planned.ok());
  DesignSettings settings;
  settings.effects = {"battery_sag", "marker_offset", "slip_events"};
  settings.sizes = {{"clear", 5}, {"subtle", 1.6}};
  settings.nulls = 2;
  settings.pairs = 1;
  settings.excluded = 1;
  settings.seed = 3;
  const auto design = draw_design(*planned, settings, farm);
  ASSERT_TRUE(design.ok()) << design.error().message;
  EXPECT_EQ(design->cases.size() + design->out_of_reach.size(), 10u);
  std::map<CaseKind, int> kinds;
  for (const Truth& truth : design->cases) {
    ++kinds[truth.kind];
    for (const TrueEffect& effect : truth.effects) {
      EXPECT_NEAR(effect.size, truth.level == "subtle" ? 1.6 : 5, 0.05) << effect.name;
    }
    EXPECT_EQ(truth.excluded.empty(), truth.kind != CaseKind::kOutside);
  }
  EXPECT_EQ(kinds[CaseKind::kNull], 2);
  const auto again = draw_design(*planned, settings, farm);
  ASSERT_TRUE(again.ok());
  for (std::size_t i = 0; i < design->cases.size(); ++i) {
    EXPECT_EQ(format_truth(design->cases[i]), format_truth(again->cases[i]));
  }
  settings.effects = {"batery_sag"};
  const auto unknown = draw_design(*planned, settings, farm);
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().message.find("battery_sag"), std::string::npos);
}

// Mean r^T S^-1 r / 3 of the case's log, S of the robot without its effects.
double residual_moment(const Config& config, const Truth& truth, bool with_effects, Farm& farm) {
  Truth base = truth;
  base.effects.clear();
  const auto logs = simulate_cases(config, {with_effects ? truth : base}, {}, 0, farm);
  EXPECT_TRUE(logs.ok());
  Problem problem = config.problem;
  problem.log = logs->front();
  v1::Task task;
  for (const v1::Override& o : overrides_of(problem.table(), base)) {
    *task.mutable_predict()->mutable_point()->add_overrides() = o;
  }
  const auto results = farm.run(farm.add_problem(to_proto(problem)), {task});
  v1::PredictResult measured = results->front().predict();
  for (int i = 0; i < measured.predictions_size(); ++i) {
    *measured.mutable_predictions(i)->mutable_end() =
        to_proto(problem.log.trials[static_cast<std::size_t>(i)].X_WE);
  }
  return *size_of(results->front().predict(), measured, false) - 1;
}

TEST(Design, SizesShowInSimulatedResiduals) {
  tests::WorkerFarm farm;
  Config config = tests::small_config();
  config.simulate.trials_per_session = 200;
  const auto planned = planned_problem(config, {}, 5, farm);
  ASSERT_TRUE(planned.ok());
  DesignSettings settings;
  settings.effects = {"marker_offset", "slip_events", "pose_latency", "pose_quantisation"};
  settings.sizes = {{"clear", 5}};
  settings.nulls = settings.pairs = settings.excluded = 0;
  const auto design = draw_design(*planned, settings, farm);
  ASSERT_TRUE(design.ok());
  EXPECT_EQ(design->cases.size(), 4u);
  for (const Truth& truth : design->cases) {
    const double base = residual_moment(config, truth, false, farm);
    const double with = residual_moment(config, truth, true, farm);
    EXPECT_NEAR(base, 1, 0.15) << truth.effects[0].name;
    // Rare events: some thirty of them carry the moment.
    EXPECT_NEAR((with - base) / 4, 1, 0.4) << truth.effects[0].name;
  }
}

TEST(SizeLevel, TextAndNumbers) {
  EXPECT_EQ(size_level("clear")->size, 5);
  EXPECT_EQ(size_level("subtle")->size, 1.6);
  EXPECT_EQ(size_level("2.5")->size, 2.5);
  EXPECT_FALSE(size_level("1").ok());
  EXPECT_FALSE(size_level("big").ok());
}

}  // namespace gapfarm::sizing_test
