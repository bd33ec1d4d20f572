// Logs of ground robots on floors of their own, whatever simulates them: a robot seeks points of a
// square of 3 m in four runs of 30 s and is seen to 0.7 mm and 2 mrad.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/pose/pose.h"

namespace gapfarm::truths {

// Of the marker on every robot, and the floor's resistance to rolling where nothing else is said.
inline constexpr double kMarkerX_m = 0.05, kMarkerY_m = 0.01, kRollingLever_m = 2e-4;
inline constexpr double kGroundStep_s = 0.002;

// FLOOR of the programs: "tilt" (SIZE in rad; 0 is level), "edge" or "patch" (SIZE: the lever that
// rolling resists by beyond it or within it, m).
struct GroundSetting {
  std::string kind, floor;
  double size = 0;
  double stiffness = 0;                   // of what holds the wheels' speeds, N m s / rad
  double direction_rad = 0;               // downhill, or beyond the edge
  double x_m = 0, y_m = 0, radius_m = 0;  // on the edge, or the patch

  double tilt_rad() const { return floor == "tilt" ? size : 0; }
};

// Where the robot is to go.
struct Aim {
  double t_s = 0;
  double speed_m_s = 0;    // below 0: backwards
  int ahead = 1;           // -1: backwards
  double off_rad = 0;      // of the point from where the robot is about to go
  double bearing_rad = 0;  // of the point from its heading
};

class GroundTruth {
 public:
  virtual ~GroundTruth() = default;
  virtual std::vector<std::string> channels() const = 0;
  virtual std::vector<double> commands(const Aim& aim) const = 0;
  virtual void step(const std::vector<double>& commands) = 0;  // kGroundStep_s
  virtual Pose pose() const = 0;
  virtual std::string robot_file() const = 0;  // without its marker
};

using GroundEngine = std::function<std::unique_ptr<GroundTruth>(const GroundSetting&)>;

// main() of a program KIND FLOOR SIZE STIFFNESS SEED OUT, which writes OUT/{config.toml,
// robot.toml, log/, truth.txt}.
int ground_log_program(const char* kinds, const GroundEngine& engine, int argc, char** argv);

template <class Truth>
std::unique_ptr<GroundTruth> make_truth(const GroundSetting& setting) {
  return std::make_unique<Truth>(setting);
}

}  // namespace gapfarm::truths
