// Logs of a robot that an engine drives: the plan, the motors, the camera and their noise.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/trials/trial.h"
#include "tests/truths/effects.h"
#include "tests/truths/engine.h"

namespace gapfarm::truths {

// Standard deviations.
struct Noise {
  double common = 0;      // of both sides' speed, a share of it
  double side = 0;        // of each side's own
  double position_m = 0;  // of a reading
  double heading_rad = 0;
};

struct PlannedDrive {
  std::string command;
  double left = 0, right = 0;  // duties
  double duration_s = 0;
  std::int64_t trial = 0;  // within its session
  Commanded commanded;
  Pose X_WP;  // where it is put down, if told.moved
};

struct PlanSize {
  unsigned sessions = 3;
  unsigned trials = 200;  // a session
  unsigned chain = 4;     // trials between two moves by hand
  double arena_m = 2;
};

// Six commands at three levels and durations; sessions begin with fresh batteries.
std::vector<PlannedDrive> draw_plan(const PlanSize& size, std::uint64_t seed);

// The log of the drives, with every reading as the causes and the noise leave it.  A draw depends
// on seed, session and trial alone, so that a part of a plan, or another strength, meets the same
// luck.
TrialLog drive_log(const EngineKind& engine, const Robot& robot,
                   const std::vector<PlannedDrive>& plan, const std::vector<Cause>& causes,
                   const Noise& noise, std::uint64_t seed);

}  // namespace gapfarm::truths
