// A farm in virtual time: the real scheduler, the real worker sessions and the real wire format
// over a network that loses, doubles, delays and reorders, with workers that die, hang and come
// back. Everything follows from one seed.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <queue>
#include <random>
#include <string>
#include <vector>

#include "common/net/envelope.h"
#include "master/farm/farm.h"
#include "master/farm/socket_farm.h"
#include "worker/session.h"

namespace gapfarm {

struct FaultPlan {
  double drop = 0;          // probability of a message to get lost
  double duplicate = 0;     // and to arrive twice
  double delay_s = 0.002;   // mean of the exponential time a message takes; reorders
  unsigned deaths = 0;      // worker processes that end, at random times
  unsigned hangs = 0;       // workers that stop for a while and go on
  unsigned drains = 0;      // workers that are commanded to finish what they have and go
  unsigned partitions = 0;  // workers cut off for a while
  unsigned master_pauses = 0;
  unsigned master_restarts = 0;
  double lifetime_s = 0;   // mean of what workers are given; 0: they live for ever
  double span_s = 5;       // within which all of that happens
  double progress_s = 2;   // after which a supervisor kills a process whose task hangs
  double audit_share = 0;  // see CopyOptions
  double mistaken = 0;     // probability of an answer to name another job than its own
  unsigned window = SchedulerOptions{}.window;
  double heartbeat_s = 0.1;  // a tenth of the silence limit
};

class SimulatedFarm {
 public:
  SimulatedFarm(std::uint64_t seed, unsigned workers, const FaultPlan& faults);
  ~SimulatedFarm();

  // Runs the tasks to the end in virtual time, in `batches` of about equal size.  Echo tasks only;
  // busy_us is how long they take, the payload "crash" ends the process that works on it, and
  // "hang" never ends.  Empty: not done within `limit_s`.
  std::vector<v1::TaskResult> run(const std::vector<v1::Task>& tasks, std::size_t batches = 1,
                                  double limit_s = 2000);
  // As Farm::stream().  False: not done within `limit_s`, or `take` returned an error.  The master
  // must not be restarted.
  bool stream(std::vector<v1::Task> tasks, const Farm::TakeAnswer& take, double limit_s = 2000);
  // The worker in this place answers every task wrongly.
  void corrupt(unsigned place) { corrupt_ = place; }

  Scheduler& scheduler() { return *scheduler_; }
  double now() const { return now_; }
  // Answers of the last batch that were taken, of the present life of the master.
  std::uint64_t answers_taken() const { return taken() - taken_before_; }
  const std::vector<FarmEvent>& alarms() const { return alarms_; }

 private:
  struct Worker;
  struct MasterEnd;
  struct WorkerSide;
  using Event = std::function<void()>;

  void at(double time, Event event);
  double uniform(double low, double high);
  bool chance(double probability);
  void carry(const std::function<void()>& deliver);
  void plan_faults(const FaultPlan& faults);
  void start_master();
  void start_worker(unsigned place, const ProcessEnded& replaced);
  void end_worker(const std::shared_ptr<Worker>& worker, EndCause cause);
  void drop_work(Worker& worker);
  bool leaves(const std::shared_ptr<Worker>& worker);
  void finish_task(const std::shared_ptr<Worker>& worker, double wall);
  std::uint64_t taken() const;
  bool step();
  void step_master();
  void master_clock();
  void step_worker(const std::shared_ptr<Worker>& worker);
  void begin_next(const std::shared_ptr<Worker>& worker);
  std::shared_ptr<Worker> any_worker();

  struct Entry {
    double time;
    std::uint64_t order;
    Event event;
    bool operator>(const Entry& other) const {
      return time != other.time ? time > other.time : order > other.order;
    }
  };
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> events_;
  std::mt19937_64 random_;
  FaultPlan faults_;
  double now_ = 0;
  std::uint64_t order_ = 0;
  std::uint64_t epoch_ = 0;
  double master_away_until_ = 0;
  unsigned names_ = 0;
  std::vector<v1::Task> batch_;
  std::uint64_t taken_before_ = 0;
  std::optional<unsigned> corrupt_;
  std::vector<FarmEvent> alarms_;
  std::unique_ptr<Scheduler> scheduler_;
  std::unique_ptr<MasterEnd> master_end_;
  std::map<std::string, std::shared_ptr<Worker>> by_peer_;  // connections
  std::vector<std::shared_ptr<Worker>> places_;
};

}  // namespace gapfarm
