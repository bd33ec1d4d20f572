// What may be wrong with a ground robot's file or log, one thing at a time: the catalogue of its
// diagnosis (docs/ground.md).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/recordings/run.h"
#include "common/robot/robot.h"

namespace gapfarm {

// A number of the kinematic model (common/score/kinematic.h).
struct KinematicRow {
  std::string name;
  double nominal = 0;
  // How far off the value of a well-kept file still is, as a standard deviation; also the size of
  // a step that shows in the motion.
  double tolerance = 0;
  std::string key;        // in a diagnosis: "ratio", "angle", "x"; "log" of a logarithm
  std::string unit;       // of the difference from nominal
  bool positive = false;  // below 0 it has no meaning
  double farthest = 0;    // how far off nominal it may be where it is asked for; 0: anywhere
  double step = 0.05;     // to find slopes, in tolerances
  bool tuned = false;     // to the log, whatever is named
};

// Below it the value has no meaning; -infinity: anywhere.
double least_value(const KinematicRow& row);

struct NamedEffect;
class WindowFitter;
struct FitRow;
struct WindowFit;

struct GroundHypothesis {
  std::string name;
  std::vector<std::string> aliases;  // other words for what logs cannot distinguish
  std::string thing;                 // "the radius of the right wheels"
  std::vector<KinematicRow> freed;
  // A log that is the wrong way round or in another unit, put right; empty: nothing to put right.
  std::function<void(RunLog*)> put_right = {};
  double metres = 1;  // logged positions times this are metres
  std::string remedy = {};
  double price = 0;            // nats that it must gain beyond those of its values
  bool of_world = false;       // acts in a place or along an axis of the world
  bool of_increments = false;  // of relative poses alone
  double radians = 1;          // logged headings times this are radians
  double kept = 0;  // of a change: so much of it comes and goes with where a robot drives
  // Parameters and text of the named effect; empty: its values' own.
  std::function<void(const WindowFitter&, const WindowFit&, std::uint64_t seed, NamedEffect*)>
      describe = {};
  // Values to begin at, where slopes at those that stand may not lead to the best; `rows` are those
  // of the fit and behind them its own.  Empty, or what was given: nowhere better.
  std::function<Eigen::VectorXd(const WindowFitter&, const WindowFit&,
                                const std::vector<FitRow>& rows, const Eigen::VectorXd& values)>
      propose = {};
  // Nats that a fit with its values gains over one without; empty: what the objectives differ by.
  std::function<double(const WindowFitter&, const WindowFit& with, const WindowFit& without)> gain =
      {};
};

// Standard deviation of a value that is wrong (kPlausibleErrors).
double plausible_error(const KinematicRow& row);

// Rows that every fit moves a little, within their tolerances.
std::vector<KinematicRow> kinematic_rows(const GroundRobot& robot);

// A row for the gyro's scale, where the log has one.
void add_gyro_scale(const RunLog& log, std::vector<KinematicRow>* rows);

// What a log may have the wrong way round or in another unit: all of it, of poses alone, and what
// is wrong with commands as poses show it.
std::vector<GroundHypothesis> wrong_log(const GroundRobot& robot);
std::vector<GroundHypothesis> wrong_poses();
std::vector<GroundHypothesis> wrong_sides_of_poses();

// Two floors in one log: beyond an edge, or within a patch, a wheel travels less far, or farther
// (common/score/kinematic_body.h).
GroundHypothesis floor_edge();
GroundHypothesis friction_patch();
// A floor that is not level: the robot goes farther than its wheels downhill, and less far uphill;
// a throttle is driven by its weight (common/score/kinematic.h).
GroundHypothesis floor_tilt();

// In the order in which equals are preferred: simple first.
std::vector<GroundHypothesis> ground_hypotheses(const GroundRobot& robot);

// Those that a log can show, in its words: of relative poses none that acts in a place or along an
// axis of the world.
std::vector<GroundHypothesis> that_can_show(const RunLog& log, std::vector<GroundHypothesis> all);

// The same of what may change from one log of a robot to another.  Tolerances are what a robot
// changes by when nobody touched it; tyres of cars, which slip sideways, have rows of their own.
std::vector<KinematicRow> change_rows(const GroundRobot& robot);
// `rows`: those of change_rows(), their nominals as another log has them.
std::vector<GroundHypothesis> change_hypotheses(const GroundRobot& robot,
                                                const std::vector<KinematicRow>& rows);

// A ramp stands for a lag, and so much of it as delays what this log commands no more than a lag of
// a well-kept file is off by is nothing that is wrong or changed.
void tolerate_ramps(const GroundRobot& robot, const RunLog& log,
                    std::vector<GroundHypothesis>* all);

// What the robot's file has of a row of either.
double value_in_file(const GroundRobot& robot, const std::string& name);

}  // namespace gapfarm
