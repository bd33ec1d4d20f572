#include "master/farm/sites/fleet.h"

#include <pwd.h>
#include <unistd.h>

#include <algorithm>
#include <limits>

#include "common/base/ranges.h"
#include "common/base/text.h"

namespace gapfarm {
namespace {

// Submissions in one look where the cluster takes less than is wanted at once.
constexpr unsigned kSubmissionsALook = 64;

std::string user_name() {
  const passwd* entry = getpwuid(geteuid());
  return entry == nullptr ? std::to_string(geteuid()) : entry->pw_name;
}

// What a failed command printed.
std::string complaint_of(const std::vector<std::string>& command, const Captured& captured) {
  std::string output(trimmed(captured.err.empty() ? captured.out : captured.err));
  if (captured.timed_out) output = "it did not answer in time";
  if (output.empty()) output = "it " + end_text(captured.status);
  return command.front() + ": " + output;
}

// The job of worker NAME-ID-PID-TAIL-PLACE.START of the fleet NAME.
std::string job_of(const std::string& fleet, const std::string& worker) {
  std::size_t end = worker.size();
  for (int i = 0; i < 3 && end != worker.npos && end > 0; ++i) end = worker.rfind('-', end - 1);
  if (end == worker.npos || end <= fleet.size() + 1) return "";
  return worker.substr(fleet.size() + 1, end - fleet.size() - 1);
}

}  // namespace

Fleet::Fleet(FleetOptions options, Runner run, std::function<void(const std::string&)> note)
    : options_(std::move(options)), run_(std::move(run)), note_(std::move(note)) {
  const ClusterSite& site = options_.site;
  options_.limits.avoids_nodes = !site.avoid.empty() || !site.hosts.empty();
  options_.limits.block = std::min(options_.limits.block, site.block);
}

SiteValues Fleet::values() const {
  const ClusterSite& site = options_.site;
  SiteValues values;
  std::string worker = joined(options_.worker, " ", shell_quoted);
  values["worker"] = {worker};
  values["name"] = {options_.name};
  values["cores"] = {std::to_string(options_.limits.workers_per_job)};
  values["logs"] = {options_.logs};
  values["extra"] = options_.extra;
  values["ssh"] = options_.ssh;
  values["user"] = {user_name()};
  values["wall"] = wall_arguments(site, options_.wall_time_s);
  values["avoid"] = {};
  values["several"] = {};
  if (options_.limits.workers_per_job > 1) values["several"] = expand(site.several, values);
  return values;
}

void Fleet::note_once(const std::string& text) {
  if (text == noted_) return;
  noted_ = text;
  note_(text);
}

std::string Fleet::last_lines(const Known& known) {
  if (options_.site.log.empty()) return "";
  SiteValues named = values();
  named["id"] = {known.job.id};
  named["node"] = {known.job.node};
  const auto captured = run_(expand(options_.site.log, named), "");
  return captured && captured->succeeded() ? std::string(trimmed(captured->out)) : "";
}

void Fleet::end(const Known& known, std::vector<EndedJob>* ended) {
  // Without a master workers leave by themselves.
  EndedJob end{known.job.id, known.job.node, known.job.joined,
               (known.ordered && !known.stuck) || !master_};
  if (!end.joined && !end.ordered) {
    ++lost_;
    const std::string lines = last_lines(known);
    last_death_ = "job " + end.id + (end.node.empty() ? "" : " on " + end.node) +
                  " ended before its worker joined the master" +
                  (!lines.empty()          ? "; the end of its log:\n  " + lines
                   : !known.reason.empty() ? "; the cluster's reason: " + known.reason
                                           : "; its log is empty: see what the cluster says of it");
    note_once(last_death_ +
              "\n  try the same command by hand where it ran: `gapfarm workers ... "
              "--dry-run` prints it");
  }
  ended->push_back(std::move(end));
}

bool Fleet::list_from(const std::string& host, double now_s, std::vector<EndedJob>* ended) {
  SiteValues named = values();
  named["node"] = {host};
  const auto command = expand(options_.site.list, named);
  const auto captured = run_(command, "");
  if (!captured || !captured->succeeded()) {
    note_once("cannot list jobs: " + (captured
                                          ? complaint_of(command, *captured)
                                          : command.front() + ": " + captured.error().message));
    return false;
  }
  std::map<std::string, ListedJob> listed;
  for (ListedJob& job : parse_list(options_.site, options_.name, captured->out)) {
    if (!host.empty()) job.node = host;
    listed[job.id] = std::move(job);
  }
  for (auto known = known_.begin(); known != known_.end();) {
    Known& one = known->second;
    const bool here = host.empty() || one.job.node == host;
    // A cluster may need a moment to list what it has just taken.
    const bool fresh = !one.listed && now_s - one.asked_s < options_.site.interval_s;
    if (!here || fresh || listed.contains(known->first)) {
      ++known;
      continue;
    }
    end(one, ended);
    known = known_.erase(known);
  }
  for (const auto& [id, job] : listed) {
    const auto [at, fresh] = known_.try_emplace(id);
    Known& one = at->second;
    if (fresh) {
      one.job.id = id;
      one.job.since_s = one.asked_s = now_s;
    }
    one.listed = true;
    one.reason = job.standing == ListedJob::kRuns ? "" : job.reason;
    if (!job.node.empty()) one.job.node = job.node;
    if (job.standing == ListedJob::kRuns && one.job.state == JobState::kQueued) {
      one.job.state = JobState::kRunning;
      one.job.since_s = now_s;
    }
    one.stuck = job.standing == ListedJob::kStuck;
    if (one.ordered) one.job.state = JobState::kLeaving;
  }
  return true;
}

bool Fleet::list(double now_s, std::vector<EndedJob>* ended) {
  if (options_.site.hosts.empty()) return list_from("", now_s, ended);
  bool any = false;
  for (const std::string& host : options_.site.hosts) any |= list_from(host, now_s, ended);
  return any;
}

void Fleet::hear(const v1::Backlog& backlog) {
  for (auto& [id, known] : known_) known.job.idle = known.job.joined;
  for (const v1::Backlog::Worker& worker : backlog.workers()) {
    const auto known = known_.find(job_of(options_.name, worker.name()));
    if (known == known_.end()) continue;
    FleetJob& job = known->second.job;
    if (!job.joined) job.idle = true;
    job.joined = true;
    job.idle &= worker.idle();
    // It runs, whatever was listed.
    if (job.state == JobState::kQueued) job.state = JobState::kRunning;
  }
}

// At once where the cluster takes many; on hosts one by one.
void Fleet::cancel(const std::vector<Known*>& all) {
  if (options_.site.hosts.empty()) return cancel_some(all);
  for (Known* one : all) cancel_some({one});
}

void Fleet::cancel_some(const std::vector<Known*>& some) {
  if (some.empty()) return;
  SiteValues named = values();
  for (Known* known : some) {
    known->ordered = true;
    known->job.state = JobState::kLeaving;
    named["id"].push_back(known->job.id);
  }
  named["node"] = {some.front()->job.node};
  const auto command = expand(options_.site.cancel, named);
  const auto captured = run_(command, "");
  const bool done = captured && captured->succeeded();
  const bool again = std::ranges::any_of(some, [](Known* one) { return one->refused; });
  for (Known* known : some) known->refused = !done;
  // One that has ended meanwhile makes it fail, too: the next look has those that still stand.
  if (done || !again) return;
  note_once("cannot take away job " + some.front()->job.id + ": " +
            (captured ? complaint_of(command, *captured) : captured.error().message));
}

std::string Fleet::free_host(const std::vector<std::string>& avoided) const {
  const ClusterSite& site = options_.site;
  std::string best;
  std::size_t fewest =
      site.jobs_per_host > 0 ? site.jobs_per_host : std::numeric_limits<std::size_t>::max();
  for (const std::string& host : site.hosts) {
    if (contains(avoided, host)) continue;
    const auto jobs = static_cast<std::size_t>(std::ranges::count_if(
        known_, [&](const auto& one) { return one.second.job.node == host; }));
    if (jobs >= fewest) continue;
    fewest = jobs;
    best = host;
  }
  return best;
}

bool Fleet::submit_block(unsigned count, const std::string& host, const FleetDecision& decision,
                         double now_s) {
  const ClusterSite& site = options_.site;
  SiteValues named = values();
  named["count"] = {std::to_string(count)};
  named["last"] = {std::to_string(count - 1)};
  named["node"] = {host};
  if (!decision.avoid.empty() && host.empty()) {
    named["avoid"] = expand(site.avoid, {{"nodes", {joined(decision.avoid, site.nodes_between)}}});
  }
  const auto command = expand(site.submit, named);
  std::string script;
  for (unsigned i = 0; i < (site.script_a_job ? count : 1); ++i) {
    named["index"] = {std::to_string(i)};
    script += expand(site.script, named);
  }
  const auto standing = static_cast<unsigned>(known_.size());
  const auto captured = run_(command, script);
  const std::string output = captured ? captured->out + captured->err : "";
  const auto ids = captured && captured->succeeded() ? parse_submitted(site, count, captured->out)
                                                     : std::vector<std::string>();
  if (ids.empty()) {
    if (captured && is_site_limit(site, output)) {
      memory_.note_site_limit(count, standing, options_.limits, now_s);
      return false;
    }
    why_ = "cannot submit: " + (captured ? complaint_of(command, *captured)
                                         : command.front() + ": " + captured.error().message);
    note_once(why_);
    memory_.note_failure(options_.limits, now_s);
    return false;
  }
  memory_.note_accepted(count, standing);
  for (const std::string& id : ids) {
    Known& known = known_[id];
    known.job.id = id;
    known.job.node = host;
    known.job.since_s = known.asked_s = now_s;
    if (!host.empty()) known.job.state = JobState::kRunning;
  }
  return true;
}

void Fleet::submit(const FleetDecision& decision, double now_s) {
  unsigned left = decision.submit;
  for (unsigned i = 0; i < kSubmissionsALook && left > 0; ++i) {
    unsigned count = std::min(left, options_.limits.block);
    std::string host;
    if (!options_.site.hosts.empty()) {
      host = free_host(decision.avoid);
      if (host.empty()) {
        why_ = decision.avoid.empty() ? "every host has its jobs"
                                      : "workers died at once on " + joined(decision.avoid, ", ");
        return;
      }
    }
    if (!submit_block(count, host, decision, now_s)) return;
    left -= count;
  }
}

void Fleet::look(const v1::Backlog* backlog, double now_s) {
  FleetLook look;
  master_ = backlog != nullptr;
  look.listed = list(now_s, &look.ended);
  if (backlog != nullptr) {
    hear(*backlog);
    look.unfinished = backlog->unfinished();
  }
  std::vector<Known*> leave;
  for (auto& [id, known] : known_) {
    if (known.refused || (known.stuck && !known.ordered)) leave.push_back(&known);
  }
  cancel(leave);
  leave.clear();
  for (const auto& [id, known] : known_) look.jobs.push_back(known.job);
  const FleetDecision decision = decide(look, options_.limits, now_s, &memory_);
  wanted_ = decision.wanted;
  why_ = decision.why;
  for (const std::string& id : decision.cancel) leave.push_back(&known_.at(id));
  cancel(leave);
  submit(decision, now_s);
  if (!decision.avoid.empty() && why_.empty()) {
    why_ = "workers died at once on " + joined(decision.avoid, ", ") + ", avoided for now";
  }
  for (const auto& [id, known] : known_) {
    if (!why_.empty()) break;
    if (known.job.state == JobState::kQueued && !known.reason.empty()) {
      why_ = "the cluster's reason: " + known.reason;
    }
  }
  if (!last_death_.empty() && decision.submit == 0 && !decision.why.empty()) {
    why_ += "; " + last_death_.substr(0, last_death_.find('\n'));
  }
  // The seconds of a wait are for `status`.
  const std::string kind = why_.substr(0, why_.find(';'));
  if (!kind.empty() && kind != noted_why_ && decision.wanted > known_.size()) note_(why_);
  noted_why_ = kind;
}

bool Fleet::drain(double now_s) {
  std::vector<EndedJob> ended;
  master_ = false;
  list(now_s, &ended);
  std::vector<Known*> leave;
  for (auto& [id, known] : known_) {
    if (known.refused || !known.ordered) leave.push_back(&known);
  }
  cancel(leave);
  wanted_ = 0;
  return known_.empty();
}

FleetStatus Fleet::status() const {
  FleetStatus status;
  status.name = options_.name;
  status.system = options_.site.system;
  status.wanted = wanted_ * options_.limits.workers_per_job;
  for (const auto& [id, known] : known_) {
    (known.job.state == JobState::kQueued ? status.queued : status.running) +=
        options_.limits.workers_per_job;
  }
  status.lost = lost_ * options_.limits.workers_per_job;
  status.why = why_;
  return status;
}

std::string Fleet::submission_text(unsigned jobs) const {
  const ClusterSite& site = options_.site;
  SiteValues named = values();
  const unsigned count = std::min(jobs, options_.limits.block);
  named["count"] = {std::to_string(count)};
  named["last"] = {std::to_string(count - 1)};
  named["index"] = {"0"};
  std::vector<std::string> nodes = site.hosts;
  nodes.resize(nodes.empty() ? 1 : std::min<std::size_t>(nodes.size(), jobs));
  std::string text;
  for (const std::string& node : nodes) {
    named["node"] = {node};
    text += joined(expand(site.submit, named), " ", shell_quoted) + " <<'EOF'\n" +
            expand(site.script, named) + "EOF\n";
  }
  return text;
}

}  // namespace gapfarm
