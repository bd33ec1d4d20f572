#include "master/ground/fit/simulated_start.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "common/base/ranges.h"
#include "common/math/algebra.h"
#include "common/score/kinematic_start.h"
#include "master/ground/fit/kinematic_baseline.h"
#include "master/ground/fit/simulation_fit.h"

namespace gapfarm {
namespace {

constexpr int kMostRounds = 24;
constexpr int kRaceRounds = 3;  // of every start, before the best go on
// What windows of one run show is less than their number says: how much more than one of them a
// value's start counts is tried on stretches that were held out.
constexpr std::array<double, 6> kHolds = {1, 3, 10, 30, 100, 300};
constexpr int kSharpenings = 4;
constexpr double kFirmly = 1000;   // held where nothing slips
constexpr double kWorseCosts = 1;  // nats a window for errors e times as large
// Position and heading count alike, and what is worse than the kinematics' more.
constexpr double kHeadingCounts = 2;
constexpr int kEmphases = 3;
constexpr double kEmphasis = 4;  // power of the ratio
constexpr double kMostLogRatio = 0.26;
constexpr double kAsGood = 1.02;   // a ratio that is not worth climbing for
constexpr std::size_t kLooks = 3;  // starts a gene that kinematics do not show
// What is left to find is mostly the noise: a search that has the windows' whole spread to roam in
// trades ends for the noise's likelihood.
constexpr double kFoundSpread = 0.1;  // of what the windows leave unsure
constexpr double kHeldSpread = 1e-3;

double emphasis_of(const Unsure& log_ratio) {
  return std::exp(kEmphasis * std::clamp(log_ratio.value, 0.0, kMostLogRatio));
}

}  // namespace

// What kinematics show is moved to suit the rest, by the slopes of the first climb.
Status SimulationFit::settle(std::vector<std::optional<At>>* looks, const std::vector<Hold>& holds,
                             const Climb& first) {
  std::vector<Genome> genomes;
  std::vector<std::size_t> whose;
  std::vector<Hold> held;
  for (std::size_t k = 0; k < looks->size(); ++k) {
    const std::optional<At>& look = (*looks)[k];
    if (!look) continue;
    NormalEquations equations = equations_at(*look, holds[k], first.slopes);
    for (std::size_t j = 0; j < fitted_rows_.size(); ++j) {
      if (!contains(untold_, fitted_rows_[j])) continue;
      const auto row = static_cast<Eigen::Index>(j);
      equations.H.row(row).setZero();
      equations.H.col(row).setZero();
      equations.H(row, row) = 1;
      equations.g[row] = 0;
    }
    genomes.push_back(moved(*look, equations));
    whose.push_back(k);
    held.push_back(holds[k]);
  }
  ASSIGN_OR_RETURN(auto settled, look_at(genomes, held));
  for (std::size_t j = 0; j < whose.size(); ++j) {
    std::optional<At>& look = (*looks)[whose[j]];
    if (settled[j] && settled[j]->nats > look->nats) look = std::move(settled[j]);
  }
  return {};
}

Result<std::vector<Climb>> SimulationFit::other_climbs(const Climb& first) {
  std::vector<Climb> climbs;
  if (untold_.size() < 2 || first.slopes.empty()) return climbs;
  const auto starts = spread_starts(start_, untold_, kLooks * untold_.size());
  std::vector<Hold> holds = mapped(starts, [](const Genome& start) { return Hold{start, 1}; });
  ASSIGN_OR_RETURN(auto looks, look_at(starts, holds));
  for (int round = 0; round < 2; ++round) {
    RETURN_IF_ERROR(settle(&looks, holds, first));
  }
  for (std::size_t k = 0; k < looks.size(); ++k) {
    std::optional<At>& look = looks[k];
    if (look) climbs.push_back({std::move(*look), holds[k]});
  }
  std::stable_sort(climbs.begin(), climbs.end(),
                   [](const Climb& a, const Climb& b) { return a.at.nats > b.at.nats; });
  climbs.resize(std::min(climbs.size(), untold_.size() / 2));
  return climbs;
}

WindowEnds SimulationFit::held_out(const Climb& climb, const Hold& hold) const {
  return held_out_ends(*errors_, climb.at.ends, climb.slopes, prior_at(climb.at.genome, hold),
                       stretches_);
}

// The same by simulations at the values of every step: where contacts begin to slip the first order
// promises what is not to be had.
Result<WindowEnds> SimulationFit::simulated_held_out(const Climb& climb) {
  const auto steps = held_out_steps(*errors_, climb.at.ends, climb.slopes,
                                    prior_at(climb.at.genome, climb.hold), stretches_);
  std::vector<Genome> genomes;
  for (const Eigen::VectorXd& step : steps) {
    genomes.push_back(with_fitted_values(climb.at.genome, fitted_values(climb.at.genome) - step));
  }
  ASSIGN_OR_RETURN(const auto there, look_at(genomes, {climb.hold}));
  WindowEnds ends = held_out(climb, climb.hold);
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const std::optional<At>& at = there[stretches_[i]];
    if (at) ends[i] = at->ends[i];
  }
  return ends;
}

// What is better must be so significantly: a standard error is taken off every gain.
SimulationFit::Predicted SimulationFit::predicted(const WindowEnds& ends) const {
  const Unsure gain = plain_->gain(ends, baseline_, parts_);
  Predicted of{gain.value, 0, gain.error - gain.value};
  for (const auto& ratios : plain_->log_ratios(ends, baseline_, parts_)) {
    for (const Unsure& ratio : ratios) {
      of.worst = std::max(of.worst, std::exp(ratio.value));
      of.cost += kWorseCosts * std::max(ratio.value + ratio.error, 0.0);
    }
  }
  return of;
}

// From where the climb stands, with another hold or other errors.
Status SimulationFit::climb_again(Climb* climb) {
  climb->at.nats = errors_->nats(climb->at.ends) - cost_of(climb->at.genome, climb->hold);
  climb->over = false;
  return climb_on(climb, kMostRounds);
}

// What stands on the kinematics' values and hardly slips.
Result<std::optional<Climb>> SimulationFit::firm_climb() {
  if (firm_ == start_ && untold_.empty()) return std::optional<Climb>();
  const Hold hold{firm_, 1, kFirmly};
  ASSIGN_OR_RETURN(auto look, look_at({firm_}, {hold}));
  if (!look.front()) return std::optional<Climb>();
  Climb climb{*std::move(look.front()), hold};
  RETURN_IF_ERROR(climb_on(&climb, kMostRounds));
  return std::optional(std::move(climb));
}

// What predicts stretches that were held out best, held as firmly as is best for these.
Result<Climb> SimulationFit::best_of(std::vector<Climb> climbs) {
  const auto by_nats = [](const Climb& a, const Climb& b) { return a.at.nats > b.at.nats; };
  for (Climb& climb : climbs) {
    RETURN_IF_ERROR(climb_on(&climb, kRaceRounds));
  }
  std::erase_if(climbs, [](const Climb& climb) { return climb.slopes.empty(); });
  std::stable_sort(climbs.begin(), climbs.end(), by_nats);
  if (climbs.size() > 2) climbs.resize(2);
  for (Climb& climb : climbs) {
    RETURN_IF_ERROR(climb_on(&climb, kMostRounds));
  }
  ASSIGN_OR_RETURN(auto firm, firm_climb());
  if (firm) climbs.push_back(*std::move(firm));
  std::size_t best = 0;
  Hold held = climbs.front().hold;
  double least = INFINITY;
  for (std::size_t k = 0; k < climbs.size(); ++k) {
    if (climbs[k].slopes.empty()) continue;
    double cost = INFINITY;
    const Hold hold = best_hold(climbs[k], &cost);
    if (!(cost < least)) continue;
    best = k;
    held = hold;
    least = cost;
  }
  Climb chosen = std::move(climbs[best]);
  if (held.strength != chosen.hold.strength) {
    chosen.hold = held;
    RETURN_IF_ERROR(climb_again(&chosen));
  }
  ASSIGN_OR_RETURN(auto sharp, sharpen(std::move(chosen)));
  return weigh_worse(std::move(sharp));
}

// As firmly as predicts best what was held out; `cost` is that of it.
Hold SimulationFit::best_hold(const Climb& climb, double* cost) const {
  Hold best = climb.hold;
  *cost = INFINITY;
  for (const double strength : kHolds) {
    const Hold hold{climb.hold.start, strength, climb.hold.untold};
    const double own = predicted(held_out(climb, hold)).cost;
    if (!(own < *cost)) continue;
    best = hold;
    *cost = own;
  }
  return best;
}

// Kinematics that leave much more than the simulation are no measure of which windows lie far off.
Result<Climb> SimulationFit::sharpen(Climb best) {
  for (int round = 0; round < kSharpenings && !best.slopes.empty(); ++round) {
    const WindowEnds ends = held_out(best, best.hold);
    if (!plain_->sharpen(ends)) break;
    errors_->sharpen(ends);
    Climb next = best;
    RETURN_IF_ERROR(climb_again(&next));
    double cost = INFINITY;
    next.hold = best_hold(next, &cost);
    RETURN_IF_ERROR(climb_again(&next));
    const double before = predicted(held_out(best, best.hold)).cost;
    if (!(predicted(held_out(next, next.hold)).cost < before)) break;
    best = std::move(next);
  }
  return best;
}

// What is predicted worse than by the kinematics counts more, as long as that helps.
Result<Climb> SimulationFit::weigh_worse(Climb best) {
  for (int round = 0; round < kEmphases && !best.slopes.empty(); ++round) {
    const WindowEnds ends = held_out(best, best.hold);
    if (predicted(ends).worst <= kAsGood) break;
    std::vector<std::array<double, 2>> factors;
    for (const auto& [position, heading] : plain_->log_ratios(ends, baseline_, parts_)) {
      factors.push_back({emphasis_of(position), emphasis_of(heading)});
    }
    errors_->emphasise(factors);
    Climb next = best;
    RETURN_IF_ERROR(climb_again(&next));
    if (predicted(held_out(next, next.hold)).cost >= predicted(ends).cost) break;
    best = std::move(next);
  }
  return best;
}

// Against the kinematics, whose values in the simulation are `begin` or, without slip, stand firm.
Status SimulationFit::judge(const Climb& best, const At& begin, SimulatedStart* found) {
  ASSIGN_OR_RETURN(const auto met, simulated_held_out(best));
  const Predicted own = predicted(met);
  found->held_out_gain = own.gain;
  found->worst_ratio = own.worst;
  const WindowEnds ends = window_errors(problem_, kinematic_ends(problem_, kinematics_));
  ASSIGN_OR_RETURN(auto firm, look_at({firm_}, {Hold{firm_}}));
  double least = own.cost;
  for (const At& at : {begin, firm.front().value_or(begin)}) {
    // What the simulation makes of the kinematics' values is nearly what they make of them.
    WindowEnds predicts = baseline_;
    for (std::size_t i = 0; i < ends.size(); ++i) predicts[i] += at.ends[i] - ends[i];
    const Predicted theirs = predicted(predicts);
    if (theirs.cost >= least) continue;
    least = theirs.cost;
    found->kinematic = true;
    found->genome = at.genome;
    found->worst_ratio = theirs.worst;
  }
  if (found->kinematic) return {};
  found->genome = best.at.genome;
  found->gain = (plain_->nats(best.at.ends) - plain_->nats(begin.ends)) /
                static_cast<double>(plain_->windows());
  return {};
}

void SimulationFit::take_spread(const Climb& climb, double widest, SimulatedStart* found) const {
  const auto n = static_cast<Eigen::Index>(start_.size());
  Eigen::MatrixXd precision = Eigen::MatrixXd::Identity(n, n) / (widest * widest);
  for (std::size_t j = 0; j < fitted_rows_.size(); ++j) {
    for (std::size_t k = 0; k < fitted_rows_.size(); ++k) {
      precision(fitted_rows_[j], fitted_rows_[k]) +=
          climb.equations.H(j, k) / (kFoundSpread * kFoundSpread);
    }
    if (!found->kinematic) continue;
    const auto own = static_cast<Eigen::Index>(fitted_rows_[j]);
    precision(own, own) += 1 / (kHeldSpread * kHeldSpread);
  }
  const Eigen::MatrixXd spread = inverse_of_symmetric(precision);
  found->spread.assign(spread.data(), spread.data() + spread.size());
}

Result<SimulatedStart> SimulationFit::run(double widest) {
  ASSIGN_OR_RETURN(const auto kinematics, fit_kinematics(problem_));
  kinematics_ = kinematics;
  std::vector<double> durations_s;
  for (const Trial& trial : problem_.log.trials) durations_s.push_back(*trial.duration_s);
  plain_.emplace(durations_s, window_errors(problem_, kinematic_ends(problem_, kinematics_)));
  errors_ = plain_;
  errors_->emphasise(std::vector<std::array<double, 2>>(errors_->lengths(), {1, kHeadingCounts}));
  baseline_ = kinematic_held_out(problem_, kinematics_, *plain_, stretches_);
  const ParameterValues values = kinematic_start(problem_, kinematics_);
  const ParameterValues grip = without_slip(problem_, values);
  for (const Gene& gene : problem_.genes) {
    start_.push_back(encode_gene(problem_.table(), gene, values[gene.row]));
    firm_.push_back(encode_gene(problem_.table(), gene, grip[gene.row]));
  }
  const Hold hold{start_, 1};
  ASSIGN_OR_RETURN(auto first, look_at({start_}, {hold}));
  SimulatedStart found;
  found.genome = start_;
  found.simulations = simulations_;
  if (!first.front() || fitted_rows_.empty()) return found;
  const At begin = *first.front();
  std::vector<Climb> climbs = {{begin, hold}};
  RETURN_IF_ERROR(step(&climbs.front()));
  found.simulations = simulations_;
  if (climbs.front().slopes.empty()) return found;
  ASSIGN_OR_RETURN(auto others, other_climbs(climbs.front()));
  for (Climb& climb : others) climbs.push_back(std::move(climb));
  found.starts = climbs.size();
  ASSIGN_OR_RETURN(const auto best, best_of(std::move(climbs)));
  RETURN_IF_ERROR(judge(best, begin, &found));
  found.simulations = simulations_;
  take_spread(best, widest, &found);
  return found;
}

Result<SimulatedStart> fit_by_simulation(Farm& farm, const Problem& problem, double widest) {
  return SimulationFit(farm, problem).run(widest);
}

std::vector<Genome> spread_starts(const Genome& middle, std::span<const std::size_t> free,
                                  std::size_t count) {
  constexpr double kReach = 0.3;  // of a gene's range, either way
  // The root of x^(d+1) = x + 1: its powers fill d dimensions most evenly (Roberts 2018).
  double root = 1.5;
  for (int k = 0; k < 60; ++k) {
    root = std::pow(1 + root, 1 / (static_cast<double>(free.size()) + 1));
  }
  std::vector<Genome> starts(count, middle);
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t d = 0; d < free.size(); ++d) {
      const double turn =
          0.5 + static_cast<double>(k + 1) * std::pow(root, -static_cast<double>(d + 1));
      double& value = starts[k][free[d]];
      value = std::abs(value + kReach * (2 * (turn - std::floor(turn)) - 1));  // bounds reflect
      if (value > 1) value = 2 - value;
    }
  }
  return starts;
}

}  // namespace gapfarm
