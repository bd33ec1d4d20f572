#include "master/diagnose/intervals.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "common/effects/catalogue.h"
#include "master/diagnose/seam.h"
#include "master/diagnose/signatures.h"

namespace gapfarm {
namespace {

// Relative standard deviation of an effect's size between simulations that share the effect but not
// the contact of treads and floor (docs/diagnosis.md); of others it is below the data's own.
const std::map<std::string, double> kModelError = {
    {"motor_asymmetry", 0.04},   {"battery_sag", 0.03},       {"backlash", 0.1},
    {"camera_aspect", 0.02},     {"camera_distortion", 0.03}, {"camera_seam", 0.05},
    {"com_offset", 0.15},        {"floor_nap", 0.2},          {"floor_tilt", 0.3},
    {"heading_offset", 0.03},    {"motor_deadband", 0.1},     {"motor_lag", 0.4},
    {"rolling_resistance", 0.3}, {"timing_offset", 0.06},     {"marker_offset", 0.03}};

constexpr double kDirectionError_rad = 0.02;  // of a tilt or a nap

// What was searched rather than fitted may be a neighbour of the best.  A patch's mark changes
// within a few cm and has several hills when it is weak: standard deviation of its place and
// radius, and of its ratio's distance from 1 as a share, for a gain of half a nat.
constexpr double kPatchPlace_m = 0.25;
constexpr double kPatchRatio = 1;

// Standard deviation of a parameter beyond what the fit says, in its unit.
double search_error(const Parameter& p, double value, double gain) {
  const double weakness = 1 / std::sqrt(2 * std::max(gain, 1.0));
  if (p.key == "friction_patch.ratio") return kPatchRatio * weakness * (value - p.nominal);
  if (p.effect == "friction_patch") return kPatchPlace_m * weakness;
  return is_seam_position(p.key) ? kSeamStep_m : 0;
}

// Within a shift's width of a seam both cameras may have reported a reading: m, standard deviation
// of where the line runs.
double seam_ambiguity(const Study& study, const ParameterTable& table, const std::string& seam,
                      const Overrides& at) {
  const auto value = [&](const char* key) { return at.at(table.row(seam + "." + key)); };
  const bool across_x = value("axis") == 0;
  const Eigen::Vector2d middle = middle_of(study);
  const double along = across_x ? middle.y() : middle.x();
  const double shift = across_x ? value("offset_x") + along * value("slope_x")
                                : value("offset_y") + along * value("slope_y");
  return std::abs(shift) / kNormal90;
}

// Relative to the effect's size.
double model_error(const Parameter& p, double value) {
  const bool direction = p.unit == "rad" && (p.effect == "floor_tilt" || p.effect == "floor_nap") &&
                         p.key != "floor_tilt.angle";
  if (direction) return kDirectionError_rad;
  if (p.unit == "rad" && p.key != "floor_tilt.angle") return 0;
  const auto known = kModelError.find(kind_of(p.effect));
  return known == kModelError.end() ? 0 : known->second * (value - p.nominal);
}

}  // namespace

double error_beyond_fit(const Study& study, const ParameterTable& table, std::size_t row,
                        const Overrides& at, double gain) {
  const Parameter& p = table[row];
  const double value = at.at(row);
  const double seam = is_seam_position(p.key) ? seam_ambiguity(study, table, p.effect, at) : 0;
  return std::hypot(model_error(p, value), search_error(p, value, gain), seam);
}

}  // namespace gapfarm
