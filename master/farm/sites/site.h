// What one kind of cluster is: how a job of workers is submitted, listed and taken away there, as
// rows of a file under configs/sites (docs/launching.md).  Nothing else knows an engine by name.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace gapfarm {

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

}  // namespace gapfarm
