// The catalogue of scenario `push`.
#include <numbers>

#include "common/effects/catalogue.h"

namespace gapfarm {
namespace {

std::vector<Effect> build_push_catalogue() {
  using enum EffectStage;
  return {
      {"friction_anisotropy",
       kFloor,
       kStartHeading,
       "the table's friction differs along and across its grain",
       {{"ratio", "-", 1, 0.3, 3, "friction across over friction along the grain", {}},
        {"direction",
         "rad",
         0,
         -std::numbers::pi / 2,
         std::numbers::pi / 2,
         "of the grain, world frame",
         {}}}},
      {"friction_speed",
       kFloor,
       kNoContext,
       "friction with the table changes with the sliding speed",
       {{"slope", "s/m", 0, -5, 20, "share of friction gained a m/s", {}}}},
      {"friction_patch",
       kFloor,
       kStartHeading | kStartPlace,
       "a disc of table with another friction",
       {{"ratio", "-", 1, 0.05, 3, "friction inside over friction outside", {}},
        {"x", "m", 0, -2, 2, "centre, world frame", {}},
        {"y", "m", 0, -2, 2, "centre, world frame", {}},
        {"radius", "m", 0.05, 0, 2, "of the disc", {}}}},
      {"table_tilt",
       kFloor,
       kStartHeading,
       "the table falls away toward a direction",
       {{"angle", "rad", 0, 0, 0.3, "slope", {}},
        {"direction", "rad", 0, -std::numbers::pi, std::numbers::pi, "downhill, world frame", {}}}},
      {"com_offset",
       kFloor,
       kNoContext,
       "centre of mass, and the support under it, away from the centroid",
       {{"x", "m", 0, -0.03, 0.03, "in the piece's frame", {}},
        {"y", "m", 0, -0.03, 0.03, "in the piece's frame", {}}},
       2},
      {"pressure_distribution",
       kFloor,
       kNoContext,
       "the support plate is drawn out along one direction of the piece",
       {{"stretch", "-", 0, -0.8, 0.8, "log of its length over its width", {}},
        {"direction",
         "rad",
         0,
         -std::numbers::pi / 2,
         std::numbers::pi / 2,
         "of the length, in the piece's frame",
         {}}}},
      {"finger_compliance",
       kDrive,
       kNoContext,
       "the finger gives way to the force that the piece presses it with",
       {{"compliance", "m/N", 0, 0, 0.02, "yield a newton", {}}}},
      {"placement_bias",
       kCamera,
       kNoContext,
       "pieces start beside where the log says",
       {{"x", "m", 0, -0.03, 0.03, "true start less the logged one, world frame", {}},
        {"y", "m", 0, -0.03, 0.03, "same", {}},
        {"angle", "rad", 0, -0.3, 0.3, "same", {}}},
       3},
      {"camera_aspect",
       kCamera,
       kStartHeading | kStartPlace,
       "the camera's y scale over its x scale",
       {{"ratio", "-", 1, 0.5, 2, "y scale over x scale", {}}}},
      {"camera_distortion",
       kCamera,
       kStartHeading | kStartPlace,
       "radial distortion about a centre",
       {{"k1", "1/m^2", 0, -0.5, 0.5, "logged radius is r (1 + k1 r^2)", {}},
        {"x", "m", 0, -2, 2, "centre, world frame", {}},
        {"y", "m", 0, -2, 2, "centre, world frame", {}}}},
      {"marker_offset",
       kCamera,
       kNoContext,
       "the marker is not where the outline says",
       {{"x", "m", 0, -0.05, 0.05, "in the piece's frame", {}},
        {"y", "m", 0, -0.05, 0.05, "in the piece's frame", {}}},
       2},
  };
}

}  // namespace

std::span<const Effect> push_effects() {
  static const std::vector<Effect> catalogue = build_push_catalogue();
  return catalogue;
}

}  // namespace gapfarm
