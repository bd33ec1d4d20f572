// What `gapfarm watch` found, as text, JSON and a page.
#pragma once

#include <string>
#include <vector>

#include "common/json/json.h"
#include "master/ground/watch/changes.h"

namespace gapfarm {

struct WatchedSkip {
  std::string robot;
  std::string run;  // empty: the whole robot
  std::string why;
};

struct WatchedRobot {
  std::string name;
  std::vector<std::string> runs = {};  // their names, in order
  std::vector<OffsetFit> fits = {};
  std::vector<double> times_s = {};        // at which runs begin
  std::vector<WatchedSkip> rejected = {};  // behind the last of these: runs that cannot be fitted
};

struct WatchedFleet {
  WatchedRows rows;
  std::vector<WatchedRobot> robots;
  std::vector<WatchedSkip> skipped;
  std::vector<std::string> notes;
  std::size_t fitted = 0;  // runs that were not at hand
};

std::string skip_text(const WatchedSkip& skip);
// A value did, a robot differs, or the last three runs or more of one are all rejected.
bool something_changed(const WatchedFleet& fleet, const FleetChanges& changes);
// "robot/run"; empty: nothing is to be looked at.
std::string first_to_look_at(const WatchedFleet& fleet, const FleetChanges& changes);
std::string watch_text(const WatchedFleet& fleet, const FleetChanges& changes);
Json watch_json(const WatchedFleet& fleet, const FleetChanges& changes);
std::string watch_page(const WatchedFleet& fleet, const FleetChanges& changes);

}  // namespace gapfarm
