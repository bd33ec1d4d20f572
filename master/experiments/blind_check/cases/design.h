// The design of a blind check: which cases, with which robots and which strengths of which effects.
#pragma once

#include "common/config/settings.h"
#include "master/experiments/blind_check/cases/seal.h"
#include "master/experiments/blind_check/cases/sizing.h"
#include "master/farm/farm.h"

namespace gapfarm {

struct SizeLevel {
  std::string name;
  double size = 1;  // TrueEffect::size
};
// "clear" 5, "subtle" 1.6; other sizes by number ("2.5").  Error: neither, or not above 1.
Result<SizeLevel> size_level(const std::string& word);

struct DesignSettings {
  std::vector<std::string> effects;  // empty: the whole catalogue
  std::vector<SizeLevel> sizes;      // pairs and excluded effects have the first
  unsigned per_effect = 1;           // cases an effect and size
  unsigned nulls = 60;
  unsigned pairs = 19;
  unsigned excluded = 19;
  std::uint64_t seed = 1;
};

// An effect that no strength within the catalogue's bounds makes as large as wanted.
struct OutOfReach {
  std::string effect;
  std::string level;
  double size = 1;  // at the last strength tried
};

struct BlindDesign {
  std::vector<Truth> cases;  // shuffled: names show nothing
  std::vector<OutOfReach> out_of_reach;
};

// What a case's robot may differ by from the config's: each factor is log-uniform within
// [1 / spread, spread] (kSpreads).  Parameters that are genes of the config stay within the genes'
// ranges; in a config with genes those that are not stay as they are, noise excepted.
std::map<std::string, double> draw_robot(const Problem& problem, Stream& stream);

// Draws robots and effects, and searches every strength on the farm, all cases side by side, on
// the trials of `planned`: a log of the experiment with the config's own robot.
// Errors: an unknown effect; the farm's own.
Result<BlindDesign> draw_design(const Problem& planned, const DesignSettings& settings, Farm& farm);

// What differs from the problem's values in a case.
std::vector<v1::Override> overrides_of(const ParameterTable& table, const Truth& truth);

using SessionPlans = std::vector<std::vector<v1::PlannedTrial>>;

// The trial log of every case, each driven by its own seed plus `seed_offset` and, when `plan` is
// empty, its own plan.  Errors: a simulation that did not end well, by case; the farm's own.
Result<std::vector<TrialLog>> simulate_cases(const Config& config, const std::vector<Truth>& cases,
                                             const SessionPlans& plan, std::uint64_t seed_offset,
                                             Farm& farm);

}  // namespace gapfarm
