// The catalogue of scenario `push`.
#include <numbers>

#include "common/effects/rows.h"

namespace gapfarm {
namespace {

std::vector<Effect> build_push_catalogue() {
  using namespace effect_rows;  // NOLINT: what follows is rows
  return {
      floor("friction_anisotropy", kStartHeading,
            "the table's friction differs along and across its grain",
            {real("ratio", "-", 1, 0.3, 3, "friction across over friction along the grain"),
             direction("of the grain, world frame", std::numbers::pi / 2)}),
      floor("friction_speed", kNoContext, "friction with the table changes with the sliding speed",
            {real("slope", "s/m", 0, -5, 20, "share of friction gained a m/s")}),
      floor("friction_patch", kStartHeading | kStartPlace, "a disc of table with another friction",
            {real("ratio", "-", 1, 0.05, 3, "friction inside over friction outside"),
             real("x", "m", 0, -2, 2, "centre, world frame"),
             real("y", "m", 0, -2, 2, "centre, world frame"),
             real("radius", "m", 0.05, 0, 2, "of the disc")}),
      floor("table_tilt", kStartHeading, "the table falls away toward a direction",
            {real("angle", "rad", 0, 0, 0.3, "slope"), direction("downhill, world frame")}),
      floor("com_offset", kNoContext,
            "centre of mass, and the support under it, away from the centroid",
            {real("x", "m", 0, -0.03, 0.03, "in the piece's frame"),
             real("y", "m", 0, -0.03, 0.03, "in the piece's frame")},
            2),
      floor("pressure_distribution", kNoContext,
            "the support plate is drawn out along one direction of the piece",
            {real("stretch", "-", 0, -0.8, 0.8, "log of its length over its width"),
             direction("of the length, in the piece's frame", std::numbers::pi / 2)}),
      drive("finger_compliance", kNoContext,
            "the finger gives way to the force that the piece presses it with",
            {real("compliance", "m/N", 0, 0, 0.02, "yield a newton")}),
      camera("placement_bias", kNoContext, "pieces start beside where the log says",
             {real("x", "m", 0, -0.03, 0.03, "true start less the logged one, world frame"),
              real("y", "m", 0, -0.03, 0.03, "same"), real("angle", "rad", 0, -0.3, 0.3, "same")},
             3),
      camera("camera_aspect", kStartHeading | kStartPlace, "the camera's y scale over its x scale",
             {real("ratio", "-", 1, 0.5, 2, "y scale over x scale")}),
      camera("camera_distortion", kStartHeading | kStartPlace, "radial distortion about a centre",
             {real("k1", "1/m^2", 0, -0.5, 0.5, "logged radius is r (1 + k1 r^2)"),
              real("x", "m", 0, -2, 2, "centre, world frame"),
              real("y", "m", 0, -2, 2, "centre, world frame")}),
      camera("marker_offset", kNoContext, "the marker is not where the outline says",
             {real("x", "m", 0, -0.05, 0.05, "in the piece's frame"),
              real("y", "m", 0, -0.05, 0.05, "in the piece's frame")},
             2),
  };
}

}  // namespace

std::span<const Effect> push_effects() {
  static const std::vector<Effect> catalogue = build_push_catalogue();
  return catalogue;
}

}  // namespace gapfarm
