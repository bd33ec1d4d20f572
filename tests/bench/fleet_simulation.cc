#include "tests/bench/fleet_simulation.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <queue>
#include <set>
#include <string>

#include "common/random/stream.h"

namespace gapfarm {
namespace {

enum class What { kBatch, kLook, kStart, kReady, kDone, kEnd };

struct Event {
  double at_s;
  std::uint64_t order;
  What what;
  std::size_t job = 0;
  bool operator>(const Event& other) const {
    return std::tie(at_s, order) > std::tie(other.at_s, other.order);
  }
};

struct ClusterJob {
  JobState state = JobState::kQueued;
  double since_s = 0;
  double ends_s = 0;
  std::string node;
  bool joined = false, gone = false, ordered = false;
  unsigned busy = 0;  // workers with a task
};

class Cluster {
 public:
  explicit Cluster(const FleetScenario& scenario)
      : scenario_(scenario), stream_({scenario.seed, Purpose::kTest, 0, 0, 0}) {}

  FleetOutcome run() {
    at(0, What::kBatch);
    at(0, What::kLook);
    while (!events_.empty()) {
      const Event event = events_.top();
      events_.pop();
      now_s_ = event.at_s;
      handle(event);
      if (finished_ && standing_ == 0) break;
    }
    // Restarts that wall times demand of anybody.
    const double usable_s = scenario_.wall_time_s - scenario_.start_s;
    outcome_.oracle_s = work_s_ + std::ceil(work_s_ / usable_s) * scenario_.start_s;
    return outcome_;
  }

 private:
  unsigned width() const { return scenario_.limits.workers_per_job; }
  void at(double at_s, What what, std::size_t job = 0) {
    events_.push({at_s, order_++, what, job});
  }
  double exponential(double mean) { return -mean * std::log1p(-stream_.uniform()); }
  double task_time() {
    double sum = 0;
    for (int i = 0; i < 4; ++i) sum += exponential(scenario_.task_s / 4);
    return sum;
  }
  bool bad(std::size_t node) const {
    return static_cast<double>(node) < scenario_.bad_nodes * scenario_.nodes;
  }

  void handle(const Event& event) {
    switch (event.what) {
      case What::kBatch:
        pending_ += scenario_.batches[batch_];
        unfinished_ += scenario_.batches[batch_++];
        give_out();
        break;
      case What::kLook:
        look();
        break;
      case What::kStart:
        start(event.job);
        break;
      case What::kReady:
        ready(event.job);
        break;
      case What::kDone:
        done(event.job);
        break;
      case What::kEnd:
        end(event.job);
        break;
    }
  }

  void start(std::size_t index) {
    ClusterJob& job = jobs_[index];
    if (job.gone) return;
    std::size_t node = stream_.below(scenario_.nodes);
    for (int i = 0; i < 100 && avoided_.contains(std::to_string(node)); ++i) {
      node = stream_.below(scenario_.nodes);
    }
    job.node = std::to_string(node);
    job.state = JobState::kRunning;
    job.since_s = now_s_;
    job.ends_s = now_s_ + scenario_.wall_time_s;
    if (bad(node)) {
      job.ends_s = now_s_ + 1;
      ++outcome_.quick_ends;
      return at(job.ends_s, What::kEnd, index);
    }
    if (scenario_.preempted_after_s > 0) {
      const double taken_s = now_s_ + exponential(scenario_.preempted_after_s);
      if (taken_s < job.ends_s) {
        preempted_.insert(index);
        at(taken_s, What::kEnd, index);
      }
    }
    at(now_s_ + scenario_.start_s, What::kReady, index);
  }

  void ready(std::size_t index) {
    ClusterJob& job = jobs_[index];
    if (job.gone) return;
    job.joined = true;
    for (unsigned i = 0; i < width(); ++i) idle_.push_back(index);
    give_out();
  }

  // As --lifetime does: nothing is begun that would hardly be done in time.
  bool too_late(const ClusterJob& job) const {
    return now_s_ + 2 * scenario_.task_s > job.ends_s - 30;
  }

  void give_out() {
    while (pending_ > 0 && !idle_.empty()) {
      const std::size_t index = idle_.front();
      idle_.pop_front();
      ClusterJob& job = jobs_[index];
      if (job.gone || job.state == JobState::kLeaving || too_late(job)) {
        if (!job.gone && job.busy == 0) end(index);
        continue;
      }
      ++job.busy;
      --pending_;
      const double wall = task_time();
      work_s_ += wall;
      lost_.insert({index, wall});
      at(now_s_ + wall, What::kDone, index);
    }
  }

  void done(std::size_t index) {
    ClusterJob& job = jobs_[index];
    if (job.gone) return;
    lost_.erase(lost_.find(index));
    --job.busy;
    --unfinished_;
    if (unfinished_ == 0 && batch_ < scenario_.batches.size()) {
      at(now_s_ + scenario_.pause_s, What::kBatch);
    } else if (unfinished_ == 0) {
      finished_ = true;
      outcome_.span_s = now_s_;
    }
    if (job.state == JobState::kLeaving) {
      if (job.busy == 0) end(index);
      return;
    }
    idle_.push_back(index);
    give_out();
  }

  void end(std::size_t index) {
    ClusterJob& job = jobs_[index];
    if (job.gone) return;
    job.gone = true;
    --standing_;
    if (job.state == JobState::kQueued) return;
    if (preempted_.contains(index)) ++outcome_.preempted;
    outcome_.paid_s += width() * (now_s_ - job.since_s);
    if (finished_) {
      outcome_.idle_after_s =
          std::max(outcome_.idle_after_s, now_s_ - std::max(outcome_.span_s, job.since_s));
    }
    // What was in work is done again; who knows the future would not have begun it.
    const auto [first, last] = lost_.equal_range(index);
    for (auto lost = first; lost != last; ++lost) {
      work_s_ -= lost->second;
      ++pending_;
    }
    lost_.erase(first, last);
    ended_.push_back({std::to_string(index), job.node, job.joined, job.ordered});
    give_out();
  }

  void look() {
    FleetLook look;
    look.unfinished = unfinished_;
    look.ended = std::move(ended_);
    ended_.clear();
    FleetMoment moment{now_s_, 0, 0, 0};
    for (; first_ < jobs_.size() && jobs_[first_].gone; ++first_) {
    }
    for (std::size_t i = first_; i < jobs_.size(); ++i) {
      ClusterJob& job = jobs_[i];
      if (job.gone) continue;
      look.jobs.push_back({std::to_string(i), job.state, job.node, job.since_s, job.joined,
                           job.joined && job.busy == 0});
      (job.state == JobState::kQueued ? moment.queued : moment.running) += width();
    }
    const FleetDecision decision = decide(look, scenario_.limits, now_s_, &memory_);
    moment.wanted = decision.wanted * width();
    outcome_.moments.push_back(moment);
    avoided_ = {decision.avoid.begin(), decision.avoid.end()};
    for (const std::string& id : decision.cancel) order_away(std::stoul(id));
    if (decision.submit > 0) submit(decision.submit);
    // The run is over: the master says goodbye, and all that stands is taken away.
    if (!finished_) return at(now_s_ + scenario_.look_interval_s, What::kLook);
    for (std::size_t i = first_; i < jobs_.size(); ++i) order_away(i);
  }

  void order_away(std::size_t index) {
    ClusterJob& job = jobs_[index];
    if (job.gone) return;
    job.ordered = true;
    if (job.busy == 0) return end(index);
    job.state = JobState::kLeaving;
  }

  void submit(unsigned count) {
    ++outcome_.submissions;
    if (standing_ + count > scenario_.site_limit) {
      ++outcome_.refusals;
      memory_.note_site_limit(count, standing_, scenario_.limits, now_s_);
      return;
    }
    memory_.note_accepted(count, standing_);
    for (unsigned i = 0; i < count; ++i) {
      ClusterJob& job = jobs_.emplace_back();
      job.since_s = now_s_;
      at(now_s_ + scenario_.queue_wait_s * std::exp(stream_.normal()), What::kStart,
         jobs_.size() - 1);
    }
    standing_ += count;
    outcome_.jobs += count;
    outcome_.most_workers = std::max(outcome_.most_workers, standing_ * width());
  }

  const FleetScenario& scenario_;
  Stream stream_;
  FleetMemory memory_;
  FleetOutcome outcome_;
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
  std::uint64_t order_ = 0;
  double now_s_ = 0, work_s_ = 0;
  std::vector<ClusterJob> jobs_;
  std::size_t first_ = 0;  // no earlier job stands
  unsigned standing_ = 0;
  std::deque<std::size_t> idle_;             // jobs, one entry a worker without a task
  std::multimap<std::size_t, double> lost_;  // tasks in work, by job
  std::set<std::size_t> preempted_;
  std::set<std::string> avoided_;
  std::vector<EndedJob> ended_;
  std::uint64_t pending_ = 0, unfinished_ = 0;
  std::size_t batch_ = 0;
  bool finished_ = false;
};

}  // namespace

FleetOutcome simulate_fleet(const FleetScenario& scenario) { return Cluster(scenario).run(); }

FleetScenario large_fleet(std::uint64_t seed) {
  FleetScenario scenario;
  scenario.seed = seed;
  scenario.limits.max_workers = 10000;
  scenario.limits.workers_per_job = 8;
  scenario.batches = {200000, 100000, 2000, 150000};
  scenario.pause_s = 600;
  scenario.preempted_after_s = 2 * 3600;
  scenario.bad_nodes = 0.01;
  scenario.site_limit = seed % 2 == 0 ? 900 : 5000;
  return scenario;
}

}  // namespace gapfarm
