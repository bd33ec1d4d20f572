// Fleets and suspended workers, as the scheduler sees them.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "master/farm/scheduler.h"

namespace gapfarm::fleet_messages_test {

class FleetMessages : public testing::Test {
 protected:
  FleetMessages() : scheduler_(options()) {}

  SchedulerOptions options() {
    SchedulerOptions options;
    options.epoch = 7;
    options.admittance.fingerprint = "build";
    options.on_event = [this](const FarmEvent& event) { events_.push_back(event); };
    return options;
  }
  void join(const std::string& name) {
    v1::Envelope envelope;
    v1::Hello* hello = envelope.mutable_hello();
    hello->set_name(name);
    hello->set_host("node");
    hello->set_fingerprint("build");
    hello->set_numeric_class("class");
    scheduler_.on_message(name, &envelope, now_);
  }
  void beat(const std::string& name) {
    v1::Envelope envelope;
    envelope.mutable_heartbeat()->set_epoch(7);
    for (const std::uint64_t attempt : held_[name]) {
      envelope.mutable_heartbeat()->add_attempts(attempt);
    }
    scheduler_.on_message(name, &envelope, now_);
  }
  void start(std::size_t tasks) {
    std::vector<v1::Task> all(tasks);
    for (std::size_t i = 0; i < tasks; ++i) {
      all[i].mutable_echo()->set_payload(std::to_string(i));
    }
    scheduler_.start("", all);
  }
  std::vector<Outgoing> tick(double now) {
    now_ = now;
    scheduler_.on_tick(now);
    std::vector<Outgoing> out;
    out.swap(scheduler_.outbox());
    for (const Outgoing& one : out) {
      for (const v1::Job& job : one.envelope.batch().jobs()) {
        held_[one.peer].push_back(job.attempt_id());
        given_[one.peer].insert(job.job_id());
      }
    }
    return out;
  }
  std::vector<Outgoing> report(const std::string& why) {
    v1::Envelope envelope;
    v1::Fleet* fleet = envelope.mutable_fleet();
    fleet->set_name("gf01234567");
    fleet->set_system("slurm");
    fleet->set_wanted(8);
    fleet->set_queued(1);
    fleet->set_why(why);
    scheduler_.on_message("manager", &envelope, now_);
    std::vector<Outgoing> out;
    out.swap(scheduler_.outbox());
    return out;
  }

  double now_ = 0;
  std::map<std::string, std::vector<std::uint64_t>> held_;  // attempts, by worker
  std::map<std::string, std::set<std::uint64_t>> given_;    // jobs, by worker
  std::vector<FarmEvent> events_;
  Scheduler scheduler_;
};

TEST_F(FleetMessages, AFleetLearnsTheBacklogAndItsOwnWorkers) {
  start(3);
  join("gf01234567-4711_0-88-abcdef-1.1");
  join("gf01234567-4711_1-89-abcdef-1.1");
  join("another-4711_0-90-abcdef-1.1");
  tick(0.1);
  const auto out = report("");
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].peer, "manager");
  const v1::Backlog& backlog = out[0].envelope.backlog();
  EXPECT_EQ(backlog.unfinished(), 3u);
  EXPECT_EQ(backlog.workers_size(), 2);
  for (const auto& worker : backlog.workers()) EXPECT_FALSE(worker.idle()) << worker.name();
}

TEST_F(FleetMessages, StatusHasWhatAFleetReportsWhileItReports) {
  report("the site allows no more than 4 jobs");
  tick(1);
  ASSERT_EQ(scheduler_.fleet_status().size(), 1u);
  EXPECT_EQ(scheduler_.fleet_status()[0].wanted, 8u);
  EXPECT_EQ(scheduler_.fleet_status()[0].why, "the site allows no more than 4 jobs");
  for (double now = 2; now < 200; ++now) tick(now);
  EXPECT_TRUE(scheduler_.fleet_status().empty());
}

TEST_F(FleetMessages, FleetsAndWorkersLearnThatTheRunIsOverAndTheMasterThatTheyKnow) {
  report("");
  join("worker");
  join("gone");
  tick(0.1);
  EXPECT_TRUE(scheduler_.goodbye_is_answered());
  scheduler_.send_goodbye("the run is over", true);
  std::vector<Outgoing> out;
  out.swap(scheduler_.outbox());
  ASSERT_EQ(out.size(), 3u);
  for (const Outgoing& one : out) EXPECT_TRUE(one.envelope.goodbye().over()) << one.peer;
  beat("worker");  // was on its way: no answer
  v1::Envelope goodbye;
  goodbye.mutable_goodbye();
  scheduler_.on_message("manager", &goodbye, now_);
  scheduler_.on_unsent({{"gone", goodbye}});
  EXPECT_FALSE(scheduler_.goodbye_is_answered());
  scheduler_.on_message("worker", &goodbye, now_);
  EXPECT_TRUE(scheduler_.goodbye_is_answered());
}

TEST_F(FleetMessages, AReportWithoutANameIsRefused) {
  v1::Envelope envelope;
  envelope.mutable_fleet();
  scheduler_.on_message("manager", &envelope, 0);
  EXPECT_EQ(scheduler_.tally().malformed, 1u);
  EXPECT_TRUE(scheduler_.outbox().empty());
}

// As SIGSTOP and SIGCONT make it: nothing is heard for a minute, then the worker goes on.
TEST_F(FleetMessages, ASuspendedWorkersTasksGoToOthersAndItIsWelcomedBack) {
  start(2);
  join("a");
  tick(0);
  join("b");
  double now = 0;
  for (; now < 60; ++now) {
    beat("b");
    tick(now);
  }
  EXPECT_EQ(given_["b"], given_["a"]) << "what the suspended worker held";
  EXPECT_EQ(given_["b"].size(), 2u);
  // It goes on as if nothing had been, and is asked who it is.
  beat("a");
  const auto out = tick(now);
  EXPECT_TRUE(std::any_of(out.begin(), out.end(), [](const Outgoing& one) {
    return one.peer == "a" && one.envelope.has_hello_request();
  }));
  join("a");
  const FarmEvent& last = events_.back();
  EXPECT_EQ(last.kind, FarmEvent::kReturned);
  EXPECT_NE(last.text.find("60 s without a word"), std::string::npos) << last.text;
  EXPECT_EQ(scheduler_.workers().size(), 2u);
}

}  // namespace gapfarm::fleet_messages_test
