// The workers that this process has on a cluster: what stands there, what is asked for, and why not
// all of it works.  Between the site's commands and the autoscaler.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/net/keys.h"
#include "common/process/child.h"
#include "common/process/stop.h"
#include "gapfarm/v1/farm.pb.h"
#include "master/farm/farm.h"
#include "master/farm/sites/autoscaler.h"
#include "master/farm/sites/site.h"

namespace gapfarm {

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
