#include <algorithm>
#include <cmath>

#include "common/base/text.h"
#include "master/farm/sites/fleet.h"

namespace gapfarm {
namespace {

// Jobs in a row that ended before they joined, wherever they were, after which the whole site
// waits: one may be a bad node, and where a node cannot be named or avoided one is enough.
constexpr unsigned kManyFailures = 3;

std::string seconds_text(double seconds) { return formatted("%.0f s", seconds); }

// Those that go when `surplus` are not needed: the queue's first, its newest first, then whoever
// has nothing to do.
std::vector<std::string> dismissed(std::vector<FleetJob> jobs, std::size_t surplus) {
  std::erase_if(jobs, [](const FleetJob& job) {
    return job.state == JobState::kLeaving ||
           (job.state == JobState::kRunning && job.joined && !job.idle);
  });
  std::ranges::stable_sort(jobs, [](const FleetJob& a, const FleetJob& b) {
    if (a.state != b.state) return a.state == JobState::kQueued;
    return a.since_s > b.since_s;
  });
  std::vector<std::string> ids;
  for (std::size_t i = 0; i < std::min(surplus, jobs.size()); ++i) ids.push_back(jobs[i].id);
  return ids;
}

}  // namespace

void FleetMemory::strike(const std::string& node, const FleetLimits& limits, double now_s) {
  Strikes& strikes = strikes_[node];
  if (strikes.until_s > now_s) return;  // of the same wave
  strikes.last_s = now_s;
  const double wait = limits.backoff_s * std::pow(2.0, std::min(strikes.count, 30u));
  strikes.until_s = now_s + std::min(wait, limits.backoff_most_s);
  ++strikes.count;
}

void FleetMemory::note_accepted(unsigned jobs, unsigned standing) {
  stood_ = std::max(stood_, standing + jobs);
  refused_fewer_ = false;
  step_ = site_limit_ && step_ < ~0u / 2 ? 2 * step_ : ~0u;
  if (growth_ == 0 || standing + jobs < *site_limit_) return;
  growth_ *= 2;
  *site_limit_ += growth_;
}

void FleetMemory::note_site_limit(unsigned jobs, unsigned standing, const FleetLimits& limits,
                                  double now_s) {
  // Of n more one at least was too much.
  const unsigned room = standing + jobs - 1;
  refused_fewer_ = room < stood_ && !refused_fewer_;
  if (refused_fewer_) return note_failure(limits, now_s);
  stood_ = std::min(stood_, room);
  site_limit_ = room;
  site_limit_until_s_ = now_s + limits.limit_memory_s;
  step_ = std::max(1u, jobs / 2);
  growth_ = 0;
}

void FleetMemory::learn(const FleetLook& look, const FleetLimits& limits, double now_s) {
  if (site_limit_ && now_s >= site_limit_until_s_) {
    growth_ = 1;
    *site_limit_ += growth_;
    site_limit_until_s_ = now_s + limits.limit_memory_s;
  }
  for (const FleetJob& job : look.jobs) {
    if (!job.joined) continue;
    for (const std::string& place : {job.node, std::string()}) {
      const auto strikes = strikes_.find(place);
      if (strikes != strikes_.end() && job.since_s >= strikes->second.last_s) {
        strikes_.erase(strikes);
      }
    }
    if (job.since_s >= last_failure_s_) failures_ = 0;
  }
  for (const EndedJob& end : look.ended) {
    if (end.joined || end.ordered) continue;
    last_failure_s_ = now_s;
    const bool known = !end.node.empty() && limits.avoids_nodes;
    if (known) strike(end.node, limits, now_s);
    if (++failures_ >= kManyFailures || !known) strike("", limits, now_s);
  }
}

// Jobs that are useful now or were within limits.idle_s: generations follow one another after
// pauses in which nothing is left to do.
unsigned FleetMemory::demand(const FleetLook& look, const FleetLimits& limits, double now_s) {
  const auto jobs = [&](std::uint64_t workers) {
    return static_cast<unsigned>((workers + limits.workers_per_job - 1) / limits.workers_per_job);
  };
  const unsigned most = limits.max_workers / limits.workers_per_job;
  const std::uint64_t useful = std::min<std::uint64_t>(*look.unfinished, limits.max_workers);
  const unsigned now = std::min(most, std::max(jobs(limits.min_workers), jobs(useful)));
  while (!demand_.empty() && demand_.back().second <= now) demand_.pop_back();
  demand_.emplace_back(now_s, now);
  while (demand_.front().first < now_s - limits.idle_s) demand_.pop_front();
  return demand_.front().second;
}

FleetDecision decide(const FleetLook& look, const FleetLimits& limits, double now_s,
                     FleetMemory* memory) {
  FleetDecision decision;
  memory->learn(look, limits, now_s);
  for (const auto& [node, strikes] : memory->strikes_) {
    if (!node.empty() && strikes.until_s > now_s) decision.avoid.push_back(node);
  }
  const unsigned standing = static_cast<unsigned>(look.jobs.size());
  decision.wanted = standing;
  if (!look.unfinished || !look.listed) {
    decision.why = look.listed ? "no master answers" : "the cluster does not list its jobs";
    return decision;
  }
  decision.wanted = memory->demand(look, limits, now_s);
  const auto leaving =
      static_cast<unsigned>(std::ranges::count(look.jobs, JobState::kLeaving, &FleetJob::state));
  if (standing - leaving > decision.wanted) {
    decision.cancel = dismissed(look.jobs, standing - leaving - decision.wanted);
    return decision;
  }
  // Whoever leaves still counts: it runs.
  if (standing >= decision.wanted) return decision;
  const auto site = memory->strikes_.find("");
  if (site != memory->strikes_.end() && site->second.until_s > now_s) {
    decision.why = "jobs ended at once or could not be submitted; the next try is in " +
                   seconds_text(site->second.until_s - now_s);
    return decision;
  }
  const unsigned room = memory->site_limit_.value_or(~0u);
  if (standing >= room) {
    decision.why = "the site allows no more than " + std::to_string(room) + " jobs";
    return decision;
  }
  decision.submit = std::min({decision.wanted - standing, room - standing, memory->step_});
  return decision;
}

}  // namespace gapfarm
