// The worker's half of the protocol: fed with messages and a clock, it says what to work on and
// what to send.  No sockets, no threads.
#pragma once

#include <cstdint>
#include <deque>
#include <limits>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/net/envelope.h"
#include "gapfarm/v1/farm.pb.h"

namespace gapfarm {

struct SessionOptions {
  // Who this is; what it holds and whether it leaves are the session's to say.
  v1::Hello hello;
  // Between two hellos without an answer, doubled up to the maximum and stretched by up to a half
  // at random, so that the workers of a restarted master do not all come at once.
  double hello_min_s = 0.02;
  double hello_max_s = 5;
  // When this worker must have gone (s of the caller's clock).  Work that would hardly be done by
  // then is not begun: what it has seen take longest, half as long again, and this margin.
  double deadline_s = std::numeric_limits<double>::infinity();
  double deadline_margin_s = 0.5;
};

// Attempt ids are the master's; another life of it may use them again.
struct AttemptKey {
  std::uint64_t epoch = 0;
  std::uint64_t attempt = 0;
  bool operator==(const AttemptKey&) const = default;
};

// A job that can be worked on.
struct Work {
  v1::Job job;
  std::shared_ptr<const std::string> problem;  // checked bytes; null: the task needs none
};

// Times are seconds of the caller's clock.
class WorkerSession {
 public:
  enum class State {
    kGreeting,  // no master, or it has not been heard of for too long
    kWorking,
    kDismissed,  // the master sent goodbye
    kRefused,    // for good; reason() says why
  };

  explicit WorkerSession(SessionOptions options) : options_(std::move(options)) {}

  // Events.  `envelope` is left in a valid but unknown state.
  void on_message(v1::Envelope* envelope, double now);
  void on_other_protocol(std::uint32_t protocol);
  // An answer, with its job's three ids.
  void on_finished(v1::JobResult result);
  // Work that was taken with take_work() will not be done.
  void on_dropped(const AttemptKey& key);
  void on_tick(double now);
  // `envelope` of the outbox did not go out.
  void on_unsent(v1::Envelope* envelope);
  enum class Leaving {
    kNo,
    kAfterCurrent,  // with the job that is in work; the others are dropped
    kAfterAll,      // with all that is in hand
  };
  // Takes no more jobs from now on.  on_tick() does the same, kAfterCurrent, as the deadline nears.
  void leave(Leaving how);
  Leaving leaving() const { return leaving_; }
  // After kDismissed: looks for a new master.
  void restart(double now);

  // Work taken earlier that is not wanted any more; then jobs to begin, in this order.
  std::vector<AttemptKey> take_cancelled();
  std::vector<Work> take_work();
  // To be sent in order.
  std::vector<v1::Envelope> take_outbox();
  // The last words; jobs not answered go to others.
  v1::Envelope goodbye(const std::string& reason) const;

  State state() const { return state_; }
  const std::string& reason() const { return reason_; }
  // The last master has left with all of its work done.
  bool over() const { return over_; }
  std::size_t in_hand() const { return in_hand_.size(); }
  double next_tick() const;

 private:
  void on_welcome(const v1::Welcome& welcome, double now);
  void on_job(v1::Job* job);
  void on_cancel(std::uint64_t attempt);
  void on_problem(v1::ProblemReply* reply);
  void answer_unknown(const std::string& hash);
  void ready(v1::Job* job, std::shared_ptr<const std::string> problem);
  void request_problem(const std::string& hash);
  void greet(double now);
  void drop_everything();
  void keep(const std::string& question, v1::JobResult* result);
  void offer_kept();
  void refuse_work();
  bool too_late(double now) const;
  std::shared_ptr<const std::string> known_problem(const std::string& hash);

  SessionOptions options_;
  State state_ = State::kGreeting;
  std::string reason_;
  bool over_ = false;
  std::uint64_t epoch_ = 0;  // of the master; 0: never welcomed
  double heartbeat_interval_ = 1;
  double silence_limit_ = 10;
  double last_heard_ = 0;
  double next_hello_ = 0;
  double hello_wait_ = 0;
  double next_heartbeat_ = 0;

  struct InHand {
    std::uint64_t job = 0;
    std::string question;  // question_hash()
  };
  std::map<std::uint64_t, InHand> in_hand_;             // by attempt; waiting, parked or begun
  std::map<std::string, std::vector<v1::Job>> parked_;  // by the problem that they wait for
  struct KnownProblem {
    std::string hash;
    std::shared_ptr<const std::string> bytes;
  };
  std::list<KnownProblem> problems_;  // latest used first
  std::vector<Work> work_;
  std::vector<AttemptKey> cancelled_;
  std::deque<v1::JobResult> results_;        // not sent yet
  std::map<std::uint64_t, InHand> sending_;  // of the results in the last outbox
  std::vector<std::uint64_t> dropped_;       // not sent yet
  // Work of a master that is gone: its answers are offered to the next one by their questions.
  struct Former {
    AttemptKey key;
    std::string question;
  };
  std::deque<Former> former_;  // not answered yet
  std::deque<v1::Offer::Answer> kept_;
  Leaving leaving_ = Leaving::kNo;
  double longest_wall_ = 0;  // s
  std::uint64_t hellos_ = 0;
  std::vector<v1::Envelope> outbox_;
};

// Moves messages between a transport and the worker's session.

// Handles what has arrived.  True: something had.
bool pump_in(Transport& transport, WorkerSession& session, double now);
// Sends what is to be sent.
void pump_out(Transport& transport, WorkerSession& session);

}  // namespace gapfarm
