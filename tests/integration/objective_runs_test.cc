// Runs whose fitness is the number that a program of a user's returns.
#include <gmock/gmock.h>
#include <signal.h>

#include <nlohmann/json.hpp>

#include "tests/integration/program_runs.h"

namespace gapfarm::objective_runs_test {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

// A bowl whose least value, 0, is at x = 0.25, n = 3 and the right side, where `bend` is there.
// `misbehave` is Python that may change `answer`.
std::string bowl(const std::string& misbehave) {
  return "import json, os, sys\n"
         "for line in sys.stdin:\n"
         "    task = json.loads(line)\n"
         "    if 'id' not in task:\n"
         "        print(json.dumps({'gapfarm': 1, 'name': 'bowl', 'parameters': [\n"
         "            {'key': 'x', 'lower': -1, 'upper': 1, 'nominal': 0.9},\n"
         "            {'key': 'n', 'lower': 0, 'upper': 4, 'nominal': 1, 'integer': True},\n"
         "            {'key': 'side', 'choices': ['left', 'right']},\n"
         "            {'key': 'bend', 'lower': 0, 'upper': 1, 'nominal': 0.5,\n"
         "             'when': {'side': 'right', 'n': [2, 3]}}]}), flush=True)\n"
         "        continue\n"
         "    p = task['parameters']\n"
         "    x, n, side, sign = p['x'], p['n'], p['side'], 1\n"
         "    assert ('bend' in p) == (side == 'right' and n in (2, 3)), p\n"
         "    value = (x - 0.25) * (x - 0.25) + abs(n - 3) + (side == 'left')\n"
         "    answer = {'id': task['id'], 'value': value}\n" +
         misbehave + "    print(json.dumps(answer), flush=True)\n";
}

class ObjectiveRuns : public ProgramRuns {
 protected:
  std::string config(const std::string& misbehave, const std::string& objective = "",
                     const std::string& more = "") const {
    folder_.write("bowl.py", bowl(misbehave));
    return folder_.write("run.toml",
                         "scenario = \"objective\"\n[objective]\n"
                         "program = [\"python3\", \"bowl.py\"]\n" +
                             objective + "[evolution]\npopulation = 8\n" + more);
  }
};

TEST_F(ObjectiveRuns, FindTheLeastValueAndLeaveItsModel) {
  const Finished finished = evolve(config(""), "run", "40");
  ASSERT_EQ(finished.exit_code, 0) << finished.err;
  EXPECT_THAT(finished.err, AllOf(HasSubstr("evolving 4 parameters to the least value"),
                                  Not(HasSubstr("at the end of its range in [genes]: x"))));
  const json found = status("run");
  EXPECT_LT(found["best_fitness"], 1e-3);
  EXPECT_GE(found["best_fitness"], 0);
  EXPECT_FALSE(found["higher_is_better"]);
  EXPECT_EQ(found["best"]["values"]["n"], 3);
  EXPECT_EQ(found["best"]["values"]["side"], "right");
  const std::string model = text_of(folder_.path() / "run" / "model.toml");
  EXPECT_THAT(model, AllOf(HasSubstr("direction = \"minimise\""), HasSubstr("side = { value = "),
                           Not(HasSubstr("trials take"))));
  EXPECT_THAT(text_of(folder_.path() / "run" / "report.html"),
              AllOf(HasSubstr("Best value "), ContainsRegex(">left</td><td[^>]*><strong>right<")));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "run" / "poses.svg"));
  EXPECT_EQ(gapfarm_command({"report", folder_ / "run", "--out", folder_ / "page.html"}).exit_code,
            0);
  const std::string birth = std::to_string(found["best"]["birth_id"].get<std::uint64_t>());
  const Finished again = gapfarm_command({"replay", folder_ / "run", "--genome", birth});
  EXPECT_THAT(again.out, HasSubstr("the same to the bit")) << again.err;
}

TEST_F(ObjectiveRuns, NameWhatEndedAtItsBound) {
  const std::string file =
      config("", "", "[genes]\nx = [0.5, 1]\nn = \"table\"\n[optimiser]\nkind = \"cma_es\"\n");
  const Finished finished = evolve(file, "run", "60");
  ASSERT_EQ(finished.exit_code, 0) << finished.err;
  EXPECT_THAT(finished.err, HasSubstr("at the end of its range in [genes]: x;"));
}

TEST_F(ObjectiveRuns, ReportThatNothingChangedTheScore) {
  const Finished flat = evolve(config("    answer['value'] = 7\n"), "flat", "2");
  ASSERT_EQ(flat.exit_code, 0) << flat.err;
  EXPECT_THAT(flat.err, HasSubstr("all scores are the same"));
  EXPECT_THAT(evolve(config(""), "run", "2").err, Not(HasSubstr("all scores are the same")));
}

TEST_F(ObjectiveRuns, MaximiseIsMinimiseWithTheOtherSign) {
  ASSERT_EQ(evolve(config(""), "least", "6").exit_code, 0);
  ASSERT_EQ(evolve(config("    answer['value'] = -value\n", "direction = \"maximize\"\n"),
                   "greatest", "6")
                .exit_code,
            0);
  const json least = status("least"), greatest = status("greatest");
  EXPECT_EQ(greatest["best"]["values"], least["best"]["values"]);
  EXPECT_EQ(greatest["best_fitness"].get<double>(), -least["best_fitness"].get<double>());
  EXPECT_TRUE(greatest["higher_is_better"]);
}

TEST_F(ObjectiveRuns, NumberOfWorkersAndKillsChangeNothing) {
  // The seed counts: noise that is drawn from it, and scores of elites that are means.
  const std::string file =
      config("    answer['value'] += task['seed'] * 1e-12\n", "noisy = true\n");
  ASSERT_EQ(evolve(file, "one", "6", "1").exit_code, 0);
  ASSERT_EQ(evolve(file, "two", "6", "2").exit_code, 0);
  EXPECT_EQ(status("one")["digest"], status("two")["digest"]);
  // Killed by its own objective in the middle of a generation.
  config(
      "    answer['value'] += task['seed'] * 1e-12\n"
      "    if os.path.exists('master') and task['id'] >= 8:\n"
      "        os.rename('master', 'taken')\n"  // first: this process dies with its worker
      "        os.kill(int(open('taken').read()), 9)\n",
      "noisy = true\n");
  RunningProgram killed("gapfarm", {"evolve", file, "--out", folder_ / "killed", "--generations",
                                    "6", "--workers", "2"});
  folder_.write("master", std::to_string(killed.pid()));
  EXPECT_EQ(killed.wait().exit_code, 128 + SIGKILL);
  const Finished resumed = gapfarm_command({"resume", folder_ / "killed", "--workers", "2"});
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_EQ(status("killed")["digest"], status("one")["digest"]);
}

// One lucky score of another one is lower.
TEST_F(ObjectiveRuns, TheBestOfNoisyScoresIsTheSameOneEverywhere) {
  const std::string noisy =
      "    import random\n    answer['value'] += random.Random(task['seed']).gauss(0, 0.5)\n";
  const std::string file = config(noisy, "noisy = true\n", "[optimiser]\nkind = \"cma_es\"\n");
  const Finished run = evolve(file, "run", "16");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json found = status("run");
  const Finished again = gapfarm_command({"replay", folder_ / "run", "--genome", "best"});
  EXPECT_THAT(again.out,
              AllOf(HasSubstr("genome " + found["best"]["birth_id"].dump() + " of generation 16"),
                    HasSubstr(" from 8 scores")));
  EXPECT_THAT(screen("run"), HasSubstr("(of 8 noisy scores, the luckiest of all)"));
  EXPECT_THAT(text_of(folder_.path() / "run" / "model.toml"),
              HasSubstr("\nvalue = " + found["best_fitness"].dump()));
}

TEST_F(ObjectiveRuns, ResumeFromAnyFolder) {
  config("");
  const Finished resumed = shell(
      "\"$G\" evolve run.toml --out run --generations 1 --workers 1 && mkdir elsewhere && "
      "cd elsewhere && \"$G\" resume ../run --generations 2 --workers 1");
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_EQ(status("run")["generation"], 2);
}

TEST_F(ObjectiveRuns, WhatCrashesHangsOrPrintsRubbishIsNamedAndTheRunGoesOn) {
  const struct {
    const char *name, *misbehave, *named;
  } kinds[] = {
      {"crash", "    if n == 4: os._exit(9)\n", "ended with status 9"},
      {"hang", "    if n == 4: os.read(os.pipe()[0], 1)\n", "did not answer within 1 s"},
      {"rubbish", "    if n == 4: print('bang', flush=True)\n",
       "did not answer with a JSON object: 'bang'"},
      {"nothing", "    if n == 4: del answer['value']\n",
       "did not answer with \"value\": a number"},
  };
  for (const auto& kind : kinds) {
    const Finished finished = evolve(config(kind.misbehave, "answer_limit = 1\n"), kind.name, "2");
    EXPECT_EQ(finished.exit_code, 3) << kind.name << finished.err;
    EXPECT_EQ(status(kind.name)["generation"], 2) << kind.name;
    const std::string log = text_of(folder_.path() / kind.name / "log.txt");
    for (const std::string& kept : {screen(kind.name), log}) {
      EXPECT_THAT(kept, AllOf(HasSubstr(kind.named), HasSubstr("--set n="))) << kind.name;
    }
  }
}

TEST_F(ObjectiveRuns, AFailedEvaluationIsNoErrorAndItsMessageStays) {
  const struct {
    const char *name, *misbehave, *named;
  } kinds[] = {
      {"nan", "    if n > 2: answer['value'] = float('nan')\n",
       "it printed NaN, which is no number"},
      {"null", "    if n > 2: answer['value'] = None\n", "it answered a value of null"},
      {"failed",
       "    if n > 2: answer = {'id': task['id'], 'outcome': 'failed', 'message': 'no mesh'}\n",
       ": no mesh; --set x="},
  };
  for (const auto& kind : kinds) {
    const Finished finished = evolve(config(kind.misbehave), kind.name, "3");
    EXPECT_EQ(finished.exit_code, 0) << kind.name << finished.err;
    EXPECT_EQ(status(kind.name)["quarantined"], 0) << kind.name;
    const std::string log = text_of(folder_.path() / kind.name / "log.txt");
    for (const std::string& kept : {finished.err, screen(kind.name), log}) {
      EXPECT_THAT(kept, AllOf(HasSubstr(kind.named), HasSubstr("--set n="))) << kind.name;
    }
  }
}

TEST_F(ObjectiveRuns, WhenNothingEndsWellTheRunSaysSo) {
  const Finished finished = evolve(config("    answer['value'] = None\n"), "run", "2");
  EXPECT_EQ(finished.exit_code, 1) << finished.err;
  EXPECT_THAT(finished.out, HasSubstr("no evaluation ended well"));
  EXPECT_THAT(finished.err, HasSubstr("there is no model: "));
  EXPECT_THAT(finished.err.substr(finished.err.find("there is no model")),
              HasSubstr("it answered a value of null"));
  EXPECT_THAT(screen("run"),
              AllOf(HasSubstr("no evaluation ended well"), Not(HasSubstr("best  "))));
  EXPECT_FALSE(status("run").contains("best"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "run" / "model.toml"));
}

TEST_F(ObjectiveRuns, TheBestIsFeasible) {
  // The least value would be outside; the best inside lies on the edge.
  const std::string inside = "    answer['violations'] = [x - 0.1, -1]\n";
  ASSERT_EQ(evolve(config(inside), "run", "40").exit_code, 0);
  const json found = status("run");
  EXPECT_LE(found["best"]["values"]["x"], 0.1);
  EXPECT_NEAR(found["best_fitness"], 0.15 * 0.15, 2e-3);
  const Finished none =
      evolve(config("    answer = {'id': task['id'], 'violations': [x + 2]}\n"), "none", "20");
  EXPECT_EQ(none.exit_code, 1) << none.err;
  EXPECT_THAT(none.out, HasSubstr("nothing feasible was found, violations sum to 1.0"));
  EXPECT_THAT(screen("none"), HasSubstr("nothing feasible was found"));
}

TEST_F(ObjectiveRuns, EverySearchHasThem) {
  for (const char* method : {"cma_es", "differential_evolution", "local", "de_simplex"}) {
    const std::string file =
        config("    answer['violations'] = [0.2 - x]\n    if n == 4: answer['value'] = None\n", "",
               "[evolution.stop]\nevaluations = 300\n[optimiser]\nkind = \"" + std::string(method) +
                   "\"\n");
    const Finished finished = evolve(file, method, "1000");
    ASSERT_EQ(finished.exit_code, 0) << method << finished.err;
    EXPECT_GE(status(method)["best"]["values"]["x"], 0.2) << method;
  }
}

TEST_F(ObjectiveRuns, CheckEvaluatesOnceAndCompareNeedsNoTrials) {
  const std::string file = config("    answer['notes'] = 'as it came'\n");
  const Finished checked = gapfarm_command({"check", file});
  EXPECT_EQ(checked.exit_code, 0) << checked.err;
  EXPECT_THAT(checked.out,
              AllOf(HasSubstr("value        3.4225 at the config's own values; as it came"),
                    HasSubstr("lower is better"), HasSubstr("an evaluation")));
  const Finished compared = gapfarm_command({"compare", file, "--seeds", "2", "--evaluations", "30",
                                             "--out", folder_ / "compared", "--workers", "2"});
  EXPECT_EQ(compared.exit_code, 0) << compared.err;
  EXPECT_THAT(compared.out, HasSubstr("random search"));
  EXPECT_EQ(gapfarm_command({"check", config("    os._exit(1)\n")}).exit_code, 3);
  const std::string fails =
      "    answer = {'id': task['id'], 'outcome': 'failed', 'message': 'no mesh'}\n";
  const Finished failed = gapfarm_command({"check", config(fails)});
  EXPECT_EQ(failed.exit_code, 2);
  EXPECT_THAT(failed.out, AllOf(HasSubstr("own values failed: no mesh"), Not(HasSubstr(": fine"))));
}

TEST_F(ObjectiveRuns, CheckReportsOnceWhyTheProgramHasNoAnswer) {
  const Finished checked = gapfarm_command({"check", config("    os._exit(9)\n")});
  EXPECT_EQ(checked.exit_code, 3);
  const std::string all = checked.out + checked.err, why = "ended with status 9";
  ASSERT_NE(all.find(why), all.npos) << all;
  EXPECT_EQ(all.find(why), all.rfind(why)) << all;
}

TEST_F(ObjectiveRuns, CheckCountsNoStartAsAnEvaluation) {
  const Finished checked = gapfarm_command(
      {"check", config("    if task['id'] == 1: sum(range(60000000))\n"), "--json"});
  ASSERT_EQ(checked.exit_code, 0) << checked.err;
  EXPECT_LT(json::parse(checked.out)["evaluation_s"], 0.5);
}

TEST_F(ObjectiveRuns, WhatNeedsTrialsRefusesInOneSentence) {
  const std::string file = config(""), run = folder_ / "run", out = folder_ / "out";
  ASSERT_EQ(evolve(file, "run", "1").exit_code, 0);
  const std::vector<std::vector<std::string>> commands = {
      {"diagnose", file, "--out", out},
      {"crossfit", file},
      {"determine", file, "--model", run, "--out", out},
      {"horizons", file},
      {"predict", run, "--trials", file},
      {"simulate", file, "--out", out},
      {"simulate", run + "/model.toml", "--out", out},
      {"drive", run, "--out", out},
      {"influence", file, "--out", out},
      {"stability", file, "--out", out},
      {"plan", file, "--out", out},
      {"blind-check", file, "--out", out},
  };
  for (const auto& command : commands) {
    const Finished finished = gapfarm_command(command);
    EXPECT_EQ(finished.exit_code, 2) << command[0] << finished.err;
    EXPECT_THAT(finished.err, HasSubstr("scenario objective has values and a number"))
        << command[0];
  }
  for (const char* command : {"evolve", "compare"}) {
    const Finished trials = gapfarm_command({command, file, "--trials", file, "--out", out});
    EXPECT_EQ(trials.exit_code, 2) << command;
    EXPECT_THAT(trials.err, HasSubstr("has no trials; omit --trials")) << command;
  }
}

TEST_F(ObjectiveRuns, TheExampleFindsTheEndOfTheValley) {
  const Finished finished = gapfarm_command({"evolve", GAPFARM_SOURCE_DIR "/configs/objective.toml",
                                             "--out", folder_ / "run", "--workers", "2"});
  ASSERT_EQ(finished.exit_code, 0) << finished.err;
  const json found = status("run");
  EXPECT_LT(found["best_fitness"], 1e-6);
  EXPECT_NEAR(found["best"]["values"]["x"], 1, 1e-3);
}

// Near 0 and near 1: the front is x in [0, 1], n = 3; `side` is a matter of a constraint.
constexpr const char* kTwo =
    "    answer = {'id': task['id'], 'values': {'near': x * x + abs(n - 3), 'far': -(x - 1) * (x - "
    "1)\n"
    "              - abs(n - 3)}, 'violations': [int(side == 'left')]}\n";
constexpr const char* kTwoOf = "minimise = [\"near\"]\nmaximise = [\"far\"]\n";

TEST_F(ObjectiveRuns, OfSeveralValuesTheFrontIsFoundAndAnyMemberMakesAModel) {
  const std::string nsga2 = "[optimiser]\nkind = \"nsga2\"\npopulation = 20\n";
  const Finished finished = evolve(config(kTwo, kTwoOf, nsga2), "run", "25");
  ASSERT_EQ(finished.exit_code, 0) << finished.err;
  const json found = status("run"), front = found["front"];
  ASSERT_GT(front["members"].size(), 10u);
  for (const json& member : front["members"]) {
    const double x = member["values"]["x"], near = member["objectives"]["near"];
    EXPECT_EQ(member["values"]["n"], 3);
    EXPECT_EQ(member["values"]["side"], "right");
    EXPECT_DOUBLE_EQ(near, x * x);
    EXPECT_EQ(member["fitness"], member["objectives"]["near"]) << "the first of them";
  }
  EXPECT_FALSE(front["objectives"][0]["maximise"]);
  EXPECT_TRUE(front["objectives"][1]["maximise"]);
  EXPECT_LT(front["objectives"][0]["ideal"], 0.02);
  EXPECT_GT(front["objectives"][1]["ideal"], -0.02);
  EXPECT_EQ(front["knee"], found["best"]["birth_id"]);
  EXPECT_NEAR(found["best"]["values"]["x"].get<double>(), 0.5, 0.2) << "the knee";
  for (std::size_t g = 1; g < front["hypervolume"].size(); ++g) {
    EXPECT_GE(front["hypervolume"][g].get<double>(),
              0.99 * front["hypervolume"][g - 1].get<double>());
  }
  EXPECT_THAT(screen("run"), AllOf(HasSubstr("members, the best is its knee"),
                                   HasSubstr("far, higher is better"), HasSubstr("hypervolume")));
  EXPECT_THAT(text_of(folder_.path() / "run" / "model.toml"), HasSubstr("maximise = [\"far\"]"));

  const json end = front["members"][0];
  const Finished again = gapfarm_command({"replay", folder_ / "run", "--genome",
                                          std::to_string(end["birth_id"].get<std::uint64_t>()),
                                          "--out", folder_ / "end.toml"});
  EXPECT_THAT(again.out, HasSubstr("the same to the bit")) << again.err;
  EXPECT_THAT(text_of(folder_.path() / "end.toml"), HasSubstr("[parameters"));
  EXPECT_EQ(gapfarm_command({"report", folder_ / "run", "--out", folder_ / "page.html", "--history",
                             folder_ / "history.csv"})
                .exit_code,
            0);
  const std::string history = text_of(folder_.path() / "history.csv");
  EXPECT_THAT(history.substr(0, history.find('\n')),
              AllOf(HasSubstr("birth_id,generation,evaluations,wall_s"), HasSubstr(",bend"),
                    HasSubstr("objective.near,objective.far")));
  EXPECT_THAT(text_of(folder_.path() / "page.html"),
              AllOf(HasSubstr("What is traded off"), HasSubstr("generations: near "),
                    HasSubstr(R"("best":"knee")"), Not(HasSubstr("Best value"))));
}

TEST_F(ObjectiveRuns, CheckCallsNoGeneIdleThatMovesAnyOfSeveralValues) {
  const std::string second = "    answer = {'id': task['id'], 'values': {'near': x, 'far': n}}\n";
  const Finished checked = gapfarm_command(
      {"check", config(second, kTwoOf, "[optimiser]\nkind = \"nsga2\"\n"), "--json"});
  EXPECT_EQ(checked.exit_code, 2) << checked.err;
  const json idle = json::parse(checked.out)["idle_genes"];
  ASSERT_EQ(idle.size(), 1u) << idle;
  EXPECT_EQ(idle[0]["parameter"], "side");
  EXPECT_THAT(idle[0]["remedy"], HasSubstr("the program's answer does not depend on it"));
}

TEST_F(ObjectiveRuns, SeveralValuesNeedTheirNamesAndNsga2) {
  const struct {
    const char *objective, *more, *named;
  } kinds[] = {
      {kTwoOf, "", "several objectives need [optimiser] kind = \"nsga2\""},
      {"", "[optimiser]\nkind = \"nsga2\"\n", "nsga2 needs several objectives"},
      {"minimise = [\"near\"]\n", "[optimiser]\nkind = \"nsga2\"\n", "name 2 to 8 values"},
      {"minimise = [\"near\", \"near\"]\n", "[optimiser]\nkind = \"nsga2\"\n", "named twice"},
      {"minimise = [\"near\", \"far\"]\ndirection = \"minimise\"\n",
       "[optimiser]\nkind = \"nsga2\"\n", "direction is of one value"},
  };
  for (const auto& kind : kinds) {
    const Finished refused = evolve(config(kTwo, kind.objective, kind.more), "refused", "2");
    EXPECT_EQ(refused.exit_code, 2) << kind.named;
    EXPECT_THAT(refused.err, HasSubstr(kind.named));
  }
  const Finished unnamed = gapfarm_command(
      {"check", config("    answer = {'id': task['id'], 'values': {'near': 1}}\n")});
  EXPECT_EQ(unnamed.exit_code, 3);
  EXPECT_THAT(unnamed.out, HasSubstr("which [objective] minimise and maximise have to name"));
}

}  // namespace gapfarm::objective_runs_test
