// Base rows of scenario `push`.
#pragma once

#include "common/parameters/table.h"

namespace gapfarm {

// In table order; `values[row_of(Push::kGroundFriction)]` is the friction of piece and table.
enum class Push : std::size_t {
  kModel,         // choice: bullet, limit_surface
  kShapeFactor,   // -, support plate over outline, about the centroid; shared by all pieces
  kShapeFactor1,  // -, of the config's first piece; 0: kShapeFactor.  Seven more follow.
  kGroundFriction = kShapeFactor1 + 8,  // -, piece on table
  kFingerFriction,                      // -, piece on finger
  kPushNoiseSlide,     // -, per-trial s.d. of the end position, a share of the distance slid
  kPushNoiseTurn,      // rad/m, per-trial s.d. of the heading a distance slid
  kPoseNoisePosition,  // m, s.d. of a measured x and y
  kPoseNoiseHeading,   // rad, s.d. of a measured heading
  kFingerRadius,       // m
  kFingerHeight,       // -, where the finger touches, over the thickness
  kMassFactor,         // -, of all pieces' masses
  kGravity,            // m/s^2
  kLengthScale,        // -, units of the engine a metre
  kStepRate,           // Hz
  kSubSteps,           // -
  kSolverIterations,   // -
  kRestitution,        // -, of finger and piece
  kLinearDamping,      // -, Bullet's share lost a second
  kAngularDamping,     // -
  kErrorReduction,     // -, share of a contact's depth repaired a step
  kContactSoftness,    // m s / kg: Bullet's CFM of the table's contacts
  kContactMargin,      // m, by which the outline grows against the finger
  kCount
};
constexpr std::size_t row_of(Push p) { return static_cast<std::size_t>(p); }
// Pieces that can have a shape factor of their own.
inline constexpr std::size_t kOwnShapeFactors = 8;

const ParameterTable& push_table();

}  // namespace gapfarm
