// `gapfarm status` on runs that are alive, over and dead.
#include <gmock/gmock.h>
#include <signal.h>

#include <nlohmann/json.hpp>

#include "master/store/run_store.h"
#include "tests/integration/run_program.h"

namespace gapfarm::cli_status_test {

using ::testing::HasSubstr;
using ::testing::Not;
using Json = nlohmann::json;

class CliStatus : public ::testing::Test {
 protected:
  RunStore start() {
    RunInfo info;
    info.config_path = "demo.toml";
    info.fitness = "robust_mahalanobis";
    info.fitness_unit = "-";
    info.higher_is_better = false;
    info.seed = 5;
    Result<RunStore> store = RunStore::create(run_, info);
    EXPECT_TRUE(store.ok());
    return std::move(*store);
  }

  static StoredGeneration generation(std::uint64_t number) {
    StoredGeneration generation;
    generation.generation = number;
    generation.evaluations = 10 * number;
    generation.wall_s = 0.1;
    for (unsigned i = 0; i < 3; ++i) {
      StoredIndividual individual;
      individual.birth_id = 3 * number + i;
      individual.genome = {0.5};
      individual.values = R"({"friction":0.5,"wheel_shape":"sphere"})";
      individual.fitness = 3.0 / static_cast<double>(number) + i;
      individual.scores = 1;
      generation.individuals.push_back(individual);
    }
    summarise_fitness(generation, false);
    return generation;
  }

  Json json() const { return status_of(run_); }

  const TemporaryFolder folder_;
  const std::string run_ = folder_ / "run";
};

TEST_F(CliStatus, FollowsARunFromStartToEnd) {
  {
    RunStore store = start();
    EXPECT_EQ(json()["state"], "running");
    EXPECT_EQ(json()["generation"], 0);
    EXPECT_TRUE(json()["best_fitness"].is_null());
    std::string digest;
    for (std::uint64_t g = 1; g <= 6; ++g) digest = *store.commit(generation(g));
    const Json live = json();
    EXPECT_EQ(live["state"], "running");
    EXPECT_EQ(live["generation"], 6);
    EXPECT_EQ(live["evaluations"], 60);
    EXPECT_EQ(live["best_fitness"], 0.5);
    EXPECT_EQ(live["mean_fitness"], 1.5);
    EXPECT_EQ(live["worst_fitness"], 2.5);
    EXPECT_EQ(live["digest"], digest);

    Progress last;
    last.state = RunState::kFinished;
    last.stop_reason = "generations: 6 of 6";
    ASSERT_TRUE(store.set_progress(last).ok());
  }
  EXPECT_EQ(json()["state"], "finished");
  EXPECT_EQ(json()["stop_reason"], "generations: 6 of 6");
}

TEST_F(CliStatus, ShowsAScreenWithoutColourInAPipe) {
  RunStore store = start();
  for (std::uint64_t g = 1; g <= 200; ++g) ASSERT_TRUE(store.commit(generation(g)).ok());
  const Finished finished = gapfarm_command({"status", run_});
  EXPECT_EQ(finished.exit_code, 0);
  EXPECT_EQ(finished.err, "");
  EXPECT_THAT(finished.out, Not(HasSubstr("\x1b")));
  EXPECT_THAT(finished.out, HasSubstr("running"));
  EXPECT_THAT(finished.out, HasSubstr("lower is better"));
  EXPECT_THAT(finished.out, HasSubstr("wheel_shape"));
  EXPECT_LE(std::count(finished.out.begin(), finished.out.end(), '\n'), 24);
}

TEST_F(CliStatus, KnowsACrashFromAStop) {
  {
    RunStore store = start();
    ASSERT_TRUE(store.commit(generation(1)).ok());
  }
  EXPECT_EQ(json()["state"], "stopped");
  EXPECT_THAT(json()["stop_reason"].get<std::string>(), HasSubstr("crashed"));
  EXPECT_THAT(gapfarm_command({"status", run_}).out, HasSubstr("gapfarm resume " + run_));
}

TEST_F(CliStatus, WatchesUntilTheRunEnds) {
  auto store = std::make_unique<RunStore>(start());
  RunningProgram watch("gapfarm", {"status", run_, "--json", "--watch"});
  ASSERT_TRUE(wait_until([&] { return !watch.out().empty(); }));
  Progress last;
  last.state = RunState::kStopped;
  last.stop_reason = "signal";
  ASSERT_TRUE(store->set_progress(last).ok());
  store.reset();
  const Finished finished = watch.wait();
  EXPECT_EQ(finished.exit_code, 0);
  EXPECT_EQ(Json::parse(finished.out.substr(0, finished.out.find('\n')))["state"], "running");
  const std::string rest = finished.out.substr(0, finished.out.size() - 1);
  EXPECT_EQ(Json::parse(rest.substr(rest.rfind('\n') + 1))["state"], "stopped");
}

TEST_F(CliStatus, LeavesOnCtrlC) {
  const RunStore store = start();
  RunningProgram watch("gapfarm", {"status", run_, "--watch"});
  ASSERT_TRUE(wait_until([&] { return !watch.out().empty(); }));
  watch.send(SIGINT);
  EXPECT_EQ(watch.wait().exit_code, 130);
}

TEST_F(CliStatus, ReportsWhatIsNotARun) {
  const Finished nothing = gapfarm_command({"status", run_});
  EXPECT_EQ(nothing.exit_code, 2);
  EXPECT_THAT(nothing.err, HasSubstr("holds no run"));
  EXPECT_EQ(nothing.out, "");
  std::filesystem::create_directory(run_);
  folder_.write("run/run.sqlite", std::string(5000, 'x'));
  EXPECT_THAT(gapfarm_command({"status", run_}).err, HasSubstr("not a SQLite file"));
}

}  // namespace gapfarm::cli_status_test
