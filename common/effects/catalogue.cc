#include "common/effects/catalogue.h"

#include <numbers>
#include <utility>

namespace gapfarm {
namespace {

// What rows are written with.
Parameter real(const char* key, const char* unit, double neutral, double lower, double upper,
               const char* summary) {
  return {key, unit, ParameterKind::kReal, ParameterScale::kLinear, lower, upper, neutral, summary};
}

// Any direction of the plane, or `most` to either side.
Parameter direction(const char* summary, double most = std::numbers::pi) {
  return real("direction", "rad", 0, -most, most, summary);
}

Parameter choice(const char* key, std::vector<std::string> choices, const char* summary) {
  const auto last = static_cast<double>(choices.size() - 1);
  return {key, "-",     ParameterKind::kChoice, ParameterScale::kLinear, 0, last,
          0,   summary, std::move(choices)};
}

constexpr auto maker_of(EffectStage stage) {
  return [stage](const char* name, unsigned context, const char* summary,
                 std::vector<Parameter> parameters, std::size_t strengths = 1) -> Effect {
    return {name, stage, context, summary, std::move(parameters), strengths};
  };
}
constexpr auto drive = maker_of(EffectStage::kDrive);
constexpr auto floor = maker_of(EffectStage::kFloor);
constexpr auto camera = maker_of(EffectStage::kCamera);

Effect in_spread(Effect effect) {
  effect.shows = EffectShows::kSpread;
  return effect;
}
Effect of_the_robot(Effect effect) {
  effect.of_the_robot = true;
  return effect;
}
Effect by_chance(Effect effect) {
  effect.shows = EffectShows::kChance;
  return effect;
}

std::vector<Effect> build_catalogue() {
  return {
      drive("motor_asymmetry", kNoContext, "right side faster than left by this share",
            {real("ratio", "-", 0, -0.3, 0.3, "share by which the right side is faster")}),
      drive("motor_deadband", kNoContext,
            "duty below this moves nothing, and is subtracted above it",
            {real("duty", "-", 0, 0, 0.3, "width of the dead band")}),
      drive("motor_lag", kNoContext, "first-order response of the tread speed to the duty",
            {real("tau", "s", 0, 0, 0.5, "time constant")}),
      drive("timing_offset", kNoContext, "motors run this much longer than commanded",
            {real("offset", "s", 0, -0.2, 0.2, "extra running time")}),
      drive("battery_sag", kSessionTime, "speed lost per minute since the session began",
            {real("rate", "1/min", 0, -0.05, 0.05, "share of the speed lost a minute")}),
      of_the_robot(drive("backlash", kLastDirection,
                         "tread travel lost by a side whose direction differs from its last one",
                         {real("travel", "m", 0, 0, 0.05, "travel lost")})),
      by_chance(drive(
          "slip_events", kNoContext,
          "now and then a side loses up to this share of its speed for a trial",
          {real("probability", "-", 0, 0, 0.5, "chance a side and trial"),
           real("loss", "-", 0, 0, 1, "greatest share lost; each event's is uniform below it")},
          2)),
      floor("floor_tilt", kStartHeading, "the floor falls away toward a direction",
            {real("angle", "rad", 0, 0, 0.3, "slope"), direction("downhill, world frame")}),
      floor("floor_nap", kStartHeading,
            "drag, as a share of weight, greatest when travelling against the nap",
            {real("strength", "-", 0, 0, 1, "drag over weight against the nap"),
             direction("travel in this direction is free, world frame")}),
      floor("friction_patch", kStartHeading | kStartPlace, "a disc of floor with another friction",
            {real("ratio", "-", 1, 0.05, 3, "friction inside over friction outside"),
             real("x", "m", 0, -10, 10, "centre, world frame"),
             real("y", "m", 0, -10, 10, "centre, world frame"),
             real("radius", "m", 0.2, 0, 5, "of the disc")}),
      floor("rolling_resistance", kNoContext, "drag opposing forward motion, as a share of weight",
            {real("coefficient", "-", 0, 0, 1, "drag over weight")}),
      of_the_robot(floor(
          "com_offset", kNoContext, "centre of mass ahead of / left of the tread centre",
          {real("x", "m", 0, -0.03, 0.03, "ahead"), real("y", "m", 0, -0.03, 0.03, "left")}, 2)),
      camera("camera_aspect", kStartHeading | kStartPlace, "the camera's y scale over its x scale",
             {real("ratio", "-", 1, 0.5, 2, "y scale over x scale")}),
      camera("camera_distortion", kStartHeading | kStartPlace, "radial distortion about a centre",
             {real("k1", "1/m^2", 0, -0.5, 0.5, "logged radius is r (1 + k1 r^2)"),
              real("x", "m", 0, -10, 10, "centre, world frame"),
              real("y", "m", 0, -10, 10, "centre, world frame")}),
      camera("camera_seam", kStartHeading | kStartPlace,
             "beyond a line another camera reports poses shifted, the shift growing along the line",
             {real("offset_x", "m", 0, -0.5, 0.5, "shift beyond the line"),
              real("offset_y", "m", 0, -0.5, 0.5, "shift beyond the line"),
              real("slope_x", "-", 0, -0.3, 0.3, "growth of the shift per m along the line"),
              real("slope_y", "-", 0, -0.3, 0.3, "growth of the shift per m along the line"),
              real("position", "m", 0, -10, 10, "of the line on its axis"),
              choice("axis", {"x", "y"}, "coordinate that crosses the line")},
             4),
      camera("heading_offset", kNoContext, "the marker's heading is not the robot's",
             {real("angle", "rad", 0, -0.5, 0.5, "logged heading minus the robot's")}),
      of_the_robot(camera(
          "marker_offset", kNoContext, "the marker is not over the turning centre",
          {real("x", "m", 0, -0.05, 0.05, "ahead"), real("y", "m", 0, -0.05, 0.05, "left")}, 2)),
      by_chance(camera("pose_latency", kUnrecordedMove | kStartPlace | kStartHeading,
                       "in a share of trials a pose is older than it claims",
                       {real("share", "-", 0, 0, 1, "of the trials"),
                        real("latency", "s", 0.2, 0, 5, "age of a stale pose")})),
      in_spread(camera("pose_quantisation", kStartHeading | kStartPlace,
                       "positions are rounded to this grid",
                       {real("step", "m", 0, 0, 0.1, "of the grid")})),
  };
}

// Rows are stored by their number, so what came after second seams stands after them.
std::vector<Effect> build_younger() {
  return {
      by_chance(
          camera("unsettled_start", kUnrecordedMove,
                 "in a share of the trials after an unrecorded move the start was read before the "
                 "hand let go",
                 {real("share", "-", 0, 0, 1, "of the trials that follow an unrecorded move"),
                  real("angle", "rad", 0.3, 0, 1.6, "by up to which the start's heading is off")})),
  };
}

std::vector<Effect> build_youngest() {
  return {
      in_spread(drive("session_gain", kNoContext, "each session drives faster or slower as a whole",
                      {real("spread", "-", 0, 0, 0.3, "standard deviation of a session's gain")})),
  };
}

// Of an effect of which there may be two.
Effect second_one(const std::string& first) {
  const std::vector<Effect> catalogue = build_catalogue();
  Effect second = *std::ranges::find(catalogue, first, &Effect::name);
  second.repeats = first;
  second.name += "_2";
  second.summary += "; a second one";
  return second;
}

std::vector<Effect> joined(std::initializer_list<std::vector<Effect>> parts) {
  std::vector<Effect> all;
  for (const std::vector<Effect>& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

std::vector<Effect> build_push_catalogue() {
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
      camera("frame_offset", kNoContext, "the camera's frame lies beside the finger's",
             {real("x", "m", 0, -0.05, 0.05, "logged position less the true one, world frame"),
              real("y", "m", 0, -0.05, 0.05, "same")},
             2),
      camera("pose_scale", kStartHeading | kStartPlace,
             "the camera's lengths differ from those of the finger's path",
             {real("ratio", "-", 1, 0.5, 2, "logged lengths of poses over the finger's")}),
  };
}

}  // namespace

std::span<const Effect> srv1_effects() {
  static const std::vector<Effect> catalogue =
      joined({build_catalogue(), build_younger(), build_youngest()});
  return catalogue;
}

std::span<const Effect> srv1_effects_and_seconds() {
  static const std::vector<Effect> catalogue =
      // An arena under four cameras has a seam across each axis; a floor may be mended twice.
      joined({build_catalogue(),
              {second_one("camera_seam")},
              build_younger(),
              {second_one("friction_patch")},
              build_youngest()});
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

std::span<const Effect> push_effects() {
  static const std::vector<Effect> catalogue = build_push_catalogue();
  return catalogue;
}

}  // namespace gapfarm
