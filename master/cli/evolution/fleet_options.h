// Workers from a cluster: the options of commands, and the fleet that they make.
#pragma once

#include <CLI/CLI.hpp>
#include <vector>

#include "common/process/child.h"
#include "master/command/console.h"
#include "master/farm/sites/fleet.h"

namespace gapfarm {

struct FleetChoice {
  std::string system;  // of configs/sites/SYSTEM.toml
  std::string site;    // a file in its place
  FleetLimits limits = {.max_workers = 0};
  std::string wall_time;
  double look_interval_s = 0;  // 0: the site's
  std::vector<std::string> hosts;
  std::string ssh_config;
  std::string worker;  // program on the nodes
  std::string worker_keys;
  bool allow_external = false;
  std::string logs = "gapfarm-logs";
  unsigned block = 0;              // jobs in one submission; 0: the site's
  std::vector<std::string> extra;  // for the site's command

  // `with`: "--on", or "--workers-on" of commands that do it beside their work.
  void declare(CLI::App& app, const std::string& with);
  // Those that were given again, for a command line that has `with`.
  std::vector<std::string> arguments(const std::string& with) const;
  Result<ClusterSite> read_site() const;
  // Errors: no --max, a wall time that is none, a site that cannot be read.
  Status check() const;

 private:
  std::vector<const CLI::Option*> options_;  // but for the system's, of an app that outlives this
};

// "90", "1:30:00" or "2-00:00:00", in seconds.
Result<double> wall_time_s(const std::string& text);

Result<FleetLoopOptions> fleet_of(const FleetChoice& choice, const std::string& endpoint,
                                  const std::string& keys, bool insecure);

// Of jobs.
Status make_log_folder(const std::string& folder);

// `gapfarm workers` as a child, while it lives; then its workers are taken away.
Result<std::unique_ptr<OwnedChild>> start_workers_beside(const FleetChoice& choice,
                                                         const std::string& endpoint,
                                                         const std::string& keys, bool insecure);

}  // namespace gapfarm
