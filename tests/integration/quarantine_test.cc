// What a run keeps of its troubles: genomes that were given up, answers that differ.  None of it is
// forgotten by the masters that come after.
#include <gmock/gmock.h>
#include <poll.h>
#include <signal.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "tests/integration/run_program.h"

namespace gapfarm::quarantine_test {

using nlohmann::json;
using ::testing::HasSubstr;

constexpr int kQuarantined = 3;
constexpr int kStopped = 85;

// The workers that have been given a job, from a log of level debug.
std::set<std::string> employed(const std::string& log) {
  std::set<std::string> names;
  std::istringstream in(log);
  for (std::string line; std::getline(in, line);) {
    const json entry = json::parse(line, nullptr, false);
    if (entry.is_object() && entry.value("text", "") == "job given out") {
      names.insert(entry.value("worker", ""));
    }
  }
  return names;
}

class Quarantine : public ::testing::Test {
 protected:
  json status() const { return status_of(run_); }

  Finished resume() const {
    return gapfarm_command({"resume", run_, "--generations", "2", "--workers", "1"});
  }

  const TemporaryFolder folder_;
  const std::string run_ = folder_ / "run";
  // Evaluations long enough to be met at work.
  const std::string config_ = folder_.write("run.toml", "trials = [\"" GAPFARM_SOURCE_DIR
                                                        "/configs/demo/trials.csv\"]\n"
                                                        "[genes]\n"
                                                        "friction = [0.1, 1.5]\n"
                                                        "full_speed = [0.1, 0.6]\n"
                                                        "[spread]\n"
                                                        "kind = \"sampled\"\n"
                                                        "replicates = 20\n"
                                                        "[evolution]\n"
                                                        "population = 4\n");
};

TEST_F(Quarantine, IsReportedAndOutlivesTheMaster) {
  RunningProgram master(
      "gapfarm", {"evolve", config_, "--out", run_, "--generations", "1000000", "--workers", "1",
                  "--log-format", "json", "--log-level", "debug"});
  // Whoever has taken up work crashes.  The task goes to the next one, first of all.
  std::size_t ended = 0;
  while (status().value("quarantined", 0) == 0) {
    ASSERT_FALSE(master.ended()) << master.err();
    ::poll(nullptr, 0, 20);
    const std::size_t seen = employed(master.err()).size();
    if (seen == ended) continue;
    ended = seen;
    for (const pid_t worker : children(master.pid())) ::kill(worker, SIGSEGV);
  }
  while (status().value("generation", 0) == 0) {
    ASSERT_FALSE(master.ended()) << master.err();
    ::poll(nullptr, 0, 20);
  }
  master.send(SIGINT);
  EXPECT_EQ(master.wait().exit_code, kStopped);

  const json stopped = status();
  EXPECT_EQ(stopped["quarantined"], 1);
  ASSERT_EQ(stopped["incidents"].size(), 1u);
  EXPECT_EQ(stopped["incidents"][0]["kind"], "quarantine");
  EXPECT_EQ(stopped["incidents"][0]["generation"], 1);
  EXPECT_THAT(stopped["incidents"][0]["text"].get<std::string>(), HasSubstr("evaluation of birth"));
  EXPECT_THAT(stopped["incidents"][0]["text"].get<std::string>(), HasSubstr("crashed"));
  EXPECT_GE(stopped["farm"]["retries"], 2);

  const Finished resumed = resume();
  EXPECT_EQ(resumed.exit_code, kQuarantined) << "that run ended with something given up";
  EXPECT_THAT(resumed.err, HasSubstr("1 task was given up"));
  EXPECT_EQ(resume().exit_code, kQuarantined) << "also when there was nothing left to do";
  const json finished = status();
  EXPECT_EQ(finished["state"], "finished");
  EXPECT_EQ(finished["quarantined"], 1);
  EXPECT_EQ(finished["incidents"], stopped["incidents"]);
  EXPECT_GE(finished["farm"]["retries"], stopped["farm"]["retries"]);
  const std::string screen = gapfarm_command({"status", run_}).out;
  EXPECT_THAT(screen, HasSubstr("given up    1 task\n"));
  EXPECT_THAT(screen, HasSubstr("generation 1: evaluation of birth"));
}

// One of two machines computes wrongly, and everything is done twice.
TEST_F(Quarantine, AnAlarmNamesBothSides) {
  const std::string workers =
      folder_.write("workers.sh",
                    "#!/bin/sh\n"
                    "case \"$*\" in *-1.*) export GAPFARM_FAKE_ERROR=1e-9 ;; esac\n"
                    "exec " GAPFARM_BIN_DIR "/gapfarm-fake-worker \"$@\"\n");
  std::filesystem::permissions(workers, std::filesystem::perms::owner_all);
  std::ofstream(config_, std::ios::app) << "[farm]\naudit_share = 1.0\n";
  RunningProgram master(
      "gapfarm", {"evolve", config_, "--out", run_, "--generations", "1000000", "--workers", "2"},
      {"GAPFARM_WORKER=" + workers});
  while (status().value("incidents", json::array()).empty()) {
    ASSERT_FALSE(master.ended()) << master.err();
    ::poll(nullptr, 0, 20);
  }
  master.send(SIGINT);
  EXPECT_EQ(master.wait().exit_code, kStopped);
  const json stopped = status();
  EXPECT_EQ(stopped["incidents"][0]["kind"], "alarm");
  const std::string text = stopped["incidents"][0]["text"];
  EXPECT_THAT(text, HasSubstr("two answers"));
  EXPECT_THAT(text, HasSubstr("-1.1 on "));
  EXPECT_THAT(text, HasSubstr("-2.1 on "));
  EXPECT_GE(stopped["farm"]["alarms"], 1);
  EXPECT_GE(stopped["farm"]["compared"], stopped["farm"]["alarms"]);
  EXPECT_EQ(stopped["quarantined"], 0);
  EXPECT_THAT(gapfarm_command({"status", run_}).out, HasSubstr("alarms      two answers"));
}

}  // namespace gapfarm::quarantine_test
