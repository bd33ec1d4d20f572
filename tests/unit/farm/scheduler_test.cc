#include "master/farm/scheduler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/net/envelope.h"
#include "common/problem/problem.h"

namespace gapfarm::scheduler_test {

std::vector<v1::Task> echo_tasks(std::size_t count) {
  std::vector<v1::Task> tasks(count);
  for (std::size_t i = 0; i < count; ++i) tasks[i].mutable_echo()->set_payload(std::to_string(i));
  return tasks;
}

// The scheduler with hands on it: says things to it and looks at what it wants sent.
class Desk {
 public:
  explicit Desk(SchedulerOptions options = {}) : scheduler(complete(std::move(options), this)) {}

  static SchedulerOptions complete(SchedulerOptions options, Desk* desk) {
    options.epoch = 7;
    options.admittance.fingerprint = "build";
    options.on_event = [desk](const FarmEvent& event) { desk->events.push_back(event); };
    return options;
  }

  static v1::Hello hello(const std::string& name) {
    v1::Hello hello;
    hello.set_name(name);
    hello.set_fingerprint("build");
    hello.set_numeric_class("class");
    return hello;
  }

  void send(const std::string& peer, v1::Envelope envelope) {
    scheduler.on_message(peer, &envelope, now);
  }
  void send_hello(const std::string& peer, const v1::Hello& greeting) {
    v1::Envelope envelope;
    *envelope.mutable_hello() = greeting;
    send(peer, envelope);
  }
  void join(const std::string& name) { send_hello(name, hello(name)); }

  // The process of `name` is gone, with this attempt in work.
  void end(const std::string& name, EndCause cause, std::uint64_t attempt, const std::string& text,
           const std::string& failure = "") {
    ProcessEnded end;
    end.name = name;
    end.cause = cause;
    end.epoch = 7;
    end.attempt = attempt;
    end.text = text;
    end.failure = failure;
    scheduler.on_process_end(end);
  }

  void answer(const std::string& peer, const v1::Job& job, std::uint64_t epoch = 7,
              v1::Outcome outcome = v1::OK) {
    v1::Envelope envelope;
    v1::JobResult* result = envelope.mutable_results()->add_results();
    result->set_job_id(job.job_id());
    result->set_attempt_id(job.attempt_id());
    result->set_epoch(epoch);
    result->mutable_result()->set_outcome(outcome);
    result->mutable_result()->set_echo(job.task().echo().payload());
    send(peer, envelope);
  }

  // What goes out now, jobs apart.
  std::vector<Outgoing> tick() {
    scheduler.on_tick(now);
    return std::exchange(scheduler.outbox(), {});
  }
  std::vector<v1::Job> jobs_for(const std::string& peer) {
    std::vector<v1::Job> jobs;
    for (const Outgoing& out : tick()) {
      if (out.peer != peer) continue;
      for (const v1::Job& job : out.envelope.batch().jobs()) jobs.push_back(job);
    }
    return jobs;
  }
  bool reported(FarmEvent::Kind kind) const {
    return std::ranges::count(events, kind, &FarmEvent::kind) > 0;
  }

  // Of the batch, which ends.
  std::vector<v1::TaskResult> results() {
    std::vector<v1::TaskResult> results(scheduler.progress().total);
    for (auto& [place, result] : scheduler.take_answers()) results[place] = std::move(result);
    scheduler.end();
    return results;
  }

  double now = 0;
  std::vector<FarmEvent> events;
  Scheduler scheduler;
};

TEST(Scheduler, KeepsAWindowFullAndAnswersInTheTasksOrder) {
  Desk desk;
  desk.scheduler.start("", echo_tasks(5));
  desk.join("a");
  std::vector<v1::Job> jobs = desk.jobs_for("a");
  ASSERT_EQ(jobs.size(), 2u);
  EXPECT_EQ(desk.jobs_for("a").size(), 0u) << "the window is full";
  std::vector<v1::Job> all;
  while (!jobs.empty()) {
    desk.answer("a", jobs.back());  // out of order
    jobs.pop_back();
    for (const v1::Job& job : desk.jobs_for("a")) jobs.push_back(job);
  }
  ASSERT_TRUE(desk.scheduler.finished());
  const auto results = desk.results();
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(results[i].echo(), std::to_string(i));
}

TEST(Scheduler, SpreadsAShortBatchOverAllWorkers) {
  Desk desk;
  desk.join("a");
  desk.join("b");
  desk.scheduler.start("", echo_tasks(2));
  std::set<std::string> peers;
  for (const Outgoing& out : desk.tick()) {
    if (out.envelope.has_batch()) peers.insert(out.peer);
  }
  EXPECT_EQ(peers, (std::set<std::string>{"a", "b"}));
}

TEST(Scheduler, RefusesOtherBuildsAndNumericClassesAndReportsWhy) {
  Desk desk;
  desk.join("a");
  v1::Hello other = Desk::hello("b");
  other.set_fingerprint("else");
  desk.send_hello("b", other);
  v1::Hello mixed = Desk::hello("c");
  mixed.set_numeric_class("other machine");
  desk.send_hello("c", mixed);
  desk.scheduler.on_other_protocol("d", 99);
  std::map<std::string, std::string> refusals;
  for (const Outgoing& out : desk.tick()) {
    if (out.envelope.has_refusal()) refusals[out.peer] = out.envelope.refusal().reason();
  }
  EXPECT_EQ(refusals.size(), 3u);
  EXPECT_NE(refusals["b"].find("else"), std::string::npos);
  EXPECT_NE(refusals["c"].find("other machine"), std::string::npos);
  EXPECT_NE(refusals["d"].find("99"), std::string::npos);
  EXPECT_EQ(desk.scheduler.workers().size(), 1u);

  SchedulerOptions tolerant;
  tolerant.admittance.allow_mixed_numeric_classes = true;
  Desk mixed_desk(tolerant);
  mixed_desk.join("a");
  mixed_desk.send_hello("c", mixed);
  EXPECT_EQ(mixed_desk.scheduler.workers().size(), 2u);
}

TEST(Scheduler, GivesASilentWorkersJobsToOthersWithoutBlame) {
  Desk desk;
  desk.scheduler.start("", echo_tasks(2));
  desk.join("a");
  const auto lost = desk.jobs_for("a");
  ASSERT_EQ(lost.size(), 2u);
  for (desk.now = 1; desk.now < 12; desk.now += 1) {
    desk.join("b");  // a hello now and then is a sign of life, too
    desk.scheduler.on_tick(desk.now);
  }
  EXPECT_TRUE(desk.reported(FarmEvent::kSilent));
  EXPECT_EQ(desk.scheduler.tally().retries, 2u);
  EXPECT_EQ(desk.scheduler.worker_status().at(0).name, "b");
  EXPECT_EQ(desk.scheduler.worker_status().at(0).jobs, 2u);
  // It was only cut off: unknown by now, it is asked who it is, and its answers do not count.
  desk.answer("a", lost[0]);
  bool asked = false;
  for (const Outgoing& out : desk.tick()) {
    asked |= out.peer == "a" && out.envelope.has_hello_request();
  }
  EXPECT_TRUE(asked);
  EXPECT_EQ(desk.scheduler.progress().done, 0u);
}

TEST(Scheduler, BlamesNobodyForTheMastersOwnAbsence) {
  Desk desk;
  desk.join("a");
  desk.tick();
  desk.now = 1000;
  desk.tick();
  EXPECT_EQ(desk.scheduler.workers().size(), 1u);
}

TEST(Scheduler, TakesNoAnswerTwiceNorFromAnotherEpochOrWorker) {
  Desk desk;
  desk.join("a");
  desk.join("b");
  desk.scheduler.start("", echo_tasks(1));
  std::string owner;
  v1::Job job;
  for (const Outgoing& out : desk.tick()) {
    if (!out.envelope.has_batch()) continue;
    owner = out.peer;
    job = out.envelope.batch().jobs(0);
  }
  desk.answer(owner, job, 6);
  desk.answer(owner == "a" ? "b" : "a", job);
  v1::Job wrong = job;
  wrong.set_job_id(job.job_id() + 1);
  desk.answer(owner, wrong);
  wrong = job;
  wrong.set_attempt_id(job.attempt_id() + 1000);
  desk.answer(owner, wrong);
  desk.answer(owner, job, 7, v1::OUTCOME_UNSPECIFIED);
  EXPECT_EQ(desk.scheduler.tally().foreign, 5u);
  EXPECT_FALSE(desk.scheduler.finished());
  desk.answer(owner, job, 7, v1::INVALID_REQUEST);
  desk.answer(owner, job);
  EXPECT_EQ(desk.scheduler.tally().late, 1u);
  EXPECT_EQ(desk.results()[0].outcome(), v1::INVALID_REQUEST);
  desk.scheduler.start("", echo_tasks(1));
  desk.answer(owner, job);
  EXPECT_FALSE(desk.scheduler.finished()) << "an answer of the batch before";
}

TEST(Scheduler, GivesToOthersWhatAWorkerAnsweredWithNonsense) {
  Desk desk;
  desk.join("liar");
  desk.scheduler.start("", echo_tasks(2));
  const auto lost = desk.jobs_for("liar");
  ASSERT_EQ(lost.size(), 2u);
  v1::Job wrong = lost[0];
  wrong.set_job_id(lost[1].job_id());
  desk.answer("liar", wrong);
  desk.answer("liar", lost[1], 7, v1::OUTCOME_UNSPECIFIED);
  v1::Envelope goodbye;
  goodbye.mutable_goodbye();
  desk.send("liar", goodbye);
  desk.join("honest");
  for (const v1::Job& job : desk.jobs_for("honest")) desk.answer("honest", job);
  EXPECT_TRUE(desk.scheduler.finished());
}

TEST(Scheduler, QuarantinesOnlyTheJobThatEndsItsWorkers) {
  Desk desk;
  desk.scheduler.start("", echo_tasks(3));
  std::string killer;
  for (int i = 0; i < 20 && !desk.scheduler.finished(); ++i) {
    const std::string name = "w" + std::to_string(i);
    desk.join(name);
    for (auto jobs = desk.jobs_for(name); !jobs.empty(); jobs = desk.jobs_for(name)) {
      // "1" ends its worker, but before that the worker's answer to "0" is lost with it.
      bool dies = false;
      for (const v1::Job& job : jobs) dies |= job.task().echo().payload() == "1";
      if (dies) {
        // The link is found broken first; how the process ended comes out later.
        desk.scheduler.on_unsent({Outgoing{name, {}}});
        std::uint64_t culprit = 0;
        for (const v1::Job& job : jobs) {
          if (job.task().echo().payload() == "1") culprit = job.attempt_id();
        }
        desk.end(name, EndCause::kCrashed, culprit, "signal 11");
        break;
      }
      for (const v1::Job& job : jobs) desk.answer(name, job);
    }
  }
  ASSERT_TRUE(desk.scheduler.finished());
  EXPECT_TRUE(desk.reported(FarmEvent::kQuarantined));
  EXPECT_EQ(desk.scheduler.given_up(), 1u);
  const auto results = desk.results();
  EXPECT_EQ(results[0].outcome(), v1::OK);
  EXPECT_EQ(results[1].outcome(), v1::WORKER_FAILED);
  EXPECT_EQ(results[2].outcome(), v1::OK);
}

TEST(Scheduler, ReportsWhatFailedAtWhichValuesAndHowToRepeatIt) {
  Problem problem;
  problem.values = problem.table().nominal();
  problem.commands = default_commands("srv1");
  problem.genes = {{row_of(Srv1::kFriction), 0.2, 1.0, ParameterScale::kLinear}};
  v1::Task task;
  task.mutable_evaluate()->mutable_point()->add_genome(0.25);
  task.mutable_evaluate()->mutable_stream()->set_birth_id(17);
  Desk desk;
  desk.scheduler.add_problem("p", serialise(to_proto(problem)));
  desk.scheduler.start("p", {task});
  for (const char* name : {"a", "b", "c"}) {
    desk.join(name);
    const auto jobs = desk.jobs_for(name);
    ASSERT_EQ(jobs.size(), 1u) << name;
    const bool first = std::string(name) == "a";
    desk.end(name, EndCause::kCrashed, jobs[0].attempt_id(), "ended",
             first ? "" : "it did not answer within 1 s\nby hand: ask it");
  }
  EXPECT_EQ(desk.events.back().kind, FarmEvent::kQuarantined);
  EXPECT_EQ(desk.events.back().text,
            "evaluation of birth 17 was given up: a on an unnamed host crashed, b on an unnamed "
            "host: it did not answer within 1 s, c on an unnamed host: the same; by hand: ask it; "
            "its values, for `gapfarm simulate CONFIG`: --set friction=0.4");
}

TEST(Scheduler, NeverBlamesAJobForPoliteExits) {
  Desk desk;
  desk.scheduler.start("", echo_tasks(1));
  for (int i = 0; i < 50; ++i) {
    const std::string name = "w" + std::to_string(i);
    desk.join(name);
    ASSERT_EQ(desk.jobs_for(name).size(), 1u);
    v1::Envelope goodbye;
    goodbye.mutable_goodbye();
    desk.send(name, goodbye);
    desk.end(name, EndCause::kLeft, 0, "exited with status 0");
  }
  EXPECT_FALSE(desk.scheduler.finished());
  EXPECT_EQ(desk.scheduler.given_up(), 0u);
}

TEST(Scheduler, AReturningWorkerKeepsWhatItStillHolds) {
  Desk desk;
  desk.scheduler.start("", echo_tasks(2));
  desk.join("a");
  const auto jobs = desk.jobs_for("a");
  ASSERT_EQ(jobs.size(), 2u);
  v1::Hello again = Desk::hello("a");
  again.set_epoch(7);
  again.add_attempts(jobs[0].attempt_id());
  desk.send_hello("a on a new connection", again);
  const auto sent = desk.jobs_for("a on a new connection");
  ASSERT_EQ(sent.size(), 1u) << "the lost one only";
  EXPECT_EQ(sent[0].job_id(), jobs[1].job_id());
  desk.answer("a on a new connection", jobs[0]);
  desk.answer("a on a new connection", jobs[1]);  // the first attempt got through after all
  EXPECT_TRUE(desk.scheduler.finished());
}

TEST(Scheduler, ShufflingChangesTheOrderOutButNotTheResults) {
  SchedulerOptions options;
  options.window = 100;
  options.shuffle_seed = 5;
  Desk desk(options);
  desk.join("a");
  desk.scheduler.start("", echo_tasks(50));
  const auto jobs = desk.jobs_for("a");
  ASSERT_EQ(jobs.size(), 50u);
  EXPECT_NE(jobs[0].task().echo().payload() + jobs[1].task().echo().payload(), "01");
  for (const v1::Job& job : jobs) desk.answer("a", job);
  const auto results = desk.results();
  for (std::size_t i = 0; i < 50; ++i) EXPECT_EQ(results[i].echo(), std::to_string(i));
}

TEST(Envelope, RejectsWhatIsNone) {
  v1::Envelope envelope;
  EXPECT_EQ(decode("garbage \xff\xff", &envelope), DecodeStatus::kMalformed);
  EXPECT_EQ(decode("", &envelope), DecodeStatus::kMalformed);
  v1::Envelope goodbye;
  goodbye.mutable_goodbye()->set_reason("x");
  const std::string bytes = encode(&goodbye);
  EXPECT_EQ(decode(bytes, &envelope), DecodeStatus::kOk);
  EXPECT_EQ(envelope.goodbye().reason(), "x");
  goodbye.set_protocol(kProtocol + 1);
  EXPECT_EQ(decode(goodbye.SerializeAsString(), &envelope), DecodeStatus::kOtherProtocol);
  v1::Envelope empty;
  EXPECT_EQ(decode(encode(&empty), &envelope), DecodeStatus::kMalformed);
}

// A worker that sends nonsense is refused, and what it held is done by others.
TEST(Scheduler, RefusesAWorkerWhoseAnswerIsNone) {
  std::vector<v1::Task> tasks(2);
  for (v1::Task& task : tasks) task.mutable_evaluate();
  Desk desk;
  desk.scheduler.start("p", tasks);
  desk.join("liar");
  const auto jobs = desk.jobs_for("liar");
  ASSERT_EQ(jobs.size(), 2u);
  v1::Envelope envelope;
  for (const v1::Job& job : jobs) {
    v1::JobResult* result = envelope.mutable_results()->add_results();
    result->set_job_id(job.job_id());
    result->set_attempt_id(job.attempt_id());
    result->set_epoch(job.epoch());
    result->mutable_result()->set_outcome(v1::OK);
    result->mutable_result()->mutable_evaluate()->set_fitness(
        std::numeric_limits<double>::quiet_NaN());
  }
  desk.send("liar", envelope);
  EXPECT_EQ(desk.scheduler.workers().size(), 0u);
  desk.tick();
  desk.join("honest");
  const auto again = desk.jobs_for("honest");
  ASSERT_EQ(again.size(), 2u);
}

}  // namespace gapfarm::scheduler_test
