// A ground robot that follows logged commands: its drive compiled to contact patches.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/constants.h"
#include "common/recordings/run.h"
#include "common/robot/robot.h"
#include "common/robot/robot_drive.h"
#include "worker/sim/patches.h"
#include "worker/sim/robot/motion.h"
#include "worker/sim/step_counter.h"

namespace gapfarm {

// What is simulated beside the robot itself.
struct GroundWorld {
  double gravity_m_s2 = kGravity_m_s2;
  double step_rate_hz = 240;
  int solver_iterations = 10;
  double creep = 0;            // PatchSettings::creep
  double creep_speed_m_s = 0;  // PatchSettings::creep_speed_m_s
  // Four wheels on a stiff frame, on a floor that is not quite flat: how much more than their even
  // share of the weight front left and rear right carry, as a share; the others carry as much less.
  double cross_load = 0;
};

// One patch a wheel, two a tread.  Idle wheels hold across and roll along; omni and mecanum wheels
// hold along the axles of their rollers; casters hardly hold at all.  REQUIRES: a complete robot.
PatchSettings compile_patches(const GroundRobot& robot, const GroundWorld& world);
// What the patches do when the wheels do this, patch by patch.
void compile_motions(const GroundRobot& robot, std::span<const WheelMotion> wheels,
                     std::vector<PatchMotion>* patches);

struct GroundSample {
  double t_s = 0;
  Pose X_SR;            // robot in the start frame
  double travel_m = 0;  // of the wheels since the start: mean of their absolute speeds over time
};

struct GroundMotion : Extremes {
  MotionOutcome outcome = MotionOutcome::kOk;
  std::string message;                // why it did not end well, of who says so
  std::vector<GroundSample> samples;  // one a time asked for
};

struct GroundStart {
  double t_s = 0;  // on the commands' clock
  BodyTwist twist;
};

class PatchRobot;

class GroundSimulator {
 public:
  // `steps` (may be null) outlives the simulator.
  GroundSimulator(const GroundRobot& robot, const GroundWorld& world, StepCounter* steps = nullptr);
  ~GroundSimulator();

  // Follows the commands from the start to the last of `times` (ascending, none before the start).
  // A run that ends otherwise than well has no samples.  The same answer to the same question,
  // whatever was asked before.
  GroundMotion run(std::span<const CommandRow> commands, const GroundStart& start,
                   std::span<const double> times);

 private:
  GroundRobot robot_;
  GroundWorld world_;
  std::unique_ptr<PatchRobot> patches_;
};

}  // namespace gapfarm
