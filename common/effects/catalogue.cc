#include "common/effects/catalogue.h"

#include <algorithm>
#include <numbers>

namespace gapfarm {
namespace {

std::vector<Effect> build_catalogue() {
  using enum EffectStage;
  return {
      {"motor_asymmetry",
       kDrive,
       kNoContext,
       "right side faster than left by this share",
       {{"ratio", "-", 0, -0.3, 0.3, "share by which the right side is faster", {}}}},
      {"motor_deadband",
       kDrive,
       kNoContext,
       "duty below this moves nothing, and is subtracted above it",
       {{"duty", "-", 0, 0, 0.3, "width of the dead band", {}}}},
      {"motor_lag",
       kDrive,
       kNoContext,
       "first-order response of the tread speed to the duty",
       {{"tau", "s", 0, 0, 0.5, "time constant", {}}}},
      {"timing_offset",
       kDrive,
       kNoContext,
       "motors run this much longer than told",
       {{"offset", "s", 0, -0.2, 0.2, "extra running time", {}}}},
      {"battery_sag",
       kDrive,
       kSessionTime,
       "speed lost per minute since the session began",
       {{"rate", "1/min", 0, -0.05, 0.05, "share of the speed lost a minute", {}}}},
      {"backlash",
       kDrive,
       kLastDirection,
       "tread travel lost by a side whose direction differs from its last one",
       {{"travel", "m", 0, 0, 0.05, "travel lost", {}}}},
      {"slip_events",
       kDrive,
       kNoContext,
       "now and then a side loses up to this share of its speed for a trial",
       {{"probability", "-", 0, 0, 0.5, "chance a side and trial", {}},
        {"loss", "-", 0, 0, 1, "greatest share lost; each event's is uniform below it", {}}},
       2},
      {"floor_tilt",
       kFloor,
       kStartHeading,
       "the floor falls away toward a direction",
       {{"angle", "rad", 0, 0, 0.3, "slope", {}},
        {"direction", "rad", 0, -std::numbers::pi, std::numbers::pi, "downhill, world frame", {}}}},
      {"floor_nap",
       kFloor,
       kStartHeading,
       "drag, as a share of weight, greatest when travelling against the nap",
       {{"strength", "-", 0, 0, 1, "drag over weight against the nap", {}},
        {"direction",
         "rad",
         0,
         -std::numbers::pi,
         std::numbers::pi,
         "travel in this direction is free, world frame",
         {}}}},
      {"friction_patch",
       kFloor,
       kStartHeading | kStartPlace,
       "a disc of floor with another friction",
       {{"ratio", "-", 1, 0.05, 3, "friction inside over friction outside", {}},
        {"x", "m", 0, -10, 10, "centre, world frame", {}},
        {"y", "m", 0, -10, 10, "centre, world frame", {}},
        {"radius", "m", 0.2, 0, 5, "of the disc", {}}}},
      {"rolling_resistance",
       kFloor,
       kNoContext,
       "drag opposing forward motion, as a share of weight",
       {{"coefficient", "-", 0, 0, 1, "drag over weight", {}}}},
      {"com_offset",
       kFloor,
       kNoContext,
       "centre of mass ahead of / left of the tread centre",
       {{"x", "m", 0, -0.03, 0.03, "ahead", {}}, {"y", "m", 0, -0.03, 0.03, "left", {}}},
       2},
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
        {"x", "m", 0, -10, 10, "centre, world frame", {}},
        {"y", "m", 0, -10, 10, "centre, world frame", {}}}},
      {"camera_seam",
       kCamera,
       kStartHeading | kStartPlace,
       "beyond a line another camera reports poses shifted, the shift growing along the line",
       {{"offset_x", "m", 0, -0.5, 0.5, "shift beyond the line", {}},
        {"offset_y", "m", 0, -0.5, 0.5, "shift beyond the line", {}},
        {"slope_x", "-", 0, -0.3, 0.3, "growth of the shift per m along the line", {}},
        {"slope_y", "-", 0, -0.3, 0.3, "growth of the shift per m along the line", {}},
        {"position", "m", 0, -10, 10, "of the line on its axis", {}},
        {"axis", "-", 0, 0, 1, "coordinate that crosses the line", {"x", "y"}}},
       4},
      {"heading_offset",
       kCamera,
       kNoContext,
       "the marker's heading is not the robot's",
       {{"angle", "rad", 0, -0.5, 0.5, "logged heading minus the robot's", {}}}},
      {"marker_offset",
       kCamera,
       kNoContext,
       "the marker is not over the turning centre",
       {{"x", "m", 0, -0.05, 0.05, "ahead", {}}, {"y", "m", 0, -0.05, 0.05, "left", {}}},
       2},
      {"pose_latency",
       kCamera,
       kUnrecordedMove | kStartPlace | kStartHeading,
       "in a share of trials a pose is older than it claims",
       {{"share", "-", 0, 0, 1, "of the trials", {}},
        {"latency", "s", 0.2, 0, 5, "age of a stale pose", {}}}},
      {"pose_quantisation",
       kCamera,
       kStartHeading | kStartPlace,
       "positions are rounded to this grid",
       {{"step", "m", 0, 0, 0.1, "of the grid", {}}}},
  };
}

// Of which there may be two: an arena under four cameras has a seam across each axis.
constexpr const char* kMayRepeat[] = {"camera_seam"};

std::vector<Effect> with_seconds(std::vector<Effect> effects) {
  for (const char* kind : kMayRepeat) {
    const auto first = std::find_if(effects.begin(), effects.end(),
                                    [&](const Effect& effect) { return effect.name == kind; });
    Effect second = *first;
    second.repeats = first->name;
    second.name += "_2";
    second.summary += "; a second one";
    effects.push_back(std::move(second));
  }
  return effects;
}

}  // namespace

std::span<const Effect> srv1_effects() {
  static const std::vector<Effect> catalogue = build_catalogue();
  return catalogue;
}

std::span<const Effect> srv1_effects_and_seconds() {
  static const std::vector<Effect> catalogue = with_seconds(build_catalogue());
  return catalogue;
}

std::string kind_of(const std::string& effect) {
  for (const Effect& e : srv1_effects_and_seconds()) {
    if (e.name == effect) return e.kind();
  }
  return effect;
}

std::string second_of(const std::string& effect) {
  for (const Effect& e : srv1_effects_and_seconds()) {
    if (e.repeats == effect) return e.name;
  }
  return "";
}

}  // namespace gapfarm
