// Hypotheses compete: base and hypothesis are fitted together, each with the same effort, and
// judged by what they predict of observations that no fit saw (Jamieson and Talwalkar 2016 for the
// halving of effort, Stone 1974 for the judgement).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "master/infer/fit.h"
#include "master/infer/settings.h"

namespace gapfarm::infer {

// Where a search begins: values of the hypothesis' own rows.
struct Start {
  Overrides at;
  std::vector<std::uint32_t> reach;  // ascending; what it can change; empty: all observations
};

struct Hypothesis {
  std::string name;
  std::vector<Coordinate> coordinates;
  std::vector<Start> starts;  // beside none at all, where slopes lead away from it
  bool from_neutral = true;   // whether they do
  // Nats that its best fit gains by chance beyond half a one a dimension: that its start is the
  // best of many places was seen in all observations.
  double luck = 0;
  // What has a place: the observations that it can change there (ascending; the others are as
  // without it), and nats that it promises to first order.  Its slopes lie, since ends jump as a
  // drive comes to pass by its edge.
  std::function<std::vector<std::uint32_t>(const Overrides&)> touched = {};
  double promised = 0;
};

// What explains the observations so far.
struct Model {
  Space space;
  Fit fit;                       // slopes are its own
  std::vector<double> held_out;  // log score of each observation, nats
};
// Errors: the simulation's own, and a fit at a point that it cannot simulate.
Result<Model> model_of(const Forward& forward, const Observations& observations, Space space,
                       Fit fit);

struct Contender {
  std::size_t hypothesis = 0;
  Model model;
  double gain = 0;     // nats over all observations beyond the model it is added to: gain_over()
  double gain_se = 0;  // its standard error, over observations
};

struct Contest {
  Model base;                         // refitted from where the best has it
  std::vector<Contender> contenders;  // best first; of equal ones the first of the hypotheses
};

// Whether every hypothesis is searched from afar, or from where it does nothing and as far as
// slopes promise something: near a base that explains the log they can be trusted.
enum class Effort { kGlobal, kLocal };

// How far a hypothesis has come, for who watches: nats in sample beyond the base alone.
struct Standing {
  std::string name;
  double gain = 0;
};
using OnStandings = std::function<void(const std::vector<Standing>&)>;

struct Terms {
  Effort effort = Effort::kGlobal;
  // Other values of the base from which a global search begins: the one that was tuned alone may
  // have been drawn to where no hypothesis leads back from.
  std::vector<Overrides> bases;
  double least_gain = kLeastPromise;  // nats: less is not followed
};

// No contenders where none leads anywhere.  Errors: the simulation's own.
Result<Contest> compete(const Forward& forward, const Observations& observations, Model base,
                        const std::vector<Hypothesis>& hypotheses, const Terms& terms,
                        const OnStandings& on_standings);

// Mean and standard error of a sum of paired differences.
struct PairedGain {
  double sum = 0, se = 0;
};
PairedGain paired_gain(const std::vector<double>& with, const std::vector<double>& without);

// What a model predicts better of observations that no fit saw, and what its first `common`
// coordinates, which both have, need no longer be away from their priors: nuisances that stand in
// for a missing effect predict held-out observations well, but at a price.
PairedGain gain_over(const Model& with, const Model& without, Eigen::Index common);

}  // namespace gapfarm::infer
