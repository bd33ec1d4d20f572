// The purity contract with real processes (docs/determinism.md): how many workers there are, in
// which order they get their jobs, who is killed and when leave no trace in any generation.
#include <gmock/gmock.h>
#include <signal.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>

#include "master/store/run_reader.h"
#include "tests/integration/demo_config.h"
#include "tests/integration/run_program.h"

namespace gapfarm::run_purity_test {

using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using Clock = std::chrono::steady_clock;
using Digests = std::vector<std::string>;

constexpr std::size_t kGenerations = 8;
constexpr int kStopped = 85;

double seconds_since(Clock::time_point begun) {
  return std::chrono::duration<double>(Clock::now() - begun).count();
}

// One digest a committed generation; none while there is no store.
Digests digests(const std::string& run) {
  Digests found;
  const auto reader = RunReader::open(run);
  if (!reader) return found;
  const auto generations = reader->generations();
  if (!generations) return found;
  for (const StoredGeneration& generation : *generations) found.push_back(generation.digest);
  return found;
}

// Sampled spread: every score draws random numbers, and elites are scored again and again, so a
// stream that depended on workers or order would show.
class RunPurity : public ::testing::Test {
 protected:
  std::vector<std::string> evolve(const std::string& run,
                                  const std::vector<std::string>& options) const {
    std::vector<std::string> arguments = {"evolve", config_, "--out", folder_ / run};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return arguments;
  }

  Digests evolved(const std::string& run, const std::vector<std::string>& options) const {
    const Finished finished = gapfarm_command(evolve(run, options));
    EXPECT_EQ(finished.exit_code, 0) << finished.err;
    return digests(folder_ / run);
  }

  Digests resumed(const std::string& run, const std::vector<std::string>& options) const {
    std::vector<std::string> arguments = {"resume", folder_ / run};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Finished finished = gapfarm_command(arguments);
    EXPECT_EQ(finished.exit_code, 0) << finished.err;
    return digests(folder_ / run);
  }

  // Waits until `run` has committed three generations, of many more to come.
  bool half_way(const std::string& run) const {
    return wait_until([&] { return digests(folder_ / run).size() >= 3; });
  }

  // Of a run whose master was killed half way.
  Digests resumed_after_a_kill() const {
    {
      RunningProgram master("gapfarm", evolve("run", {"--generations", "10000", "--workers", "2"}));
      EXPECT_TRUE(half_way("run"));
      master.send(SIGKILL);
      master.wait();
    }
    // Generations of one evaluation go by faster than a signal comes: what was not asked for is
    // cut.
    const auto last = std::min(digests(folder_ / "run").size(), kGenerations);
    return resumed("run", {"--generation", std::to_string(last), "--generations",
                           std::to_string(kGenerations)});
  }

  std::string status_digest(const std::string& run) const {
    return status_of(folder_ / run).value("digest", "");
  }

  const TemporaryFolder folder_;
  const std::string config_ =
      folder_.write("run.toml", demo_config(10, 3, kMoreGenes,
                                            "[evolution.stop]\n"
                                            "generations = " +
                                                std::to_string(kGenerations) + "\n"));
};

TEST_F(RunPurity, HoldsForAnyNumberOfWorkersAndAnyOrder) {
  const Digests one = evolved("one", {"--workers", "1"});
  ASSERT_THAT(one, SizeIs(kGenerations));
  EXPECT_NE(one.front(), one.back());
  EXPECT_THAT(evolved("two", {"--workers", "2"}), ElementsAreArray(one));
  EXPECT_THAT(evolved("four", {"--workers", "4"}), ElementsAreArray(one));
  EXPECT_THAT(evolved("shuffled", {"--workers", "2", "--shuffle", "5"}), ElementsAreArray(one));
  EXPECT_EQ(status_digest("two"), one.back());
  // The digest looks at what matters: another seed goes another way.
  EXPECT_NE(evolved("other", {"--workers", "2", "--seed", "2", "--generations", "1"}).back(),
            one.front());
}

// The interrupted runs would go on for long, so that a signal never comes too late; what they
// committed, and what follows a resume to the usual end, is compared.
TEST_F(RunPurity, HoldsWhenStoppedAndResumed) {
  const Digests whole = evolved("whole", {"--workers", "2"});
  ASSERT_THAT(whole, SizeIs(kGenerations));
  RunningProgram master("gapfarm", evolve("run", {"--generations", "10000"}));
  ASSERT_TRUE(half_way("run"));
  const auto asked = Clock::now();
  master.send(SIGINT);
  const Finished finished = master.wait();
  EXPECT_EQ(finished.exit_code, kStopped) << finished.err;
  EXPECT_LT(seconds_since(asked), 10);
  EXPECT_THAT(finished.err, HasSubstr("gapfarm resume " + folder_ / "run"));
  ASSERT_LT(digests(folder_ / "run").size(), kGenerations);

  const std::vector<std::string> to_the_end = {"--generations", std::to_string(kGenerations),
                                               "--workers", "1"};
  EXPECT_THAT(resumed("run", to_the_end), ElementsAreArray(whole));
  EXPECT_EQ(status_digest("run"), whole.back());

  EXPECT_THAT(resumed("whole", {"--generation", "3", "--shuffle", "9"}), ElementsAreArray(whole));
  const std::string kept =
      folder_ / "whole" + "/run.generation-" + std::to_string(kGenerations) + ".sqlite";
  EXPECT_THAT(digests(kept), ElementsAreArray(whole)) << "what was given up is kept";
}

TEST_F(RunPurity, HoldsWhenTheMasterIsKilled) {
  const Digests whole = evolved("whole", {"--workers", "2"});
  ASSERT_THAT(whole, SizeIs(kGenerations));
  std::vector<pid_t> workers;
  {
    RunningProgram master("gapfarm", evolve("run", {"--generations", "10000", "--workers", "2"}));
    ASSERT_TRUE(half_way("run"));
    workers = children(master.pid());
    master.send(SIGKILL);
    EXPECT_EQ(master.wait().exit_code, 128 + SIGKILL);
  }
  ASSERT_LT(digests(folder_ / "run").size(), kGenerations);
  EXPECT_THAT(resumed("run", {"--generations", std::to_string(kGenerations)}),
              ElementsAreArray(whole));
  // Workers do not outlive their master.
  EXPECT_THAT(workers, SizeIs(2));
  for (const pid_t worker : workers) {
    const std::filesystem::path exe = "/proc/" + std::to_string(worker) + "/exe";
    EXPECT_TRUE(wait_until([&] {
      std::error_code gone;
      return std::filesystem::read_symlink(exe, gone).filename() != "gapfarm-worker";
    }));
  }
}

TEST_F(RunPurity, HoldsWhenWorkersAreKilled) {
  const Digests whole = evolved("whole", {"--workers", "2"});
  ASSERT_THAT(whole, SizeIs(kGenerations));
  RunningProgram master("gapfarm", evolve("run", {"--workers", "2"}));
  int killed = 0;
  for (std::size_t generation = 1; generation <= 4; ++generation) {
    ASSERT_TRUE(wait_until([&] { return digests(folder_ / "run").size() >= generation; }));
    for (const pid_t worker : children(master.pid())) {
      killed += ::kill(worker, SIGKILL) == 0 ? 1 : 0;
      if (generation % 2 == 1) break;  // one of them, or both
    }
  }
  const Finished finished = master.wait();
  EXPECT_EQ(finished.exit_code, 0) << finished.err;
  EXPECT_GE(killed, 4);
  EXPECT_THAT(digests(folder_ / "run"), ElementsAreArray(whole));
}

// Islands go on one by one: who is ahead depends on the farm, what they come to does not.
class AsynchronousPurity : public RunPurity, public testing::WithParamInterface<const char*> {};

std::string kind_name(const testing::TestParamInfo<const char*>& kind) { return kind.param; }

INSTANTIATE_TEST_SUITE_P(Kinds, AsynchronousPurity,
                         testing::Values("genetic", "differential_evolution", "cma_es"), kind_name);

TEST_P(AsynchronousPurity, HoldsForAnyNumberOfWorkersWhileTheyAreKilled) {
  std::ofstream(config_) << demo_config(
      24, 3, kMoreGenes,
      "asynchronous = true\nislands = 4\n[evolution.stop]\ngenerations = " +
          std::to_string(kGenerations) + "\n[optimiser]\npopulation = 24\nkind = \"" + GetParam() +
          "\"\n");
  const Digests one = evolved("one", {"--workers", "1"});
  ASSERT_THAT(one, SizeIs(kGenerations));
  EXPECT_THAT(evolved("two", {"--workers", "2", "--shuffle", "5"}), ElementsAreArray(one));
  // One more often than once a second.
  {
    RunningProgram master("gapfarm", evolve("seven", {"--workers", "7"}));
    int killed = 0;
    for (std::size_t generation = 1; generation < kGenerations; ++generation) {
      ASSERT_TRUE(wait_until([&] { return digests(folder_ / "seven").size() >= generation; }));
      for (const pid_t worker : children(master.pid())) {
        killed += ::kill(worker, SIGKILL) == 0 ? 1 : 0;
        break;
      }
    }
    const Finished finished = master.wait();
    EXPECT_EQ(finished.exit_code, 0) << finished.err;
    EXPECT_GE(killed, 4);
    EXPECT_THAT(digests(folder_ / "seven"), ElementsAreArray(one));
  }
  EXPECT_THAT(resumed_after_a_kill(), ElementsAreArray(one));
}

// Each row of the table of optimisers beside the genetic algorithm, with every phase of it.
class OptimiserPurity : public RunPurity, public testing::WithParamInterface<const char*> {};

INSTANTIATE_TEST_SUITE_P(Kinds, OptimiserPurity,
                         testing::Values("differential_evolution", "cma_es", "local", "de_simplex",
                                         "random"),
                         kind_name);

TEST_P(OptimiserPurity, HoldsForAnyNumberOfWorkersAndWhenKilled) {
  std::ofstream(config_, std::ios::app)
      << "[optimiser]\nkind = \"" << GetParam() << "\"\npopulation = 6\niterations = 4\n";
  const Digests one = evolved("one", {"--workers", "1"});
  ASSERT_THAT(one, SizeIs(kGenerations));
  EXPECT_THAT(evolved("two", {"--workers", "2"}), ElementsAreArray(one));
  EXPECT_THAT(evolved("four", {"--workers", "4", "--shuffle", "5"}), ElementsAreArray(one));
  EXPECT_THAT(resumed_after_a_kill(), ElementsAreArray(one));
}

// Of several objectives, the front and its hypervolume, too.
TEST_F(RunPurity, HoldsOfAFrontForAnyNumberOfWorkersAndKills) {
  std::ofstream(config_, std::ios::app) << "[fitness]\nobjectives = [\"position\", \"heading\"]\n"
                                           "[optimiser]\nkind = \"nsga2\"\n";
  const Digests one = evolved("one", {"--workers", "1"});
  ASSERT_THAT(one, SizeIs(kGenerations));
  EXPECT_THAT(evolved("two", {"--workers", "2"}), ElementsAreArray(one));
  EXPECT_THAT(evolved("seven", {"--workers", "7", "--shuffle", "5"}), ElementsAreArray(one));
  RunningProgram master("gapfarm", evolve("run", {"--generations", "10000", "--workers", "2"}));
  for (std::size_t generation = 1; generation <= 3; ++generation) {
    ASSERT_TRUE(wait_until([&] { return digests(folder_ / "run").size() >= generation; }));
    for (const pid_t worker : children(master.pid())) ::kill(worker, SIGKILL);
  }
  master.send(SIGKILL);
  master.wait();
  const std::string last = std::to_string(std::min(digests(folder_ / "run").size(), kGenerations));
  EXPECT_THAT(resumed("run", {"--generation", last, "--generations", std::to_string(kGenerations)}),
              ElementsAreArray(one));
  const auto front = [&](const std::string& run) { return status_of(folder_ / run)["front"]; };
  EXPECT_EQ(front("run"), front("one"));
  EXPECT_EQ(front("one")["objectives"].size(), 2u);
  EXPECT_EQ(front("one")["hypervolume"].size(), kGenerations);
  EXPECT_GT(front("one")["members"].size(), 1u);
}

}  // namespace gapfarm::run_purity_test
