// THE effect catalogue: what the base simulation omits, by name, with units, bounds and the
// neutral value at which an effect does nothing, exactly.  What each does lives in worker/effects.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace gapfarm {

// Where in the chain from duty to logged pose an effect acts.
enum class EffectStage { kDrive, kFloor, kCamera };  // in `push` the finger drives

// What an effect looks at beside the command itself; conditions are shared over the rest.
enum EffectContext : unsigned {
  kNoContext = 0,
  kStartHeading = 1u << 0,    // heading in the world before the trial
  kStartPlace = 1u << 1,      // position in the world before the trial
  kSessionTime = 1u << 2,     // time since the session began
  kLastDirection = 1u << 3,   // sign of each side's last duty in the session
  kUnrecordedMove = 1u << 4,  // whether the robot was moved before the trial
};

// What repeating a trial shows of an effect: another mean, a wider spread about it, or now and then
// an outlier trial.
enum class EffectShows { kMean, kSpread, kChance };

enum class ParameterKind { kReal, kInteger, kBoolean, kChoice };
enum class ParameterScale { kLinear, kLog };

// A row of a scenario's parameter table, or of an effect, within which its key is.
struct Parameter {
  std::string key;   // "mass", "battery_sag.rate"
  std::string unit;  // SI; "-" when it has none
  ParameterKind kind = ParameterKind::kReal;
  ParameterScale scale = ParameterScale::kLinear;
  double lower = 0;  // bounds of what the simulation accepts
  double upper = 0;
  double nominal = 0;  // for an effect's parameter: the neutral value
  std::string summary;
  std::vector<std::string> choices = {};  // kChoice only; the value is an index
  std::string effect = {};                // name of the effect it belongs to; empty: base
  std::string beyond = {};                // what to do where a value has to lie beyond the bounds
};

struct Effect {
  std::string name;
  EffectStage stage = EffectStage::kDrive;
  unsigned context = kNoContext;
  std::string summary;
  std::vector<Parameter> parameters;
  // How many of `parameters`, from the first, must be neutral for the effect to do nothing; the
  // others (a direction, a place) mean nothing then.
  std::size_t strengths = 1;
  // Of the second one of a kind ("camera_seam_2"): the effect of which there may be two, whose
  // parameters and implementation it shares.  Empty: the first, or the only one.
  std::string repeats = {};
  EffectShows shows = EffectShows::kMean;
  // Its lengths are the robot's own, and shrink with a smaller robot; those of a floor do not.
  bool of_the_robot = false;

  bool moves_means() const { return shows == EffectShows::kMean; }
  const std::string& kind() const { return repeats.empty() ? name : repeats; }
};

// The catalogue of each scenario, in a fixed order.  An effect of one name in two catalogues has
// parameters of the same keys and units in both (bounds and neutral values may differ) and one
// implementation.
std::span<const Effect> srv1_effects();
// Those, and after them the second one of each effect of which a scene may hold two.
std::span<const Effect> srv1_effects_and_seconds();
std::span<const Effect> push_effects();

// "camera_seam" of "camera_seam_2", and of itself.
std::string kind_of(const std::string& effect);
// "camera_seam_2" of "camera_seam"; empty where there is but one.
std::string second_of(const std::string& effect);

// How far the heading that was logged of a start may be turned from the robot's.
struct StartTurn {
  double weight = 1;
  double turn_rad = 0;  // of the logged heading, to the left of the robot's
};

// By up to an angle either way, all angles alike: as many alternatives as leave no gap between
// them. Weights sum to 1.
inline std::vector<StartTurn> uniform_turns(double angle_rad) {
  constexpr double kStep_rad = 0.04;  // two readings of a heading differ by as much
  const int count = std::clamp(static_cast<int>(std::ceil(2 * angle_rad / kStep_rad)), 5, 101);
  std::vector<StartTurn> turns;
  for (int k = 0; k < count; ++k) {
    turns.push_back({1.0 / count, angle_rad * ((2 * k + 1.0) / count - 1)});
  }
  return turns;
}

}  // namespace gapfarm
