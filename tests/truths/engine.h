// What a simulator has to be to drive the truths that a diagnosis is tried on
// (scripts/foreign_check.sh): tread speeds over time in, a path out.  Noise, cameras and logs are
// the same for all of them; none of it is the worker's.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/pose/pose.h"

namespace gapfarm::truths {

// A tracked robot; its frame lies midway between the treads, x ahead.
struct Robot {
  double mass_kg = 0.35;
  double gauge_m = 0.085;     // tread to tread
  double length_m = 0.1;      // of a tread on the floor
  double friction = 0.6;      // along the treads
  double friction_ratio = 1;  // across over along
  double full_speed_m_s = 0.28;
  double lag_s = 0.012;     // of the motors, first order; they brake as fast
  double shear_m = 0.0006;  // slip over which a tread's grip builds up
  double mass_height_m = 0.03;
};

struct Floor {
  double tilt_rad = 0, tilt_direction_rad = 0;     // downhill, world
  double nap_strength = 0, nap_direction_rad = 0;  // drag over weight against it; free travel
  double rolling_resistance = 0;                   // drag over weight
  double patch_ratio = 1, patch_x_m = 0, patch_y_m = 0, patch_radius_m = 0;
};

struct Scene {
  Robot robot;
  Floor floor;
  double com_x_m = 0, com_y_m = 0;  // centre of mass, ahead and left of the frame
};

struct SideDrive {
  double speed_m_s = 0;      // that the tread is driven to
  double dead_travel_m = 0;  // of the motor before the tread moves
};

struct Drive {
  SideDrive left, right;
  double on_s = 0;  // then the motors brake
  double lag_s = 0;
};

struct Sample {
  double t_s = 0;
  Pose X_WR;
};

// From standing to rest; the last sample is the pose at rest.
using Path = std::vector<Sample>;

// Where the robot was `age_s` before the path's end; its start where that is longer ago.
Pose pose_before_end(const Path& path, double age_s);

// A motor that follows what it is reported with a lag, and the tread behind it.
class Motor {
 public:
  Motor(const SideDrive& side, const Drive& drive) : side_(side), drive_(drive) {}
  // The tread's speed after another `dt_s`.
  double step(double dt_s);
  double commanded() const { return side_.speed_m_s; }
  bool stands() const;

 private:
  SideDrive side_;
  Drive drive_;
  double t_s_ = 0, speed_m_s_ = 0, travel_m_ = 0;
};

class Engine {
 public:
  virtual ~Engine() = default;
  virtual Path drive(const Pose& X_WS, const Drive& drive) = 0;
};

struct EngineKind {
  std::string name;
  std::function<std::unique_ptr<Engine>(const Scene&)> make;
  std::vector<std::string> cannot;  // effects that it does not have
};

}  // namespace gapfarm::truths
