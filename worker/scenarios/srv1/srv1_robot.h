// From parameter values to what the simulator is built from, and one driven command.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "common/parameters/table.h"
#include "common/problem/problem.h"
#include "common/score/fitness.h"
#include "common/score/scale_mixture.h"
#include "common/trials/context.h"
#include "gapfarm/v1/task.pb.h"
#include "worker/effects/behaviour.h"
#include "worker/scenarios/motion_memo.h"
#include "worker/scenarios/scenario.h"
#include "worker/sim/robot/motion.h"
#include "worker/sim/robot/simulator.h"
#include "worker/sim/step_counter.h"

namespace gapfarm {

// All that a motion of the tracked robot depends on.
struct MotionKey {
  SimSettings settings;
  DriveInput drive;
  Floor floor;

  bool operator==(const MotionKey&) const = default;
  // Of what differs among the motions of one log and of the derivatives of its predictions.
  std::size_t hash() const;
};

class Vehicle {
 public:
  virtual ~Vehicle() = default;
  // From rest at the origin of S until it rests again.  When `path` is given, it receives a sample
  // every `interval_s` from t = 0, and one at rest.
  virtual Motion run(const DriveInput& drive, const Floor& floor, std::vector<MotionSample>* path,
                     double interval_s) = 0;
};

// Of the user's program.  One that fails throws ExternalFailure, which no ScenarioModel lets out.
std::unique_ptr<Vehicle> make_external_vehicle(const Problem& problem,
                                               const ParameterValues& values, StepCounter* steps);

struct NoiseSettings {
  double drive_common = 0;  // s.d. of both sides' gain, per trial
  double drive_side = 0;    // s.d. of each side's gain, per trial
  PoseNoise pose;
  NoiseTails tails = {};  // with tails the above are those of Student's t's core
};

// Gains of the two sides' speed in one trial.
struct Gains {
  double left = 1;
  double right = 1;
};

// Third-degree cubature of the drive noise (Arasaratnam and Haykin 2009, sec. III): equally
// weighted points at +-sqrt(2) standard deviations along the two principal axes.  Empty without
// noise.
std::vector<Gains> cubature_points(const NoiseSettings& noise);
// Within [0, 2] where the noise has a tail.
Gains draw_gains(const NoiseSettings& noise, Stream& stream);

// One robot at one set of parameter values, with the effects that are active there.
class Srv1Robot {
 public:
  // Of scenario srv1.
  explicit Srv1Robot(const ParameterValues& values, StepCounter* steps = nullptr);
  // Of the problem's scenario: srv1, or external, whose effects are a part of srv1's.  `memo` (may
  // be null) holds motions that need not be simulated again; one that is asked for with its path
  // is.
  Srv1Robot(const Problem& problem, const ParameterValues& values, StepCounter* steps,
            MotionMemo<MotionKey>* memo = nullptr);

  const ActiveEffects& effects() const { return effects_; }
  const NoiseSettings& noise() const { return noise_; }
  // Of a trial in a session of which nothing is known: how fast that drives is a part of it.
  NoiseSettings foreseen_noise() const;
  // The gain that a session has, drawn.
  double draw_session_gain(Stream& stream) const;

  Motion run(const DrivenCommand& drive, const Situation& situation, const Gains& gains,
             std::vector<MotionSample>* path = nullptr, double interval_s = 0);
  // Motions that the memo had count like others.
  unsigned runs() const { return runs_; }
  // `where`, with what the last motion says of why it did not end well.
  std::string described(const std::string& where) const;

 private:
  ActiveEffects effects_;
  NoiseSettings noise_;
  double full_speed_m_s_ = 0;
  std::unique_ptr<Vehicle> vehicle_;
  unsigned runs_ = 0;
  std::string message_;  // of the last motion
};

SimSettings sim_settings(const RobotSize& size, const ParameterValues& values,
                         const ActiveEffects& effects);

// Pose `age_s` before the end of a path sampled from the start to rest, by interpolation; before
// the first sample the robot stood at the first.
Pose pose_before_end(const std::vector<MotionSample>& path, double age_s);

// Driving a planned session trial by trial, as the real robot would be: every draw of noise is
// simulated, and every pose is read through the camera.

// Trials start where the one before ended, or at the plan's pose after an unrecorded move.  The
// result holds measured start and end poses, and paths when the task asks for them.
v1::TaskResult simulate_session(const Problem& problem, const ParameterValues& values,
                                const v1::SimulateTask& task, StepCounter* steps = nullptr);

// The motion of one command from (0, 0, 0): nominal, or with one draw of drive noise.
v1::TaskResult trace_command(const Problem& problem, const ParameterValues& values,
                             const v1::TraceTask& task, StepCounter* steps = nullptr);

}  // namespace gapfarm
