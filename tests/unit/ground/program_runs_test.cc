// Runs that a user's program follows: what of commands and readings is wrong with a log of them.
#include "master/ground/program_runs.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numeric>

#include "common/config/config.h"
#include "common/random/stream.h"
#include "tests/unit/diagnose/answering_farm.h"

namespace gapfarm::program_runs_test {

constexpr double kSpeed = 1.2;  // of the program: m/s a unit of v

// Where a robot without inertia is at `t`, in the frame of its start.
Pose follow(const std::vector<CommandRow>& commands, double start_s, double t, double speed) {
  Pose X;
  for (std::size_t i = 0; i < commands.size(); ++i) {
    const double from = std::max(start_s, commands[i].t_s);
    const double to = i + 1 < commands.size() ? std::min(t, commands[i + 1].t_s) : t;
    if (to <= from) continue;
    const std::vector<double>& v = commands[i].values;
    X = X * exp({speed * v[0] * (to - from), 0, v[1] * (to - from)});
  }
  return X;
}

// Every worker's program, without any.
class ProgramOfRuns : public AnsweringFarm {
 public:
  std::string fails;      // of every task
  double step_s = 1e-12;  // at whose multiples it takes commands

 private:
  v1::TaskResult answer(const Problem& problem, const v1::Task& task) const override {
    v1::TaskResult result;
    result.set_outcome(fails.empty() ? v1::OK : v1::WORKER_FAILED);
    result.set_message(fails);
    ParameterValues values = problem.values;
    for (const v1::Override& o : task.predict().point().overrides()) {
      values[o.parameter()] = o.value();
    }
    const auto value = [&](const char* key) { return values[problem.table().row(key)]; };
    std::vector<std::uint32_t> wanted(task.predict().trials().begin(),
                                      task.predict().trials().end());
    if (wanted.empty()) {
      wanted.resize(problem.log.trials.size());
      std::iota(wanted.begin(), wanted.end(), 0);
    }
    for (const std::uint32_t w : wanted) {
      const Trial& trial = problem.log.trials[w];
      const CommandedRun& run = problem.runs[*trial.run];
      std::vector<CommandRow> commands = run.commands;
      for (CommandRow& row : commands) {
        row.t_s = step_s * std::ceil((row.t_s + value("delay")) / step_s - 1e-6);
        row.values = {value("v.gain") * row.values[0] + value("v.offset"),
                      value("omega.gain") * row.values[1] + value("omega.offset")};
      }
      const double end_s = *trial.t_s + *trial.duration_s;
      const Pose from = follow(commands, run.start_s, *trial.t_s, value("speed"));
      const Pose to = follow(commands, run.start_s, end_s, value("speed"));
      *result.mutable_predict()->add_predictions()->mutable_end() =
          to_proto(trial.X_WS * between(from, to));
    }
    return result;
  }
};

Problem problem_of(const std::string& genes = "") {
  const auto config = parse_config(
      "scenario = \"external_runs\"\n[external]\nprogram = [\"runs\"]\n" + genes, "runs.toml",
      [](const ExternalCommand&) -> Result<std::string> {
        return std::string(R"({"gapfarm":1,"name":"runs","channels":["v","omega"],"parameters":[)"
                           R"({"key":"speed","lower":0.1,"upper":3,"nominal":1.2}]})");
      });
  EXPECT_TRUE(config.ok()) << (config ? "" : config.error().message);
  return config->problem;
}

struct Wrong {
  double delay_s = 0, v_gain = 1, omega_gain = 1;
};

// Eight runs of 12 s, poses of 1 mm and 2 mrad.
RunLog driven(const Wrong& wrong) {
  Stream stream({11, Purpose::kTest, 0, 0, 0});
  RunLog log;
  log.channels = {"v", "omega"};
  for (int r = 0; r < 8; ++r) {
    LoggedRun run;
    run.run = std::to_string(r + 1);
    std::vector<CommandRow> taken;
    for (int k = 0; k < 24; ++k) {
      const double v = 0.3 + 0.2 * std::sin(1.7 * k + r), omega = 0.8 * std::sin(2.3 * k + 2 * r);
      run.commands.push_back({0.5 * k, {v, omega}});
      taken.push_back({0.5 * k + wrong.delay_s, {wrong.v_gain * v, wrong.omega_gain * omega}});
    }
    const Pose start{0.3 * r, -0.2, 1.1 * r};
    for (int k = 0; k < 55; ++k) {
      Pose X = start * follow(taken, 0, 0.2 * k, kSpeed);
      X = {X.x + 1e-3 * stream.normal(), X.y + 1e-3 * stream.normal(),
           wrap_angle(X.theta + 2e-3 * stream.normal())};
      run.poses.push_back({0.2 * k, X});
    }
    log.runs.push_back(std::move(run));
  }
  return log;
}

Diagnosis diagnose(const RunLog& log, Problem problem = problem_of()) {
  ProgramOfRuns farm;
  std::vector<Gene> tuned = std::move(problem.genes);
  problem.genes.clear();
  auto found = diagnose_program_runs(farm, tuned, log, {}, &problem);
  EXPECT_TRUE(found.ok()) << (found ? "" : found.error().message);
  return found ? found->diagnosis : Diagnosis();
}

const NamedEffect* named(const Diagnosis& d, const std::string& name) {
  for (const NamedEffect& effect : d.effects) {
    if (effect.name == name) return &effect;
  }
  return nullptr;
}

TEST(ProgramRuns, ADelayAndAGainAreNamedWithIntervalsThatHoldThem) {
  Problem problem = problem_of();
  ProgramOfRuns farm;
  const auto found = diagnose_program_runs(farm, {}, driven({0.18, 1, 1.15}), {}, &problem);
  ASSERT_TRUE(found.ok()) << found.error().message;
  const Diagnosis& d = found->diagnosis;
  const NamedEffect* delay = named(d, "command_delay");
  const NamedEffect* gain = named(d, "command_gain");
  ASSERT_TRUE(delay && gain) << d.headline;
  EXPECT_EQ(d.verdict, Verdict::kEffect) << d.headline;
  EXPECT_NEAR(delay->parameters[0].value, 0.18, 0.01);
  EXPECT_LE(delay->parameters[0].lo, 0.18);
  EXPECT_GE(delay->parameters[0].hi, 0.18);
  EXPECT_NEAR(gain->parameters[0].value, 0.15, 0.01);
  EXPECT_LE(gain->parameters[0].lo, 0.15);
  EXPECT_GE(gain->parameters[0].hi, 0.15);
  EXPECT_THAT(gain->text, testing::HasSubstr("omega.gain 1.1"));
  // The model has both put in.
  EXPECT_NEAR(problem.values[problem.table().row("delay")], 0.18, 0.01);
  EXPECT_NEAR(problem.values[problem.table().row("omega.gain")], 1.15, 0.01);
}

// Whose slopes by delays of less than a step were none, or many times too large, and kept every
// value half way.  `speed` takes up a part of the gain, and gives it back once that has a name.
TEST(ProgramRuns, AProgramThatTakesCommandsAtStepsOfItsOwnIsFollowed) {
  Problem problem = problem_of("[genes]\nspeed = [0.5, 2]\n");
  const std::vector<Gene> tuned = std::move(problem.genes);
  problem.genes.clear();
  ProgramOfRuns farm;
  farm.step_s = 0.02;
  const auto found = diagnose_program_runs(farm, tuned, driven({0.19, 1.1, 1.15}), {}, &problem);
  ASSERT_TRUE(found.ok()) << found.error().message;
  const Diagnosis& d = found->diagnosis;
  const NamedEffect* delay = named(d, "command_delay");
  const NamedEffect* gain = named(d, "command_gain");
  ASSERT_TRUE(delay && gain) << d.headline;
  EXPECT_EQ(d.effects.size(), 2u) << d.headline;
  EXPECT_EQ(d.verdict, Verdict::kEffect) << d.headline;
  EXPECT_NEAR(delay->parameters[0].value, 0.19, farm.step_s);
  EXPECT_NEAR(gain->parameters[0].value, 0.15, 0.01);
  EXPECT_NEAR(problem.values[problem.table().row("speed")], 1.1 * kSpeed, 0.01);
}

TEST(ProgramRuns, NothingIsNamedOfACleanLog) {
  const Diagnosis d = diagnose(driven({}));
  EXPECT_TRUE(d.effects.empty()) << d.headline;
  EXPECT_EQ(d.verdict, Verdict::kNone) << d.headline;
}

TEST(ProgramRuns, WhatAParameterOfTheProgramsDoesNoGainMayClaim) {
  const RunLog log = driven({0, 1.25, 1});
  Problem problem = problem_of("[genes]\nspeed = [0.5, 2]\n");
  const std::vector<Gene> tuned = std::move(problem.genes);
  problem.genes.clear();
  ProgramOfRuns farm;
  const auto found = diagnose_program_runs(farm, tuned, log, {}, &problem);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_TRUE(found->diagnosis.effects.empty()) << found->diagnosis.headline;
  EXPECT_NEAR(problem.values[problem.table().row("speed")], 1.25 * kSpeed, 0.01);
}

// A speed that is fitted first to v in km/h would take most of that up.
TEST(ProgramRuns, ParametersAreTunedToTheLogPutRight) {
  Problem problem = problem_of("[genes]\nspeed = [0.9, 1.5]\n");
  const std::vector<Gene> tuned = std::move(problem.genes);
  problem.genes.clear();
  ProgramOfRuns farm;
  const auto found = diagnose_program_runs(farm, tuned, driven({0, 1 / 3.6, 1}), {}, &problem);
  ASSERT_TRUE(found.ok()) << found.error().message;
  const Diagnosis& d = found->diagnosis;
  EXPECT_TRUE(named(d, "unit_error")) << d.headline;
  EXPECT_EQ(d.effects.size(), 1u) << d.headline;
  EXPECT_NEAR(problem.values[problem.table().row("speed")], kSpeed, 0.01);
  EXPECT_LT(d.position_mm.final_, 2 * d.position_mm.floor);
}

TEST(ProgramRuns, ExchangedChannelsAreAFaultOfTheLog) {
  RunLog log = driven({});
  for (LoggedRun& run : log.runs) {
    for (CommandRow& row : run.commands) std::swap(row.values[0], row.values[1]);
  }
  EXPECT_TRUE(named(diagnose(log), "channels_swapped"));
}

TEST(ProgramRuns, AProgramThatFailsIsTheError) {
  ProgramOfRuns farm;
  farm.fails = "ended with status 9 instead of answering";
  Problem problem = problem_of();
  const auto found = diagnose_program_runs(farm, {}, driven({}), {}, &problem);
  ASSERT_FALSE(found.ok());
  EXPECT_THAT(found.error().message, testing::HasSubstr("ended with status 9"));
}

// What a check names of a log whose poses are spoiled; the program goes `scale` times the way.
std::string checked(const std::function<Pose(const Pose&)>& spoil, double scale = 1) {
  Stream stream({7, Purpose::kTest, 0, 0, 0});
  const auto draw = [&](double most) { return most * (2 * stream.uniform() - 1); };
  RunLog log = driven({});
  for (LoggedRun& run : log.runs) {
    for (PoseRow& row : run.poses)
      row.X_WM = spoil(row.X_WM * Pose{draw(0.01), draw(0.01), draw(0.02)});
  }
  Problem problem = problem_of();
  for (const char* gain : {"v.gain", "omega.gain"}) {
    problem.values[problem.table().row(gain)] = scale;
  }
  ProgramOfRuns farm;
  const auto found = check_program_log(farm, problem, log, {{2}, 0.5});
  EXPECT_TRUE(found.ok()) << (found ? "" : found.error().message);
  EXPECT_EQ(farm.asked, log.runs.size()) << "once each";
  return found && *found ? (*found)->name : "";
}

TEST(ProgramRuns, ACheckNamesWhatOfPosesIsTheWrongWayRound) {
  EXPECT_EQ(checked([](Pose X) { return Pose{1000 * X.x, 1000 * X.y, X.theta}; }), "unit_error");
  EXPECT_EQ(checked([](Pose X) { return Pose{100 * X.x, 100 * X.y, X.theta}; }), "unit_error");
  EXPECT_EQ(checked([](Pose X) { return Pose{-X.x, X.y, M_PI - X.theta}; }), "sides_swapped");
  EXPECT_EQ(checked([](Pose X) { return Pose{X.x, X.y, -X.theta}; }), "heading_flipped");
  EXPECT_EQ(checked([](Pose X) { return Pose{X.x, -X.y, X.theta}; }), "axes_mirrored");
  EXPECT_EQ(checked([](Pose X) { return Pose{-X.x, X.y, X.theta}; }), "axes_mirrored");
  EXPECT_EQ(checked([](Pose X) { return Pose{X.y, X.x, X.theta}; }), "axes_swapped");
  EXPECT_EQ(checked([](Pose X) { return Pose{X.x, X.y, X.theta + M_PI / 2}; }), "heading_turned");
  EXPECT_EQ(checked([](Pose X) { return Pose{X.x, X.y, X.theta + M_PI}; }), "heading_turned");
}

TEST(ProgramRuns, ACheckAsksNothingOfALogElsewhereNorOfAProgramThatIsNotTunedYet) {
  const auto turned = [](Pose X) { return Pose{5000, -3000, 2} * X; };
  EXPECT_EQ(checked([](Pose X) { return X; }), "");
  for (const double scale : {0.3, 0.7, 1.0, 1.3, 3.0})
    EXPECT_EQ(checked(turned, scale), "") << scale;
}

}  // namespace gapfarm::program_runs_test
