// What to drive so that a diagnosis can distinguish as many effects as possible from noise and from
// each other.
#pragma once

#include <cstdint>

#include "common/config/settings.h"
#include "common/progress/overall_progress.h"
#include "master/experiments/plan/visibility.h"

namespace gapfarm::plan {

struct PlanSettings {
  unsigned trials = 120;             // in all sessions
  unsigned pool = 10;                // chains to choose from for each that is driven
  std::vector<std::string> effects;  // empty: the whole catalogue
  std::uint64_t seed = 1;
};

// Share of effects that are named, at the sizes that a random log of all trials names nine times in
// ten, after the first so many trials.
struct PowerPoint {
  std::size_t trials = 0;
  double planned = 0;
  double random = 0;
};

// After how many trials of the plan as many effects are named as after all random ones,
// interpolated; nothing where never.
std::optional<double> trials_as_good(const std::vector<PowerPoint>& power);

struct DesignedPlan {
  TrialLog log;     // to be driven in this order; ends are where the model says the robot stops
  TrialLog random;  // as many trials as `gapfarm simulate` draws them
  std::vector<Visibility> seen;
  std::vector<Visibility> seen_at_random;  // the same effects, in the same order
  std::vector<PowerPoint> power;
  double best_share = 1;                     // best_over_plan() of the chains that were chosen
  std::vector<std::string> not_planned_for;  // effects on the spread of poses alone
  std::vector<std::string> without_shift;    // that could not be simulated
};

// Draws `pool` times the chains that are wanted, as the config's [simulate] has them (levels,
// durations, chain, arena), omits those that leave the arena, and takes those that show most
// (selection.h) in that order: whoever stops early has driven the best of them.  Pure: the same for
// one config, settings and build.  Its stages: candidates, what they show.  Errors: a scenario
// without a diagnosis; an unknown effect; too few chains that stay in the arena; the farm's; a
// robot that does not drive.
Result<DesignedPlan> design_plan(Farm& farm, const Config& config, const PlanSettings& settings,
                                 const StageHooks& hooks = {});

// From above: a dot where the robot is put down, an arrow from each start to where the model says
// that it stops, a colour a command; beside it the power by number of trials, planned and random.
std::string plan_picture(const Problem& problem, const DesignedPlan& plan);

}  // namespace gapfarm::plan
