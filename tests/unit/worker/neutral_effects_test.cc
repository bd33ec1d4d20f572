// At its neutral value an effect does nothing, to the bit; near it, nearly nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/unit/worker/effect_util.h"
#include "worker/evaluate.h"

namespace gapfarm::neutral_effects_test {

TEST(Settings, AtNominalParametersAreTheRobotsOwn) {
  const ParameterValues nominal = srv1_table().nominal();
  const RobotSize& size = srv1_robot().size();
  const SimSettings own = sim_settings(size, nominal, ActiveEffects(srv1_table(), nominal));
  SimSettings expected;
  expected.size = size;
  expected.mass_kg = 0.35;
  expected.contact_length_m = 0.07;
  expected.track_gauge_m = 0.085;
  expected.friction = 0.6;
  expected.mass_height_m = 0.03;
  EXPECT_EQ(own, expected);
}

using tests::small_problem;

std::string answer(const Problem& problem, const v1::Task& task) {
  const auto prepared = prepare(to_proto(problem));
  EXPECT_TRUE(prepared.ok()) << (prepared.ok() ? "" : prepared.error().message);
  const v1::TaskResult result = evaluate(prepared->get(), task);
  EXPECT_EQ(result.outcome(), v1::OK) << result.message();
  return result.SerializeAsString();
}

v1::Task predict() {
  v1::Task task;
  task.mutable_predict();
  return task;
}

// A session with noise, paths, a reversal and an unrecorded move in it.
v1::Task simulate(const Problem& problem) {
  v1::Task task;
  task.mutable_simulate()->set_path_interval(0.25);
  for (const Trial& trial : problem.log.trials) {
    v1::PlannedTrial* planned = task.mutable_simulate()->add_plan();
    planned->set_moved(trial.trial % 4 == 0);
    *planned->mutable_trial() = to_proto(trial);
  }
  return task;
}

v1::Task trace(const Problem& problem) {
  v1::Task task;
  v1::Command* command = task.mutable_trace()->mutable_command();
  command->set_left(problem.commands[4].left);
  command->set_right(problem.commands[4].right);
  command->set_duration(0.7);
  task.mutable_trace()->set_interval(0.1);
  return task;
}

// Strengths at neutral; places and directions, which then mean nothing, at a bound or between.
ParameterValues neutral(const Problem& problem, std::size_t e, double place) {
  const ParameterTable& table = problem.table();
  ParameterValues values = problem.values;
  const Effect& effect = table.effects()[e];
  for (std::size_t i = effect.strengths; i < effect.parameters.size(); ++i) {
    const Parameter& p = effect.parameters[i];
    const double value = p.lower + place * (p.upper - p.lower);
    values[table.effect_row(e) + i] = p.choices.empty() ? value : std::round(value);
  }
  return values;
}

TEST(NeutralEffects, ChangeNoBitOfAnyAnswer) {
  const Problem problem = small_problem(6);
  const std::string predicted = answer(problem, predict());
  const std::string simulated = answer(problem, simulate(problem));
  const std::string traced = answer(problem, trace(problem));
  const ParameterTable& table = srv1_table();
  for (std::size_t e = 0; e < table.effects().size(); ++e) {
    for (const double place : {0.0, 0.37, 1.0}) {
      Problem neutralised = problem;
      neutralised.values = neutral(problem, e, place);
      const std::string& name = table.effects()[e].name;
      EXPECT_EQ(answer(neutralised, predict()), predicted) << name << " " << place;
      EXPECT_EQ(answer(neutralised, simulate(problem)), simulated) << name << " " << place;
      EXPECT_EQ(answer(neutralised, trace(problem)), traced) << name << " " << place;
    }
  }
}

// Slip events that never come and slip events that cost nothing are none.
TEST(NeutralEffects, SlipEventsNeedBothTheirStrengths) {
  const Problem problem = small_problem(6);
  const std::string predicted = answer(problem, predict());
  const std::string simulated = answer(problem, simulate(problem));
  for (const char* key : {"slip_events.probability", "slip_events.loss"}) {
    Problem half = problem;
    tests::value(half, key) = 0.5;
    EXPECT_EQ(answer(half, predict()), predicted) << key;
    EXPECT_EQ(answer(half, simulate(problem)), simulated) << key;
  }
}

// A hair's breadth from neutral every mean moves by less than 0.1 mm and 0.1 mrad: predictions have
// no step there, whichever way the effect's trials are simulated.
TEST(NeutralEffects, HaveNoStepNextToThem) {
  const Problem problem = small_problem(12);
  const auto prepared = prepare(to_proto(problem));
  const v1::TaskResult base = evaluate(prepared->get(), predict());
  const ParameterTable& table = srv1_table();
  for (std::size_t e = 0; e < table.effects().size(); ++e) {
    const Effect& effect = table.effects()[e];
    v1::Task task = predict();
    for (std::size_t i = 0; i < effect.parameters.size(); ++i) {
      const Parameter& p = effect.parameters[i];
      v1::Override* to = task.mutable_predict()->mutable_point()->add_overrides();
      to->set_parameter(static_cast<std::uint32_t>(table.effect_row(e) + i));
      // Places in the midst of the trials, patches all over them.
      const double place = p.key == "radius" || p.key == "position" ? p.upper / 2 : 0.9;
      to->set_value(i < effect.strengths ? p.nominal + 1e-7 : p.choices.empty() ? place : 0);
    }
    const v1::TaskResult result = evaluate(prepared->get(), task);
    ASSERT_EQ(result.outcome(), v1::OK) << effect.name << ": " << result.message();
    for (int i = 0; i < 12; ++i) {
      const Eigen::Vector3d d = local_difference(from_proto(base.predict().predictions(i).end()),
                                                 from_proto(result.predict().predictions(i).end()));
      EXPECT_LT(d.cwiseAbs().maxCoeff(), 1e-4) << effect.name << ", trial " << i;
    }
  }
}

}  // namespace gapfarm::neutral_effects_test
