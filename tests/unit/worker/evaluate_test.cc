#include "worker/evaluate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/unit/worker/problems.h"

namespace gapfarm::evaluate_test {

using tests::small_problem;

std::unique_ptr<PreparedProblem> prepared(const Problem& problem) {
  auto p = prepare(to_proto(problem));
  EXPECT_TRUE(p.ok()) << (p.ok() ? "" : p.error().message);
  return std::move(*p);
}

Problem with_genes() {
  Problem problem = small_problem(12);
  for (const char* key : {"friction", "full_speed", "contact_length"}) {
    const std::size_t row = srv1_table().row(key);
    problem.genes.push_back({row, srv1_table()[row].nominal * 0.7, srv1_table()[row].nominal * 1.3,
                             ParameterScale::kLinear});
  }
  return problem;
}

v1::Task evaluate_task(std::initializer_list<double> genome) {
  v1::Task task;
  task.mutable_evaluate();
  for (double g : genome) task.mutable_evaluate()->mutable_point()->add_genome(g);
  return task;
}

// The purity contract: the bytes of an answer do not depend on what was evaluated before.
TEST(Evaluate, IsPureWhateverCameBefore) {
  const Problem problem = with_genes();
  const auto fresh = prepared(problem);
  const std::string first =
      evaluate(fresh.get(), evaluate_task({0.2, 0.5, 0.9})).SerializeAsString();
  const auto used = prepared(problem);
  Stream stream({3, Purpose::kTest, 0, 0, 0});
  for (int i = 0; i < 20; ++i) {
    evaluate(used.get(), evaluate_task({stream.uniform(), stream.uniform(), stream.uniform()}));
  }
  EXPECT_EQ(evaluate(used.get(), evaluate_task({0.2, 0.5, 0.9})).SerializeAsString(), first);
}

TEST(Evaluate, SampledSpreadDependsOnItsStreamAlone) {
  Problem problem = with_genes();
  problem.spread = {SpreadKind::kSampled, 8};
  const auto p = prepared(problem);
  v1::Task task = evaluate_task({0.2, 0.5, 0.9});
  task.mutable_evaluate()->mutable_stream()->set_birth_id(4);
  const double a = evaluate(p.get(), task).evaluate().fitness();
  EXPECT_EQ(evaluate(p.get(), task).evaluate().fitness(), a);
  task.mutable_evaluate()->mutable_stream()->set_replicate(1);
  EXPECT_NE(evaluate(p.get(), task).evaluate().fitness(), a);
}

TEST(Evaluate, MalformedTasksAreAnsweredNotCrashedOn) {
  const auto p = prepared(with_genes());
  EXPECT_EQ(evaluate(p.get(), evaluate_task({0.5})).outcome(), v1::INVALID_REQUEST);
  EXPECT_EQ(evaluate(p.get(), evaluate_task({0.5, 0.5, 1.5})).outcome(), v1::INVALID_REQUEST);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(evaluate(p.get(), evaluate_task({0.5, 0.5, nan})).outcome(), v1::INVALID_REQUEST);
  EXPECT_EQ(evaluate(p.get(), v1::Task()).outcome(), v1::INVALID_REQUEST);
  EXPECT_EQ(evaluate(nullptr, evaluate_task({0.5, 0.5, 0.5})).outcome(), v1::INVALID_REQUEST);

  v1::Task predict;
  predict.mutable_predict()->add_trials(99);
  EXPECT_EQ(evaluate(p.get(), predict).outcome(), v1::INVALID_REQUEST);
  predict.mutable_predict()->clear_trials();
  for (const std::uint32_t headings : {3U, 34U, 4000000000U}) {
    predict.mutable_predict()->set_headings(headings);
    EXPECT_EQ(evaluate(p.get(), predict).outcome(), v1::INVALID_REQUEST) << headings;
  }
  v1::Task override = evaluate_task({});
  auto* o = override.mutable_evaluate()->mutable_point()->add_overrides();
  o->set_parameter(100000);
  EXPECT_EQ(evaluate(p.get(), override).outcome(), v1::INVALID_REQUEST);
  o->set_parameter(static_cast<std::uint32_t>(row_of(Srv1::kMass)));
  o->set_value(-1);
  const v1::TaskResult result = evaluate(p.get(), override);
  EXPECT_EQ(result.outcome(), v1::INVALID_REQUEST);
  EXPECT_NE(result.message().find("mass is -1, but it must be between 0.1 kg and 1.5 kg"),
            std::string::npos)
      << result.message();
}

TEST(Evaluate, PlansAndTracesThatNoMemoryHoldsOrNoNumberNamesAreRefused) {
  const auto p = prepared(with_genes());
  v1::Task trace;
  trace.mutable_trace()->mutable_command()->set_duration(60);
  trace.mutable_trace()->set_interval(1e-12);
  EXPECT_EQ(evaluate(p.get(), trace).outcome(), v1::INVALID_REQUEST);
  v1::Task plan;
  plan.mutable_simulate()->add_plan()->mutable_trial()->set_command("forward");
  EXPECT_EQ(evaluate(p.get(), plan).outcome(), v1::OK);
  for (const double interval : {1e-12, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    plan.mutable_simulate()->set_path_interval(interval);
    EXPECT_EQ(evaluate(p.get(), plan).outcome(), v1::INVALID_REQUEST) << interval;
  }
  plan.mutable_simulate()->set_path_interval(0);
  plan.mutable_simulate()->mutable_plan(0)->mutable_trial()->mutable_start()->set_x(INFINITY);
  EXPECT_EQ(evaluate(p.get(), plan).outcome(), v1::INVALID_REQUEST);
}

TEST(Evaluate, MalformedProblemsAreNamed) {
  v1::Problem message = to_proto(with_genes());
  message.mutable_values()->RemoveLast();
  EXPECT_FALSE(prepare(message).ok());
  message = to_proto(with_genes());
  message.mutable_trials(0)->set_command("foward");
  const auto unknown = prepare(message);
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().message.find("did you mean 'forward'"), std::string::npos);
}

TEST(Evaluate, ProblemsWithoutAScoreAreRefused) {
  const v1::Problem sound = to_proto(with_genes());
  v1::Problem message = sound;
  message.mutable_fitness()->set_outlier_share(1);
  EXPECT_FALSE(prepare(message).ok());
  message = sound;
  message.mutable_fitness()->set_heave_penalty(std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(prepare(message).ok());
  message = sound;
  message.mutable_spread()->set_kind(v1::Spread::SAMPLED);
  for (const unsigned replicates : {0u, 1u, 4000000000u}) {
    message.mutable_spread()->set_replicates(replicates);
    EXPECT_FALSE(prepare(message).ok()) << replicates;
  }
}

TEST(Evaluate, ProblemsSurviveTheWire) {
  const v1::Problem message = to_proto(with_genes());
  const auto back = from_proto(message);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(problem_hash(to_proto(*back)), problem_hash(message));
  v1::Problem other = message;
  other.mutable_trials(3)->mutable_end()->set_x(0.123);
  EXPECT_NE(problem_hash(other), problem_hash(message));
}

TEST(Evaluate, EveryFitnessKindScoresTheNominalRobot) {
  for (FitnessKind kind :
       {FitnessKind::kLogScore, FitnessKind::kEnergyScore, FitnessKind::kRobustMahalanobis}) {
    Problem problem = small_problem(60);
    problem.fitness.kind = kind;
    const v1::TaskResult result = evaluate(prepared(problem).get(), evaluate_task({}));
    EXPECT_EQ(result.outcome(), v1::OK) << fitness_name(kind) << ": " << result.message();
    EXPECT_TRUE(std::isfinite(result.evaluate().fitness()));
  }
}

TEST(Evaluate, NumericClassIsAHash) {
  EXPECT_EQ(numeric_class().size(), 32u);
  EXPECT_EQ(numeric_class(), numeric_class());
}

}  // namespace gapfarm::evaluate_test
