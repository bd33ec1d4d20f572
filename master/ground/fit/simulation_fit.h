// Least squares through the simulation: what fit_by_simulation() is made of.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "common/score/kinematic.h"
#include "master/farm/farm.h"
#include "master/ground/fit/robust_errors.h"
#include "master/ground/fit/simulated_start.h"

namespace gapfarm {

struct At {
  Genome genome;
  WindowEnds ends;
  double nats = 0;  // of the windows, and of what was moved
};

struct Hold {
  Genome start;
  double strength = 1;
  double untold = 1;  // times that, of what kinematics have no word for
};

struct Climb {
  At at;
  Hold hold;
  WindowSlopes slopes = {};  // at `sloped`, where it stands or stood some steps before
  Genome sloped = {};
  NormalEquations equations = {};
  bool over = false;
};

class SimulationFit {
 public:
  SimulationFit(Farm& farm, const Problem& problem);
  Result<SimulatedStart> run(double widest);

 private:
  // What is predicted of stretches that were held out, beside the kinematics.
  struct Predicted {
    double gain = 0;   // nats a window
    double worst = 0;  // ratio of errors' middles, of position and heading at all lengths
    double cost = 0;   // the gain's negative, more where errors may be larger
  };

  Result<std::vector<std::optional<At>>> look_at(const std::vector<Genome>& genomes,
                                                 const std::vector<Hold>& holds);
  Status look_round(Climb* climb);  // slopes where it stands, unless they are known
  void correct_slopes(const At& before, Climb* climb) const;
  // Of the windows, and of what was moved.
  NormalEquations equations_at(const At& at, const Hold& hold, const WindowSlopes& slopes) const;
  double promised(const Climb& climb) const;  // nats, of a step
  Result<double> try_steps(Climb* climb, std::span<const double> dampings);
  Status step(Climb* climb);
  Status climb_on(Climb* climb, int rounds);
  Result<std::vector<Climb>> other_climbs(const Climb& first);
  Status settle(std::vector<std::optional<At>>* looks, const std::vector<Hold>& holds,
                const Climb& first);
  Eigen::VectorXd fitted_values(const Genome& genome) const;  // of told_, its values
  Genome moved(const At& at, const NormalEquations& equations) const;
  Genome with_fitted_values(const Genome& genome, const Eigen::VectorXd& values) const;
  double strength_of(const Hold& hold, std::size_t gene) const;
  double cost_of(const Genome& genome, const Hold& hold) const;
  NormalEquations prior_at(const Genome& genome, const Hold& hold) const;
  WindowEnds held_out(const Climb& climb, const Hold& hold) const;
  Result<WindowEnds> simulated_held_out(const Climb& climb);
  Predicted predicted(const WindowEnds& ends) const;
  Status climb_again(Climb* climb);
  Result<std::optional<Climb>> firm_climb();
  Result<Climb> best_of(std::vector<Climb> climbs);
  Hold best_hold(const Climb& climb, double* cost) const;
  Result<Climb> sharpen(Climb best);
  Result<Climb> weigh_worse(Climb best);
  Status judge(const Climb& best, const At& begin, SimulatedStart* found);
  void take_spread(const Climb& climb, double widest, SimulatedStart* found) const;

  Farm& farm_;
  const Problem& problem_;
  std::string hash_;
  Kinematics kinematics_;
  std::optional<RobustErrors> plain_, errors_;  // errors_: what is worse emphasised
  WindowEnds baseline_;                         // of the kinematics, held out
  std::vector<std::size_t> fitted_rows_;        // genes that move ends
  std::vector<std::size_t> untold_;             // those of them that kinematics have no word for
  std::vector<std::size_t> stretches_;          // of each window, held out in turn
  std::vector<std::size_t> parts_;              // of each window, finer
  Genome start_;
  Genome firm_;  // the same without slip
  std::size_t simulations_ = 0;
};

// Measured less predicted, in the predicted ends' axes.  REQUIRES: an end a trial.
WindowEnds window_errors(const Problem& problem, const std::vector<Pose>& predicted);

}  // namespace gapfarm
