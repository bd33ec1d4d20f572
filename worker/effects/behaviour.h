// What each effect of the catalogue does: a row of drive.cc, floor.cc or camera.cc.
//
// A trial runs through three stages.  Drive effects change what the motors do, floor effects what
// the floor does to the robot, camera effects what is logged of a pose.  An effect fills only the
// hooks of its stage; every hook gets the effect's parameters in the catalogue's order and is
// called only when they are not neutral.
#pragma once

#include <span>
#include <vector>

#include "common/effects/catalogue.h"
#include "common/parameters/table.h"
#include "common/pose/pose.h"
#include "common/random/stream.h"
#include "worker/sim/robot/motion.h"

namespace gapfarm {

struct PushSettings;  // worker/sim/push/push.h

using EffectValues = std::span<const double>;

// What an effect may look at beside the command (EffectContext).
struct Situation {
  Pose X_WR;  // the robot's true pose before the trial
  double session_time_s = 0;
  int last_left = 0;  // sign of each side's last duty in the session; 0: none yet
  int last_right = 0;
  bool moved = false;     // an unrecorded move came before the trial
  bool far_away = false;  // from all that lies at a place
};

// One side's motor on its way from duty to SideDrive.
struct SideState {
  double duty = 0;  // [-1, 1]
  double gain = 1;  // of the surface speed
  double lag_s = 0;
  double dead_travel_m = 0;

  bool operator==(const SideState&) const = default;
};

struct DriveState {
  SideState left, right;
  double duration_s = 0;

  bool operator==(const DriveState&) const = default;
};

// An alternative that a random drive effect may draw for a trial.
struct DriveBranch {
  double weight = 1;
  double left_gain = 1;
  double right_gain = 1;
};

// How logged poses are read.
struct Reading {
  double stale_share = 0;  // chance that an end pose is stale
  double stale_age_s = 0;  // how old a stale pose is
  double quantum_m = 0;    // grid that positions are rounded to; 0: none
};

struct EffectBehaviour {
  const char* name;
  void (*settings)(EffectValues p, SimSettings& settings) = nullptr;
  void (*push)(EffectValues p, PushSettings& settings) = nullptr;
  void (*drive)(EffectValues p, const Situation& situation, DriveState& drive) = nullptr;
  void (*floor)(EffectValues p, const Situation& situation, Floor& floor) = nullptr;
  // True pose to logged pose, without noise, and back.
  Pose (*observe)(EffectValues p, const Pose& X_WR) = nullptr;
  Pose (*recover)(EffectValues p, const Pose& X_WM) = nullptr;
  // Where the view jumps across a line: how far a pose lies beyond it, m, and values at which all
  // poses are seen as those of the one side are.
  double (*beyond)(EffectValues p, const Pose& X_WR) = nullptr;
  void (*one_side)(bool far, std::vector<double>& p) = nullptr;
  // A piece's start as the log would have it to where it truly starts, and back.
  Pose (*place)(EffectValues p, const Pose& X_WR) = nullptr;
  Pose (*unplace)(EffectValues p, const Pose& X_WR) = nullptr;
  // Random drive effects: all alternatives with their weights, and one drawn.
  std::vector<DriveBranch> (*branches)(EffectValues p) = nullptr;
  DriveBranch (*draw)(EffectValues p, Stream& stream) = nullptr;
  // Standard deviation of the gain that all trials of a session share.
  double (*session_spread)(EffectValues p) = nullptr;
  void (*reading)(EffectValues p, Reading& reading) = nullptr;
  // By how much the heading of a start may be misread: all alternatives, and one drawn.
  std::vector<StartTurn> (*start_turns)(EffectValues p, bool moved) = nullptr;
  double (*draw_start_turn)(EffectValues p, bool moved, Stream& stream) = nullptr;
};

// One row an effect of any catalogue, by its name.
std::span<const EffectBehaviour> drive_effects();
std::span<const EffectBehaviour> floor_effects();
std::span<const EffectBehaviour> camera_effects();

// The effects that are not neutral at some parameter values, ready to be applied.
class ActiveEffects {
 public:
  ActiveEffects(const ParameterTable& table, const ParameterValues& values);

  // Union of EffectContext over the active drive and floor effects: what the motion depends on.
  unsigned motion_context() const { return motion_context_; }
  bool any() const { return !active_.empty(); }

  void settings(SimSettings& settings) const;
  void push(PushSettings& settings) const;
  void drive(const Situation& situation, DriveState& drive) const;
  void floor(const Situation& situation, Floor& floor) const;
  Pose observe(Pose X_WR) const;
  Pose recover(Pose X_WM) const;
  // Lines across which the view jumps: how far a pose lies beyond each, m, seen as from these sides
  // of them (bit k: beyond line k), and the same effects seen so.  As observe() has it, what lies
  // nearer to the robot has shifted the pose by then.
  std::vector<double> beyond_lines(Pose X_WR, unsigned sides) const;
  ActiveEffects seen_from(unsigned sides) const;
  Pose place(Pose X_WR) const;
  Pose unplace(Pose X_WR) const;
  std::vector<DriveBranch> branches() const;  // at least the one in which nothing happens
  DriveBranch draw(Stream& stream) const;
  double session_spread() const;
  Reading reading() const;
  std::vector<StartTurn> start_turns(bool moved) const;  // at least the one without a turn
  double draw_start_turn(bool moved, Stream& stream) const;

 private:
  struct Active {
    const EffectBehaviour* behaviour;
    std::vector<double> values;
  };

  template <class Hook, class Call>
  void each(Hook EffectBehaviour::*hook, Call call) const;

  std::vector<Active> active_;
  unsigned motion_context_ = kNoContext;
};

}  // namespace gapfarm
