// A night's trouble in a few seconds: workers and masters are killed with -9 at random, while a
// proxy drops, doubles, delays and reorders a tenth of all messages; what the run store holds in
// the end is what an undisturbed run would have left.  The longer version:
//   GAPFARM_SOAK_WORKERS=2000 GAPFARM_SOAK_MASTERS=200 test_soak
// GAPFARM_SOAK_SEED gives another course of events.
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>

#include <cstdlib>
#include <memory>
#include <random>

#include "master/store/database.h"
#include "tests/integration/demo_config.h"
#include "tests/integration/run_program.h"

namespace gapfarm::soak_test {

constexpr double kBetweenKills_s = 0.2;  // of workers, mean
constexpr int kKilled = 128 + SIGKILL;

std::uint64_t number_from(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

// Every value of the generations up to `last` and of their members, but for the time they took.
std::vector<std::string> contents(const std::string& run, std::int64_t last) {
  std::vector<std::string> rows;
  const auto database = Database::open(run + "/run.sqlite", Database::Mode::kQueryOnly);
  EXPECT_TRUE(database.ok());
  const std::string queries[] = {
      "SELECT generation, quote(best) || quote(mean) || quote(median) || quote(worst) || "
      "quote(diversity) || operator_probabilities || evaluations || '|' || quarantined || "
      "hex(optimiser_state) || digest FROM generations WHERE generation <= ? ORDER BY 1",
      "SELECT generation, rank || '|' || birth_id || hex(genome) || parameters || outcome || "
      "quote(fitness) || scores || parents || operators FROM individuals WHERE generation <= ? "
      "ORDER BY generation, rank"};
  for (const std::string& query : queries) {
    const auto read = [](const SqlStatement& row) {
      return std::to_string(row.integer(0)) + ": " + row.text(1);
    };
    const auto found = database->rows("compare runs", query, read, last);
    EXPECT_TRUE(found.ok()) << found.error().message;
    rows.insert(rows.end(), found->begin(), found->end());
  }
  return rows;
}

std::int64_t committed(const std::string& run) {
  const auto database = Database::open(run + "/run.sqlite", Database::Mode::kQueryOnly);
  if (!database) return 0;
  const auto last = database->integer("SELECT max(generation) FROM generations", "look");
  return last ? *last : 0;
}

class Soak : public ::testing::Test {
 protected:
  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }

  std::unique_ptr<RunningProgram> master(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--workers", "0", "--listen", master_end_});
    return std::make_unique<RunningProgram>("gapfarm", arguments);
  }

  std::vector<std::string> evolve(const std::string& run, std::int64_t generations) const {
    return {"evolve",      config_,         "--out",
            folder_ / run, "--generations", std::to_string(generations)};
  }

  // One of the running workers, not a supervisor.  False: there is none just now.
  bool kill_a_worker() {
    std::vector<pid_t> workers;
    for (const auto& supervisor : supervisors_) {
      for (const pid_t worker : children(supervisor->pid())) workers.push_back(worker);
    }
    if (workers.empty()) return false;
    if (::kill(workers[random_() % workers.size()], SIGKILL) != 0) return false;
    return ++killed_workers_ > 0;
  }

  void start_supervisors(unsigned hosts) {
    for (unsigned i = 0; i < hosts; ++i) {
      supervisors_.push_back(std::make_unique<RunningProgram>(
          "gapfarm-worker", std::vector<std::string>{"--connect", worker_end_, "--processes", "2",
                                                     "--name", "host" + std::to_string(i)}));
    }
  }

  // Before its first generation a run may exist half or not at all, and is begun again.
  std::unique_ptr<RunningProgram> restarted() const {
    const std::string run = folder_ / "run";
    if (committed(run) > 0) return master({"resume", run, "--generations", "1000000"});
    std::filesystem::remove_all(run);
    return master(evolve("run", 1000000));
  }

  // Kills workers and masters until enough have died.
  void disturb(std::uint64_t workers, std::uint64_t masters) {
    auto running = restarted();
    std::uint64_t killed_masters = 0;
    while (killed_workers_ < workers || killed_masters < masters) {
      ::poll(nullptr, 0, static_cast<int>(2000 * kBetweenKills_s * uniform()));
      // On a slow machine supervisors are long in starting workers; masters live on meanwhile.
      if (!kill_a_worker()) continue;
      // Spread over the kills of workers, a little at random.
      if (uniform() > 1.2 * static_cast<double>(masters) / static_cast<double>(workers)) continue;
      running->send(SIGKILL);
      ASSERT_EQ(running->wait().exit_code, kKilled);
      ++killed_masters;
      running = restarted();
    }
    running->send(SIGKILL);
    ASSERT_EQ(running->wait().exit_code, kKilled);
    RecordProperty("killed_workers", std::to_string(killed_workers_));
    RecordProperty("killed_masters", std::to_string(killed_masters + 1));
    std::printf("killed %lu workers and %lu masters\n", killed_workers_, killed_masters + 1);
  }

  const TemporaryFolder folder_;
  const std::string master_end_ = "ipc://" + folder_ / "master";
  const std::string worker_end_ = "ipc://" + folder_ / "workers";
  const std::uint64_t seed_ = number_from("GAPFARM_SOAK_SEED", 1);
  std::mt19937_64 random_{seed_};
  std::uint64_t killed_workers_ = 0;
  std::vector<std::unique_ptr<RunningProgram>> supervisors_;
  const std::string config_ = folder_.write("run.toml", demo_config(12, 3, kMoreGenes,
                                                                    "[farm]\n"
                                                                    "heartbeat_interval = 0.1\n"
                                                                    "silence_limit = 1.0\n"
                                                                    "audit_share = 0.05\n"));
};

TEST_F(Soak, LeavesTheBytesOfAnUndisturbedRun) {
  RunningProgram proxy("gapfarm-fault-proxy", {"--listen", worker_end_, "--connect", master_end_,
                                               "--seed", std::to_string(seed_), "--share", "0.1"});
  start_supervisors(2);
  disturb(number_from("GAPFARM_SOAK_WORKERS", 50), number_from("GAPFARM_SOAK_MASTERS", 5));
  if (HasFatalFailure()) return;

  // The last master is left in peace, but for the proxy, and comes to an end.
  const std::int64_t last = committed(folder_ / "run") + 1;
  const Finished finished =
      master({"resume", folder_ / "run", "--generations", std::to_string(last)})->wait();
  EXPECT_EQ(finished.exit_code, 0) << finished.err;
  EXPECT_EQ(finished.err.find("two answers"), std::string::npos) << finished.err;
  for (const auto& supervisor : supervisors_) {
    supervisor->send(SIGTERM);
    EXPECT_EQ(supervisor->wait().exit_code, 0);
  }
  proxy.send(SIGTERM);
  const Finished passed = proxy.wait();
  EXPECT_EQ(passed.exit_code, 0);

  std::vector<std::string> arguments = evolve("whole", last);
  arguments.insert(arguments.end(), {"--workers", "2"});
  ASSERT_EQ(gapfarm_command(arguments).exit_code, 0);
  const auto disturbed = contents(folder_ / "run", last);
  ASSERT_EQ(disturbed.size(), static_cast<std::size_t>(last) * 13);
  EXPECT_EQ(disturbed, contents(folder_ / "whole", last));
  std::printf("%ld generations; messages: %s", static_cast<long>(last), passed.out.c_str());
}

}  // namespace gapfarm::soak_test
