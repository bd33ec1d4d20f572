// Scenario `objective`: what a program declares, is asked and answers, and what becomes of it.
#include "scripts/bridges/objective.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "common/config/config.h"
#include "common/config/model.h"
#include "common/external/simulator.h"
#include "worker/evaluate.h"

namespace gapfarm::objective_test {

using testing::AllOf;
using testing::HasSubstr;

constexpr const char* kParameters =
    R"({"key":"rate","lower":0.001,"upper":1,"nominal":0.1,"log":true},)"
    R"({"key":"n","lower":0,"upper":3,"nominal":2,"integer":true},)"
    R"({"key":"how","choices":["plain","bent"]},)"
    R"({"key":"bend","lower":0,"upper":1,"nominal":0.5,"when":{"how":"bent","n":[1,2]}},)"
    R"({"key":"deep","lower":0,"upper":1,"nominal":0.5,"when":{"n":2}})";

std::string declared(const std::string& parameters) {
  return R"({"gapfarm":1,"name":"mine","parameters":[)" + parameters + "]}";
}

ExternalDeclaration declaration() {
  auto parsed = parse_declaration(declared(kParameters), true);
  EXPECT_TRUE(parsed.ok()) << (parsed ? "" : parsed.error().message);
  return parsed ? *parsed : ExternalDeclaration{};
}

std::string refusal(const std::string& parameters) {
  const auto parsed = parse_declaration(declared(parameters), true);
  EXPECT_FALSE(parsed.ok()) << parameters;
  return parsed ? "" : parsed.error().message;
}

TEST(Objective, HasTheProgramsRowsAlone) {
  const ExternalTable table(declaration());
  ASSERT_EQ(table.table().size(), 5u);
  EXPECT_TRUE(table.table().effects().empty());
  EXPECT_EQ(table.table()[2].kind, ParameterKind::kChoice);
  EXPECT_EQ(table.table().text_of(2, 1), "bent");
}

TEST(Objective, AsksForWhatIsThere) {
  const ExternalDeclaration mine = declaration();
  ExternalRequest request;
  request.id = 7;
  request.declaration = &mine;
  request.seed = 4294967295u;
  request.values = {0.25, 2, 1, 0.75, 0.5};
  EXPECT_EQ(
      request_line(request),
      R"({"id":7,"parameters":{"rate":0.25,"n":2,"how":"bent","bend":0.75,"deep":0.5},"seed":4294967295})");
  request.values[2] = 0;
  EXPECT_THAT(request_line(request), HasSubstr(R"({"rate":0.25,"n":2,"how":"plain","deep":0.5})"));
  request.values[1] = 3;
  EXPECT_THAT(request_line(request), HasSubstr(R"({"rate":0.25,"n":3,"how":"plain"})"));
}

TEST(Objective, RefusesWhatCannotBeSearched) {
  const std::string bend = R"({"key":"b","lower":0,"upper":1,"nominal":0,"when":)";
  const std::string how = R"({"key":"how","choices":["plain","bent"]},)";
  EXPECT_THAT(refusal(R"({"key":"c","choices":["a"]})"), HasSubstr("two or more strings"));
  EXPECT_THAT(refusal(R"({"key":"c","choices":["a","a"]})"), HasSubstr("the choice 'a' twice"));
  EXPECT_THAT(refusal(R"({"key":"c","choices":["a",3]})"), HasSubstr("two or more strings"));
  EXPECT_THAT(refusal(R"({"key":"c","choices":["a","b"],"lower":0})"), HasSubstr("omit one"));
  EXPECT_THAT(refusal(R"({"key":"c","choices":["a","b"],"nominal":"d"})"), HasSubstr("nominal"));
  EXPECT_THAT(refusal(R"({"key":"c","choices":["a","b\n"]})"), HasSubstr("no plain text"));
  EXPECT_THAT(refusal(bend + R"({"how":"bent"}})"),
              HasSubstr("'how', which is not declared before"));
  EXPECT_THAT(refusal(how + bend + R"({"how":"round"}})"), HasSubstr("never \"round\""));
  EXPECT_THAT(refusal(how + bend + R"("bent"})"), HasSubstr("no object"));
  EXPECT_THAT(refusal(R"({"key":"x","lower":0,"upper":1,"nominal":0},)" + bend + R"({"x":1}})"),
              HasSubstr("neither choices nor an integer"));
}

TEST(Objective, RefusesFlagsThatAreNeitherTrueNorFalse) {
  for (const std::string given : {"1", "\"true\"", "null"}) {
    const std::string x = R"({"key":"x","lower":1,"upper":9,"nominal":2,)";
    EXPECT_THAT(refusal(x + "\"integer\":" + given + "}"),
                HasSubstr("'x' with \"integer\": " + given + "; it takes true or false"));
    EXPECT_THAT(refusal(x + "\"log\":" + given + "}"), HasSubstr("it takes true or false"));
  }
}

TEST(Objective, AskedInCppParametersMayBeNamedAsTheQuestionsOwnKeys) {
  const Question hello(hello_line());
  EXPECT_FALSE(hello.asks());
  const Question question(
      R"({"id":7,"parameters":{"id":3,"seed":-2.5,"how":"bent"},"seed":4294967295})");
  EXPECT_TRUE(question.asks());
  EXPECT_EQ(question.id(), 7u);
  EXPECT_EQ(question.seed(), 4294967295u);
  EXPECT_EQ(question.number("id"), 3);
  EXPECT_EQ(question.number("seed"), -2.5);
  EXPECT_EQ(question.choice("how"), "bent");
  EXPECT_FALSE(question.has("parameters"));
}

Result<ExternalAnswer> answered(const std::string& rest) {
  static const ExternalDeclaration mine = declaration();
  ExternalRequest request;
  request.id = 7;
  request.declaration = &mine;
  return parse_answer(R"({"id":7,)" + rest + "}", request);
}

TEST(Objective, TakesAValueAndViolations) {
  EXPECT_EQ(answered(R"("value":-2.5)")->value, -2.5);
  EXPECT_EQ(answered(R"("value":3,"violations":[-1,0],"notes":"fine")")->message, "fine");
  EXPECT_EQ(answered(R"("value":3,"violations":[-1,0])")->violation, 0);
  EXPECT_EQ(answered(R"("value":3,"violations":[0.25,-5,0.5])")->violation, 0.75);
  EXPECT_FALSE(answered(R"("value":null,"violations":[1])")->diverged) << "it need have no value";
  EXPECT_EQ(answered(R"("violations":[1e308,1e308])")->violation,
            std::numeric_limits<double>::max());
}

TEST(Objective, WhatIsNotFiniteIsAFailedEvaluation) {
  const struct {
    const char *answer, *why;
  } kinds[] = {{R"("value":NaN)", "printed NaN"},
               {R"("value":-Infinity)", "printed -Infinity"},
               {R"("value":1,"violations":[NaN])", "printed NaN"},
               {R"("value":null)", "a value of null"},
               {R"("outcome":"failed","message":"no mesh")", "no mesh"},
               {R"("outcome":"diverged","message":"no mesh")", "no mesh"}};
  for (const auto& kind : kinds) {
    const auto answer = answered(kind.answer);
    ASSERT_TRUE(answer.ok()) << kind.answer << answer.error().message;
    EXPECT_TRUE(answer->diverged) << kind.answer;
    EXPECT_THAT(answer->message, HasSubstr(kind.why));
  }
}

TEST(Objective, RefusesOtherAnswers) {
  for (const char* rest :
       {R"("value":"3")", R"("cost":3)", R"("pose":[1,2,3])", R"("value":1,"violations":2)",
        R"("value":1,"violations":["a"])", R"("value":1,"outcome":"lost")"}) {
    EXPECT_FALSE(answered(rest).ok()) << rest;
  }
}

// A program that introduces itself and answers every question with `answer`, which has `$x`.
std::string config_text(const std::string& answer, const std::string& more = "",
                        const std::string& parameters = kParameters) {
  return "scenario = \"objective\"\n[objective]\nprogram = [\"sh\", \"-c\", '''read x; echo '" +
         declared(parameters) + "'; while read x; do " + answer + "; done''']\n" + more;
}

Result<Config> config_of(const std::string& more, const std::string& parameters = kParameters) {
  return parse_config(
      config_text(R"(echo '{"id":1,"value":3,"violations":[0]}')", more, parameters),
      "objective.toml", start_program);
}

TEST(ObjectiveConfig, SearchesEverythingByDefault) {
  const auto all = config_of("direction = \"maximise\"\nnoisy = true\n");
  ASSERT_TRUE(all.ok()) << all.error().message;
  const Problem& problem = all->problem;
  EXPECT_EQ(problem.genes.size(), 5u);
  EXPECT_EQ(problem.genes[0].scale, ParameterScale::kLog);
  EXPECT_TRUE(higher_is_better(problem.fitness.kind));
  EXPECT_EQ(problem.spread.kind, SpreadKind::kSampled);
  const auto some = config_of(
      "[parameters]\nhow = \"bent\"\n[genes]\nrate = [0.01, 0.1]\nn = [1, 2]\n"
      "[[stages]]\ngenes = [\"rate\"]\nevaluations = 9\n[[stages]]\ngenes = [\"n\"]\n");
  ASSERT_TRUE(some.ok()) << some.error().message;
  EXPECT_EQ(some->problem.genes.size(), 2u);
  EXPECT_EQ(some->problem.values[2], 1);
  EXPECT_FALSE(higher_is_better(some->problem.fitness.kind));
}

TEST(ObjectiveConfig, NamesWhatIsWrong) {
  const struct {
    const char *more, *named;
  } kinds[] = {
      {"direction = \"down\"\n", "direction"},
      {"answer_limit = 0\n", "answer_limit"},
      {"[genes]\nrat = [0.1, 1]\n", "did you mean"},
      {"[genes]\nhow = [\"plain\", \"round\"]\n", "unknown how"},
      {"[fitness]\nkind = \"log_score\"\n", "fitness"},
      {"[effects.battery_sag]\nrate = 1\n", "effects"},
      {"[validation]\ntrials = [\"log.csv\"]\n", "validation"},
  };
  for (const auto& kind : kinds) {
    const auto config = config_of(kind.more);
    ASSERT_FALSE(config.ok()) << kind.more;
    EXPECT_THAT(config.error().message, HasSubstr(kind.named)) << kind.more;
  }
  EXPECT_THAT(parse_config("scenario = \"objective\"\n", "o.toml").error().message,
              AllOf(HasSubstr("needs its program"), HasSubstr("[objective]")));
  EXPECT_THAT(
      parse_config("trials = [\"log.csv\"]\n" + config_text("true"), "o.toml", start_program)
          .error()
          .message,
      HasSubstr("scenario objective has no trials"));
  EXPECT_THAT(config_of("", "").error().message, HasSubstr("nothing to search"));
}

constexpr const char* kSeveral = "minimise = [\"loss\"]\nmaximise = [\"speed\"]\n";
constexpr const char* kNsga2 = "[optimiser]\nkind = \"nsga2\"\n";

TEST(ObjectiveConfig, OfSeveralValuesTheFirstIsTheFitness) {
  const auto config = config_of(std::string(kSeveral) + kNsga2);
  ASSERT_TRUE(config.ok()) << config.error().message;
  const FitnessSettings& fitness = config->problem.fitness;
  EXPECT_EQ(fitness.objectives, (std::vector<SearchedObjective>{{"loss", false}, {"speed", true}}));
  EXPECT_FALSE(higher_is_better(fitness.kind));
  const v1::Problem message = to_proto(config->problem);
  EXPECT_EQ(problem_hash(to_proto(*from_proto(message))), problem_hash(message));
  Model model = model_of_problem(config->problem, config->problem.values);
  const auto read = parse_model(format_model(model), "model.toml");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->fitness.objectives, fitness.objectives);
  v1::Problem wrong = message;
  wrong.mutable_fitness()->mutable_objectives()->RemoveLast();
  EXPECT_FALSE(from_proto(wrong).ok()) << "one is none of several";
}

class ObjectiveWorker : public testing::Test {
 protected:
  void SetUp() override { allow_external_programs(true); }
  void TearDown() override { allow_external_programs(false); }

  v1::TaskResult evaluated(const std::string& answer, const std::string& more = "") {
    auto config = parse_config(config_text(answer, more), "objective.toml", start_program);
    EXPECT_TRUE(config.ok()) << (config ? "" : config.error().message);
    const auto prepared = prepare(to_proto(config->problem));
    EXPECT_TRUE(prepared.ok()) << (prepared ? "" : prepared.error().message);
    v1::Task task;
    task.mutable_evaluate();
    return evaluate(prepared->get(), task);
  }
};

TEST_F(ObjectiveWorker, AnswersWithTheValueAsItCame) {
  const v1::TaskResult result = evaluated(R"(echo '{"id":1,"value":0.1}')");
  EXPECT_EQ(result.outcome(), v1::OK) << result.message();
  EXPECT_EQ(result.evaluate().fitness(), 0.1);
  const v1::TaskResult outside = evaluated(R"(echo '{"id":1,"value":0.1,"violations":[2]}')");
  EXPECT_EQ(outside.outcome(), v1::INFEASIBLE);
  EXPECT_EQ(outside.evaluate().penalty(), 2);
  EXPECT_EQ(evaluated(R"(echo '{"id":1,"value":null}')").outcome(), v1::DIVERGED);
  EXPECT_EQ(evaluated("exit 3").outcome(), v1::WORKER_FAILED);
  EXPECT_EQ(evaluated("echo rubbish").outcome(), v1::WORKER_FAILED);
}

// Of a machine that lacks the program, or has another: no values were asked for.
TEST_F(ObjectiveWorker, IsUnfitWithoutTheProgram) {
  auto config = parse_config(config_text("exit 3"), "objective.toml", start_program);
  ASSERT_TRUE(config.ok()) << config.error().message;
  v1::Problem message = to_proto(config->problem);
  const auto outcome = [&] {
    const auto prepared = prepare(message);
    EXPECT_TRUE(prepared.ok()) << prepared.error().message;
    v1::Task task;
    task.mutable_evaluate();
    return evaluate(prepared->get(), task).outcome();
  };
  EXPECT_EQ(outcome(), v1::WORKER_FAILED);
  auto* argv = message.mutable_external()->mutable_argv();
  for (const std::string other : {"exit 2", "read x; echo '{\"gapfarm\":1}'; read x"}) {
    *argv->Mutable(argv->size() - 1) = other;
    EXPECT_EQ(outcome(), v1::WORKER_UNFIT) << other;
  }
  *argv->Mutable(0) = "no-such-program";
  EXPECT_EQ(outcome(), v1::WORKER_UNFIT);
}

TEST_F(ObjectiveWorker, AnswersWithSeveralValuesInTheConfigsOrder) {
  const std::string more = std::string(kSeveral) + kNsga2;
  const v1::TaskResult result =
      evaluated(R"(echo '{"id":1,"values":{"speed":7,"extra":1,"loss":0.5}}')", more);
  EXPECT_EQ(result.outcome(), v1::OK) << result.message();
  EXPECT_THAT(result.evaluate().objectives(), testing::ElementsAre(0.5, 7));
  EXPECT_EQ(result.evaluate().fitness(), 0.5);
  const auto null = evaluated(R"(echo '{"id":1,"values":{"speed":null,"loss":0.5}}')", more);
  EXPECT_EQ(null.outcome(), v1::DIVERGED);
  EXPECT_THAT(null.message(), HasSubstr("a speed of null"));
  EXPECT_EQ(evaluated(R"(echo '{"id":1,"value":3}')", more).outcome(), v1::WORKER_FAILED);
  const auto outside = evaluated(R"(echo '{"id":1,"violations":[2]}')", more);
  EXPECT_EQ(outside.outcome(), v1::INFEASIBLE);
}

TEST_F(ObjectiveWorker, HasNothingToPredict) {
  const auto config = config_of("");
  const auto prepared = prepare(to_proto(config->problem));
  v1::Task task;
  task.mutable_predict();
  const v1::TaskResult result = evaluate(prepared->get(), task);
  EXPECT_EQ(result.outcome(), v1::INVALID_REQUEST);
  EXPECT_THAT(result.message(), HasSubstr("scenario objective"));
}

TEST_F(ObjectiveWorker, ProblemAndModelKeepWhatItIs) {
  const auto config = config_of("direction = \"maximise\"\nnoisy = true\n");
  const v1::Problem message = to_proto(config->problem);
  const auto back = from_proto(message);
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(problem_hash(to_proto(*back)), problem_hash(message));
  Model model = model_of_problem(config->problem, config->problem.values);
  model.values[2] = 1;
  model.score = -0.5;
  const auto read = parse_model(format_model(model), "model.toml");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->values, model.values);
  EXPECT_EQ(read->score, model.score);
  EXPECT_EQ(problem_hash(to_proto(problem_of(*read))), problem_hash(to_proto(problem_of(model))));
  v1::Problem wrong = message;
  wrong.mutable_fitness()->set_kind(v1::Fitness::LOG_SCORE);
  EXPECT_FALSE(from_proto(wrong).ok());
  wrong = message;
  wrong.add_commands()->set_name("forward");
  EXPECT_FALSE(from_proto(wrong).ok());
}

}  // namespace gapfarm::objective_test
