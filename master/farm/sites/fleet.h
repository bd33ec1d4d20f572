// The workers that this process has on a cluster: what stands there, what is asked for, and why not
// all of it works.  Between the site's commands and the autoscaler.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/net/keys.h"
#include "common/process/child.h"
#include "common/process/stop.h"
#include "gapfarm/v1/farm.pb.h"
#include "master/farm/farm.h"

namespace gapfarm {

// How many workers to ask a cluster for: a function of what is to be done, of the jobs that stand,
// of limits and of a clock that is passed in.  No processes, no files, no sockets.

enum class JobState { kQueued, kRunning, kLeaving };  // leaving: it was asked to go

// One job of the cluster; it holds FleetLimits::workers_per_job workers.
struct FleetJob {
  std::string id;
  JobState state = JobState::kQueued;
  std::string node;     // empty: unknown
  double since_s = 0;   // it was submitted, or began to run
  bool joined = false;  // a worker of it has joined the master
  bool idle = false;    // no worker of it has a task
};

struct EndedJob {
  std::string id;
  std::string node;

  bool joined = false;   // a worker of it had joined the master
  bool ordered = false;  // it was asked to go
};

struct FleetLook {
  std::optional<std::uint64_t> unfinished;  // tasks without an answer; none: no master answers
  bool listed = true;                       // the cluster listed its jobs; else `jobs` is old
  std::vector<FleetJob> jobs;
  std::vector<EndedJob> ended;  // since the last look
};

struct FleetLimits {
  unsigned min_workers = 0;
  unsigned max_workers = 1;
  unsigned workers_per_job = 1;
  unsigned block = ~0u;      // jobs in one submission
  bool avoids_nodes = true;  // a submission can exclude nodes
  // Workers that are not needed for so long go.  Half of the minute that a worker may idle after
  // the last task; longer than the pause between two generations.
  double idle_s = 30;
  double backoff_s = 30;  // after a job that ended before a worker of it joined, then doubled
  double backoff_most_s = 3600;
  // A limit of the site that it showed by a refusal is tried again after so long: it may depend on
  // what else this user runs.
  double limit_memory_s = 600;
};

// What was learned in earlier looks.
class FleetMemory {
 public:
  // The site took, or refused for its limit on jobs, a submission of `jobs` while `standing` stood.
  // Refused once with fewer than stood before, the site waits as after a failure: HTCondor counts
  // jobs for a while that it lists no more.
  void note_accepted(unsigned jobs, unsigned standing);
  void note_site_limit(unsigned jobs, unsigned standing, const FleetLimits& limits, double now_s);
  // A submission failed for another reason.
  void note_failure(const FleetLimits& limits, double now_s) { strike("", limits, now_s); }

  // Jobs that the site allows, as far as it has shown.
  std::optional<unsigned> site_limit() const { return site_limit_; }

 private:
  friend struct FleetDecision decide(const FleetLook&, const FleetLimits&, double, FleetMemory*);
  struct Strikes {
    unsigned count = 0;
    double last_s = 0, until_s = 0;
  };
  void strike(const std::string& node, const FleetLimits& limits, double now_s);
  void learn(const FleetLook& look, const FleetLimits& limits, double now_s);
  unsigned demand(const FleetLook& look, const FleetLimits& limits, double now_s);

  std::map<std::string, Strikes> strikes_;  // by node; "": the whole site
  unsigned failures_ = 0;                   // in a row, since a job last began that joined
  double last_failure_s_ = 0;
  std::deque<std::pair<double, unsigned>> demand_;  // jobs wanted, lately: falling, by time
  std::optional<unsigned> site_limit_;
  double site_limit_until_s_ = 0;
  unsigned step_ = ~0u;         // jobs that the next submission tries
  unsigned growth_ = 0;         // of the limit while it is tried again; 0: it is not
  unsigned stood_ = 0;          // most jobs that the site has taken at once
  bool refused_fewer_ = false;  // the last submission was refused with fewer
};

struct FleetDecision {
  unsigned wanted = 0;              // jobs
  unsigned submit = 0;              // jobs
  std::vector<std::string> cancel;  // ids
  std::vector<std::string> avoid;   // nodes on which workers died at once
  std::string why;                  // fewer jobs than wanted stand and none is submitted; or empty
};

// Jobs that stand and are submitted are never more than limits.max_workers and the site's limit
// allow.  Without a master, or without a list, nothing changes.
FleetDecision decide(const FleetLook& look, const FleetLimits& limits, double now_s,
                     FleetMemory* memory);

// What one kind of cluster is: how a job of workers is submitted, listed and taken away there, as
// rows of a file under configs/sites (docs/launching.md).  Nothing else knows an engine by name.

// In commands and the script a {placeholder} stands for a value; an argument that is only one may
// stand for several or for none.
struct ClusterSite {
  std::string system;  // "slurm"
  // Where jobs are put by us and not by a scheduler.
  std::vector<std::string> hosts;
  unsigned jobs_per_host = 0;  // 0: any number

  std::vector<std::string> submit;  // {name}, {count}, {last}, {cores}, {node}, {wall}, {avoid} ...
  std::string script;               // its standard input; {worker} is the command
  bool script_a_job = false;        // the script is repeated, not the job
  unsigned block = 1000;  // jobs in a submission at most; Slurm's MaxArraySize is 1001 by default
  std::string submitted;  // pattern of the output: one match a job, or one for all
  std::string ids;        // {0}: what the pattern matched; {index}: of each in the block
  unsigned first_index = 0;
  std::string limit;                 // pattern of a refusal because of the number of jobs
  std::vector<std::string> wall;     // {seconds}, {minutes}
  std::vector<std::string> several;  // {cores}: where a job has more than one worker
  std::vector<std::string> avoid;    // {nodes}; empty: it cannot
  std::string nodes_between = ",";

  std::vector<std::string> list;     // {name}, {user}
  std::string line;                  // pattern of a job's line in it
  std::vector<std::string> columns;  // what its groups are: id, task, state, node, reason, name
  std::vector<std::string> queued, ended, stuck;  // states; all others run

  std::vector<std::string> cancel;  // {id}
  std::vector<std::string> log;     // {id}, {node}: prints a job's last lines

  // The master as a job of its own; none: cannot.
  std::vector<std::string> master;
  std::string requeue;  // what its script runs to be queued again

  std::string worker, keys;     // defaults on the nodes; empty: as here
  bool allow_external = false;  // workers may start what a master names
  double interval_s = 15;       // between two looks
  double backoff_s = 30;        // FleetLimits::backoff_s
};

// Errors name the file's lines.
Result<ClusterSite> parse_site(std::string_view text, const std::string& file);

// What each {placeholder} stands for.
using SiteValues = std::map<std::string, std::vector<std::string>>;

// ClusterSite::wall for so many seconds; none for 0.
std::vector<std::string> wall_arguments(const ClusterSite& site, double seconds);

// Every {placeholder} of `text` replaced; several values are lines of their own.  Unknown ones
// stay.
std::string expand(const std::string& text, const SiteValues& values);
std::vector<std::string> expand(const std::vector<std::string>& command, const SiteValues& values);

struct ListedJob {
  std::string id, state, node, reason;
  enum Standing { kQueued, kRuns, kStuck } standing = kRuns;
};

// Of the output of ClusterSite::list, the jobs of this name that stand.
std::vector<ListedJob> parse_list(const ClusterSite& site, const std::string& name,
                                  const std::string& output);
// Ids of the jobs of a submission of `count`, from its output; empty: not understood.
std::vector<std::string> parse_submitted(const ClusterSite& site, unsigned count,
                                         const std::string& output);
bool is_site_limit(const ClusterSite& site, const std::string& output);

struct FleetOptions {
  ClusterSite site;
  std::string name;  // of its jobs and, with a dash, the begin of its workers' names
  FleetLimits limits;
  std::vector<std::string> worker;  // program and arguments, but for --name
  std::string logs;                 // folder
  double wall_time_s = 0;           // of a job; 0: the site's
  std::vector<std::string> extra;   // for the command that submits
  std::vector<std::string> ssh;     // for the command that reaches a host
};

class Fleet {
 public:
  using Runner = std::function<Result<Captured>(const std::vector<std::string>& command,
                                                const std::string& input)>;
  // `note` is called with a sentence about something that happened, once for all of its kind.
  Fleet(FleetOptions options, Runner run, std::function<void(const std::string&)> note);

  // Which workers have joined, also between two looks: a pre-empted job may live for seconds.
  void hear(const v1::Backlog& backlog);
  // Asks the cluster what stands, and submits and takes away what the autoscaler wants.
  // `backlog`: null where no master answers.  Times are of one clock of the caller's.
  void look(const v1::Backlog* backlog, double now_s);
  // Takes away all that stands; true: nothing stands any more.
  bool drain(double now_s);

  FleetStatus status() const;
  // What a submission of `jobs` jobs would run, for --dry-run; of hosts, one on each.
  std::string submission_text(unsigned jobs) const;

 private:
  struct Known {
    FleetJob job;
    std::string reason;    // why it waits, in the cluster's terms
    double asked_s = 0;    // submitted, or first seen
    bool listed = false;   // was once
    bool ordered = false;  // to go
    bool refused = false;  // the command that was to take it away failed
    bool stuck = false;
  };
  SiteValues values() const;
  // False: nothing was learned.
  bool list(double now_s, std::vector<EndedJob>* ended);
  bool list_from(const std::string& host, double now_s, std::vector<EndedJob>* ended);
  void end(const Known& known, std::vector<EndedJob>* ended);
  void submit(const FleetDecision& decision, double now_s);
  // False: no further submission in this look.
  bool submit_block(unsigned count, const std::string& host, const FleetDecision& decision,
                    double now_s);
  std::string free_host(const std::vector<std::string>& avoided) const;
  void cancel(const std::vector<Known*>& all);
  void cancel_some(const std::vector<Known*>& some);
  std::string last_lines(const Known& known);
  void note_once(const std::string& text);

  FleetOptions options_;
  Runner run_;
  std::function<void(const std::string&)> note_;
  FleetMemory memory_;
  std::map<std::string, Known> known_;  // by id
  bool master_ = true;                  // answered at the last look
  unsigned wanted_ = 0;                 // jobs
  std::uint64_t lost_ = 0;
  std::string why_, noted_, noted_why_, last_death_;
};

// A fleet beside its master: reports to it, learns its backlog, and goes when it goes.
struct FleetLoopOptions {
  FleetOptions fleet;
  std::string endpoint;  // the master's
  LinkSecurity security;
  // Without a master for so long, jobs are taken away (their workers leave by themselves, too), and
  // the fleet waits for the next; after `master_limit_s` it ends.  A master that is moved to
  // another machine has had the time to start there by then.
  double wait_limit_s = 30;
  double master_limit_s = 600;
  // Taking away may take so long.
  double drain_limit_s = 60;
};

enum class FleetEnd { kMasterLeft, kNoMaster, kStopped };

// Runs until the master says goodbye, or is gone for too long, or `stop` is requested; then nothing
// stands any more.  Error: jobs that could not be taken away, or the master cannot be talked to.
Result<FleetEnd> run_fleet(const FleetLoopOptions& options, StopSource& stop,
                           const std::function<void(const std::string&)>& note);

}  // namespace gapfarm
