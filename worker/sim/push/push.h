// A flat piece on a table, pushed by a finger: plain data and the simulator of it.
//
// The start frame S has its origin at the piece's centroid before the push and its axes along the
// piece's own; z is up.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "common/base/constants.h"
#include "worker/sim/robot/motion.h"

namespace gapfarm {

enum class PushModel { kBullet, kLimitSurface, kDistributed };

// Builds the world and the piece; changing any of it means a new simulator.
struct PushSettings {
  PushModel model = PushModel::kBullet;
  std::vector<Eigen::Vector2d> corners;  // m, counter-clockwise, from the centroid; convex
  double thickness_m = 0.01;
  double mass_kg = 0.1;
  double gyration_m2 = 1e-3;  // polar moment of inertia about the vertical over the mass
  // The support plate is the outline shrunk by the factor about the centroid (moved by com_*), and
  // drawn out by exp(+-stretch/2) along and across a direction.
  double shape_factor = 1;
  double stretch = 0;
  double stretch_direction_rad = 0;
  // kDistributed instead: where on the whole face the weight is.
  double pressure = 1;
  int face_points = 100;
  double com_x_m = 0;  // centre of mass from the centroid
  double com_y_m = 0;
  double ground_friction = 0.5;
  double finger_friction = 0.5;
  double finger_radius_m = 0.008;
  double finger_height = 0.5;  // where it touches, over the thickness
  double finger_compliance_m_n = 0;
  double contact_margin_m = 0;  // by which the outline grows against the finger
  double gravity_m_s2 = kGravity_m_s2;
  double length_scale = 1;  // engine units a metre
  double step_rate_hz = 240;
  int sub_steps = 1;
  int solver_iterations = 30;
  double restitution = 0;
  double linear_damping = 0;  // Bullet's: share lost a second, [0, 1]
  double angular_damping = 0;
  double error_reduction = 0.2;    // share of a contact's depth repaired a step
  double contact_softness = 1e-3;  // Bullet's CFM of the table's contacts, m s / kg

  bool operator==(const PushSettings&) const = default;
};

struct FingerSample {
  double t_s = 0;
  Eigen::Vector2d p_SF = Eigen::Vector2d::Zero();  // m
};

// Corners of the support plate, from the centroid, m.
std::vector<Eigen::Vector2d> support_corners(const PushSettings& settings);

// Deterministic to the bit: run() gives the same answer as the first run() of a new simulator with
// the same settings in a new process, whatever was run before.  One thread at a time.
class PushSimulator {
 public:
  virtual ~PushSimulator() = default;
  PushSimulator& operator=(PushSimulator&&) = delete;

  const PushSettings& settings() const { return settings_; }

  // From rest at the origin of S, through the finger's way (straight between samples, and standing
  // still after the last), until the piece rests.  X_SE of the result and X_SB of the samples are
  // the centroid's poses.  REQUIRES: at least two samples at increasing times.
  virtual Motion run(std::span<const FingerSample> finger, const Floor& table,
                     std::vector<MotionSample>* path = nullptr, double interval_s = 0) = 0;

  // The piece slides freely from the origin of S at this velocity (m/s, rad/s) until it rests.
  virtual Motion slide(const Eigen::Vector2d& velocity, double spin, const Floor& table,
                       std::vector<MotionSample>* path = nullptr, double interval_s = 0) = 0;

 protected:
  explicit PushSimulator(const PushSettings& settings) : settings_(settings) {}

  PushSettings settings_;
};

// Of the settings' model.  REQUIRES: settings within the bounds of the parameter table.
std::unique_ptr<PushSimulator> make_push_simulator(const PushSettings& settings);

}  // namespace gapfarm
