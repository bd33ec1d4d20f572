#include "worker/session.h"

#include <gtest/gtest.h>

#include "common/base/hash.h"

namespace gapfarm::session_test {

WorkerSession welcomed(std::uint64_t epoch = 3) {
  SessionOptions options;
  options.hello.set_name("w");
  WorkerSession session(options);
  session.on_tick(0);
  session.take_outbox();
  v1::Envelope welcome;
  welcome.mutable_welcome()->set_epoch(epoch);
  welcome.mutable_welcome()->set_heartbeat_interval(1);
  welcome.mutable_welcome()->set_silence_limit(10);
  session.on_message(&welcome, 0);
  return session;
}

void give(WorkerSession& session, std::uint64_t attempt, const std::string& hash,
          std::uint64_t epoch = 3) {
  v1::Envelope envelope;
  v1::Job* job = envelope.mutable_batch()->add_jobs();
  job->set_job_id(attempt);
  job->set_attempt_id(attempt);
  job->set_epoch(epoch);
  job->set_problem_hash(hash);
  job->mutable_task()->mutable_evaluate();
  session.on_message(&envelope, 0);
}

TEST(Session, GreetsWithBackOffUntilWelcomed) {
  WorkerSession session(SessionOptions{});
  int hellos = 0;
  for (double now = 0; now < 100; now = session.next_tick()) {
    session.on_tick(now);
    for (const v1::Envelope& envelope : session.take_outbox()) hellos += envelope.has_hello();
  }
  EXPECT_GT(hellos, 18);
  EXPECT_LT(hellos, 35);
}

TEST(Session, AsksOnceForAProblemAndChecksItsHash) {
  WorkerSession session = welcomed();
  const std::string bytes = "a problem";
  const std::string hash = content_hash(bytes);
  give(session, 1, hash);
  give(session, 2, hash);
  const auto asked = session.take_outbox();
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_EQ(asked[0].problem_request().hash(), hash);
  EXPECT_TRUE(session.take_work().empty());

  v1::Envelope reply;
  reply.mutable_problem_reply()->set_hash(hash);
  reply.mutable_problem_reply()->set_problem("damaged");
  session.on_message(&reply, 0);
  EXPECT_TRUE(session.take_work().empty());
  session.on_tick(1);
  bool asked_again = false;
  for (const auto& envelope : session.take_outbox()) asked_again |= envelope.has_problem_request();
  EXPECT_TRUE(asked_again);

  reply.mutable_problem_reply()->set_hash(hash);
  reply.mutable_problem_reply()->set_problem(bytes);
  session.on_message(&reply, 1);
  EXPECT_EQ(session.take_work().size(), 2u);
  give(session, 3, hash);
  EXPECT_EQ(session.take_work().size(), 1u) << "known by now";
}

TEST(Session, AnswersForAProblemThatNobodyKnows) {
  WorkerSession session = welcomed();
  give(session, 1, "0123");
  session.take_outbox();
  v1::Envelope reply;
  reply.mutable_problem_reply()->set_hash("0123");
  session.on_message(&reply, 0);
  const auto out = session.take_outbox();
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].results().results(0).result().outcome(), v1::INVALID_REQUEST);
}

TEST(Session, KeepsResultsThatDidNotGoOut) {
  WorkerSession session = welcomed();
  give(session, 1, "");
  ASSERT_EQ(session.take_work().size(), 1u);
  v1::JobResult result;
  result.set_job_id(1);
  result.set_attempt_id(1);
  result.set_epoch(3);
  session.on_finished(result);
  auto out = session.take_outbox();
  ASSERT_EQ(out.size(), 1u);
  session.on_unsent(&out[0]);
  EXPECT_EQ(session.in_hand(), 1u);
  EXPECT_TRUE(session.take_outbox().empty()) << "first hear who is there now";
  v1::Envelope welcome;
  welcome.mutable_welcome()->set_epoch(3);
  session.on_message(&welcome, 0);
  EXPECT_EQ(session.take_outbox().at(0).results().results_size(), 1);
  EXPECT_EQ(session.in_hand(), 0u);
}

TEST(Session, ForgetsTheWorkOfAnEarlierMaster) {
  WorkerSession session = welcomed(3);
  give(session, 1, "");
  ASSERT_EQ(session.take_work().size(), 1u);
  v1::Envelope welcome;
  welcome.mutable_welcome()->set_epoch(4);
  session.on_message(&welcome, 0);
  EXPECT_EQ(session.take_cancelled().size(), 1u);
  give(session, 1, "", 4);  // the new master counts from one again
  EXPECT_EQ(session.take_work().size(), 1u);
  v1::JobResult old;
  old.set_job_id(1);
  old.set_attempt_id(1);
  old.set_epoch(3);
  old.mutable_result()->set_outcome(v1::OK);
  session.on_finished(old);
  // Its answer counts for nobody's attempt, but whoever asks the same may have it.
  const auto out = session.take_outbox();
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].offer().answers_size(), 1);
  EXPECT_EQ(session.in_hand(), 1u);
  give(session, 9, "", 3);
  EXPECT_TRUE(session.take_work().empty()) << "late word of the earlier master";
}

TEST(Session, CancelDropsWhatWaits) {
  WorkerSession session = welcomed();
  give(session, 1, "unknown problem");
  give(session, 2, "");
  v1::Envelope cancel;
  cancel.mutable_cancel()->add_attempt_ids(1);
  cancel.mutable_cancel()->add_attempt_ids(2);
  session.on_message(&cancel, 0);
  EXPECT_TRUE(session.take_work().empty());
  EXPECT_EQ(session.in_hand(), 0u);
}

TEST(Session, ARefusalIsFinal) {
  WorkerSession session(SessionOptions{});
  v1::Envelope refusal;
  refusal.mutable_refusal()->set_reason("no");
  session.on_message(&refusal, 0);
  EXPECT_EQ(session.state(), WorkerSession::State::kRefused);
  session.on_tick(100);
  EXPECT_TRUE(session.take_outbox().empty());
}

}  // namespace gapfarm::session_test
