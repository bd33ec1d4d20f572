// From which size on the trials of a plan would show each effect of the catalogue.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "common/trials/trial.h"
#include "master/experiments/blind_check/cases/sizing.h"
#include "master/farm/farm.h"

namespace gapfarm {
struct DiagnosisSubject;
}

namespace gapfarm::plan {

// Which of many experiments to make, so that unknowns can be distinguished from noise and from each
// other.

// One experiment: whitened rows by unknowns, each unknown in units of its prior standard deviation.
using Rows = Eigen::MatrixXd;

// Indices of `wanted` of the candidates (all when there are fewer), best first: the greedy choice
// for Ds-optimality (Atkinson, Donev and Tobias 2007, section 10.3).  Each next one adds most to
//
//   log det(I + X'X) - log det(I + Z'Z)
//
// X: the chosen rows, Z: their last `nuisances` columns, which only have to be allowed for.  Of
// equals the first counts.  REQUIRES: all of one width of at least `nuisances`.
std::vector<std::size_t> select(const std::vector<Rows>& candidates, Eigen::Index nuisances,
                                std::size_t wanted);

// How small standard errors could be on the geometric mean, as a share of those of the experiments
// that were chosen, in (0, 1]: no choice of as many experiments of these kinds, repeats included,
// makes them smaller.  For those unknowns that are no nuisances.
double best_over_plan(const std::vector<Rows>& candidates, Eigen::Index nuisances,
                      const std::vector<std::size_t>& chosen);

// The same of an information that grows by `rates` a second, in units of priors: how narrow the
// `wanted` could be on the geometric mean after so many seconds, as a share of what a plan leaves
// of their variances; others are estimated with them.
double best_over_drive(const std::vector<Rows>& rates, double seconds,
                       const std::vector<std::ptrdiff_t>& wanted, const Eigen::VectorXd& variances);

// Squared length of the whitened `shift` beyond what unit-normal nuisances explain, the
// noncentrality of the likelihood ratio's chi-squared: s' (I + Z Z')^-1 s.
// REQUIRES: as many rows.
double information(const Eigen::VectorXd& shift, const Eigen::MatrixXd& nuisances);

// Cosine of two shifts in that metric, [-1, 1]; 0 when one is nothing.
double likeness(const Eigen::VectorXd& a, const Eigen::VectorXd& b,
                const Eigen::MatrixXd& nuisances);

// One way in which an effect may be there, and what it does to every trial.
struct Shift {
  EffectDraw draw;
  double strength = 0;   // share of the way to the bound at which `rows` were simulated
  Eigen::VectorXd rows;  // whitened, three a trial
};

// What a log of these trials would show, whitened by the noise that the problem's values say.
struct Signals {
  std::vector<Shift> shifts;  // several an effect: directions, places
  Eigen::MatrixXd nuisances;  // what no effect may claim, scaled to a prior s.d. of 1

  // The rows of these trials alone, in this order.
  Signals of(const std::vector<std::size_t>& trials) const;
};

// By differences of predictions at the problem's own values.  `effects`: of the table; those on the
// spread alone, and those that no strength lets be simulated, have no shift.  REQUIRES: a scenario
// with a diagnosis_subject(); a log that is not empty.  Errors: the farm's, and a robot that does
// not drive at all.
Result<Signals> signals(Farm& farm, const Problem& problem, const TrialLog& log,
                        const std::vector<std::size_t>& effects, std::uint64_t seed);

struct Visibility {
  std::string effect;
  std::string parameter;  // its first strength's key in the table
  std::string unit;
  // Distance from neutral at which a diagnosis names it nine times in ten, the median over the
  // shifts; none: not within the catalogue's bounds.  Motions are taken to grow in proportion.
  std::optional<double> size;
  double strength = 0;  // the same as a share of the way to the bound; may exceed 1
  std::string like;     // the effect that looks most like it; empty: there is no other
  double likeness = 0;  // |cosine|, the median over the shifts of the greatest
};

// One an effect that has shifts, in the table's order.
std::vector<Visibility> visibility(const Problem& problem, const Signals& signals);

// Chance that each effect is named, at these strengths (one an effect of `at`, by its name), the
// mean over effects and shifts.
double mean_power(const Problem& problem, const Signals& signals,
                  const std::vector<Visibility>& at);

}  // namespace gapfarm::plan
