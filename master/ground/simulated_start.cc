#include "master/ground/simulated_start.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "common/score/algebra.h"
#include "common/score/kinematic_start.h"
#include "master/ground/kinematic_rival.h"
#include "master/ground/robust_errors.h"

namespace gapfarm {
namespace {

constexpr double kGeneStep = 0.01;  // to find slopes; contacts are noisy below
constexpr int kMostRounds = 24;
constexpr int kRaceRounds = 3;  // of every start, before the best go on
constexpr double kEnoughNats = 0.1;
// What windows of one run tell is less than their number says: how much more than one of them a
// value's start counts is tried on stretches that were left out.
constexpr std::array<double, 6> kHolds = {1, 3, 10, 30, 100, 300};
constexpr double kFreelyMoves = 0.3;  // of a gene's range, where the windows do not tell
constexpr std::size_t kStretches = 6;
constexpr std::size_t kLooks = 3;  // starts a gene that kinematics do not tell
// What is left to find is mostly the noise: a search that has the windows' whole spread to roam in
// trades ends for the noise's likelihood.
constexpr double kFoundSpread = 0.1;  // of what the windows leave unsure
constexpr double kHeldSpread = 1e-3;

// Everything at one genome.
struct At {
  Genome genome;
  WindowEnds ends;
  double nats = 0;  // of the windows, and of what was moved
};

// What values are held to, and how firmly.
struct Hold {
  Genome start;
  double strength = 1;
};

// One way uphill.
struct Climb {
  At at;
  Hold hold;
  WindowSlopes slopes;  // there, or one step before
  NormalEquations equations;
  bool over = false;
};

class SimulationFit {
 public:
  SimulationFit(Farm& farm, const Problem& problem);
  Result<SimulatedStart> run(double widest);

 private:
  Result<std::vector<std::optional<At>>> look_at(const std::vector<Genome>& genomes,
                                                 const std::vector<Hold>& holds);
  Status look_round(Climb* climb);  // slopes and equations
  Status step(Climb* climb);
  Status climb_on(Climb* climb, int rounds);
  Result<std::vector<Climb>> other_climbs(const Climb& first);
  Status settle(std::vector<std::optional<At>>* looks, const std::vector<Hold>& holds,
                const Climb& first);
  Genome moved(const At& at, const NormalEquations& equations) const;
  double cost_of(const Genome& genome, const Hold& hold) const;
  NormalEquations prior_at(const Genome& genome, const Hold& hold) const;
  double left_out(const Climb& climb, double strength) const;
  Result<Climb> best_of(std::vector<Climb> climbs);
  void judge(const Climb& best, const At& begin, SimulatedStart* found) const;
  void take_spread(const Climb& climb, double widest, SimulatedStart* found) const;

  Farm& farm_;
  const Problem& problem_;
  std::string hash_;
  Kinematics kinematics_;
  std::optional<RobustErrors> errors_;
  std::vector<std::size_t> told_;    // genes that move ends
  std::vector<std::size_t> untold_;  // those of them that kinematics have no word for
  std::vector<std::size_t> stretches_;
  Genome start_;
  std::size_t simulations_ = 0;
};

SimulationFit::SimulationFit(Farm& farm, const Problem& problem)
    : farm_(farm),
      problem_(problem),
      hash_(farm.add_problem(to_proto(problem))),
      stretches_(left_out_stretches(problem.log.trials, kStretches)) {
  const std::vector<bool> kinematic = told_by_kinematics(problem);
  for (std::size_t g = 0; g < problem.genes.size(); ++g) {
    const Parameter& row = problem.table()[problem.genes[g].row];
    const bool noise = row.key.find("_noise_") != std::string::npos;
    if (noise || row.kind != ParameterKind::kReal) continue;
    told_.push_back(g);
    if (!kinematic[g]) untold_.push_back(g);
  }
}

Result<std::vector<std::optional<At>>> SimulationFit::look_at(const std::vector<Genome>& genomes,
                                                              const std::vector<Hold>& holds) {
  std::vector<v1::Task> tasks;
  for (const Genome& genome : genomes) {
    v1::PredictTask* predict = tasks.emplace_back().mutable_predict();
    predict->mutable_point()->mutable_genome()->Assign(genome.begin(), genome.end());
    predict->set_means_only(true);
  }
  simulations_ += tasks.size();
  const auto results = farm_.run(hash_, tasks);
  if (!results) return results.error();
  std::vector<std::optional<At>> all;
  for (std::size_t k = 0; k < genomes.size(); ++k) {
    const v1::TaskResult& result = (*results)[k];
    all.emplace_back();
    if (result.outcome() != v1::OK) continue;
    std::vector<Pose> ends;
    for (const v1::Predicted& p : result.predict().predictions()) {
      ends.push_back(from_proto(p.end()));
    }
    At at{genomes[k], window_errors(problem_, ends), 0};
    at.nats = errors_->nats(at.ends);
    at.nats -= cost_of(at.genome, holds[holds.size() == 1 ? 0 : k]);
    all.back() = std::move(at);
  }
  return all;
}

double SimulationFit::cost_of(const Genome& genome, const Hold& hold) const {
  double sum = 0;
  for (const std::size_t g : told_) {
    const double moved = (genome[g] - hold.start[g]) / kFreelyMoves;
    sum += hold.strength * moved * moved / 2;
  }
  return sum;
}

NormalEquations SimulationFit::prior_at(const Genome& genome, const Hold& hold) const {
  const auto n = static_cast<Eigen::Index>(told_.size());
  const double precision = hold.strength / (kFreelyMoves * kFreelyMoves);
  NormalEquations prior{precision * Eigen::MatrixXd::Identity(n, n), Eigen::VectorXd(n)};
  for (std::size_t k = 0; k < told_.size(); ++k) {
    prior.g[static_cast<Eigen::Index>(k)] = precision * (genome[told_[k]] - hold.start[told_[k]]);
  }
  return prior;
}

Genome SimulationFit::moved(const At& at, const NormalEquations& equations) const {
  Eigen::VectorXd from(static_cast<Eigen::Index>(told_.size()));
  for (std::size_t k = 0; k < told_.size(); ++k) {
    from[static_cast<Eigen::Index>(k)] = at.genome[told_[k]];
  }
  const Eigen::VectorXd to = step_within_bounds(equations, from);
  Genome genome = at.genome;
  for (std::size_t k = 0; k < told_.size(); ++k) {
    genome[told_[k]] = to[static_cast<Eigen::Index>(k)];
  }
  return genome;
}

Status SimulationFit::look_round(Climb* climb) {
  const At& at = climb->at;
  std::vector<Genome> genomes;
  for (const std::size_t gene : told_) {
    genomes.push_back(at.genome);
    double& value = genomes.back()[gene];
    value += value + kGeneStep > 1 ? -kGeneStep : kGeneStep;
  }
  const auto beside = look_at(genomes, {climb->hold});
  if (!beside) return beside.error();
  climb->over = std::any_of(beside->begin(), beside->end(), [](const auto& b) { return !b; });
  if (climb->over) return {};
  climb->slopes.assign(at.ends.size(), Eigen::MatrixXd(3, static_cast<Eigen::Index>(told_.size())));
  for (std::size_t k = 0; k < told_.size(); ++k) {
    const At& there = *(*beside)[k];
    const double step = there.genome[told_[k]] - at.genome[told_[k]];
    for (std::size_t i = 0; i < at.ends.size(); ++i) {
      climb->slopes[i].col(static_cast<Eigen::Index>(k)) = (there.ends[i] - at.ends[i]) / step;
    }
  }
  climb->equations = normal_equations(*errors_, at.ends, climb->slopes);
  const NormalEquations prior = prior_at(at.genome, climb->hold);
  climb->equations.H += prior.H;
  climb->equations.g += prior.g;
  return {};
}

// The best of some dampings, of greater ones where none of the usual helps.
Status SimulationFit::step(Climb* climb) {
  if (Status s = look_round(climb); !s || climb->over) return s;
  const double before = climb->at.nats;
  for (const std::vector<double>& dampings :
       {std::vector<double>{0, 0.1, 1, 10}, std::vector<double>{100, 1000, 10000}}) {
    std::vector<Genome> genomes;
    for (const double damping : dampings) {
      NormalEquations damped = climb->equations;
      damped.H.diagonal() *= 1 + damping;
      genomes.push_back(moved(climb->at, damped));
    }
    auto tried = look_at(genomes, {climb->hold});
    if (!tried) return tried.error();
    for (std::optional<At>& there : *tried) {
      if (there && there->nats > climb->at.nats) climb->at = std::move(*there);
    }
    if (climb->at.nats > before) break;
  }
  climb->over = climb->at.nats - before < kEnoughNats;
  return {};
}

Status SimulationFit::climb_on(Climb* climb, int rounds) {
  for (int k = 0; k < rounds && !climb->over; ++k) {
    if (Status s = step(climb); !s) return s;
  }
  return {};
}

// What kinematics tell is moved to suit the rest, by the slopes of the first climb.
Status SimulationFit::settle(std::vector<std::optional<At>>* looks, const std::vector<Hold>& holds,
                             const Climb& first) {
  std::vector<Genome> genomes;
  std::vector<std::size_t> whose;
  std::vector<Hold> held;
  for (std::size_t k = 0; k < looks->size(); ++k) {
    const std::optional<At>& look = (*looks)[k];
    if (!look) continue;
    NormalEquations equations = normal_equations(*errors_, look->ends, first.slopes);
    const NormalEquations prior = prior_at(look->genome, holds[k]);
    equations.H += prior.H;
    equations.g += prior.g;
    for (std::size_t j = 0; j < told_.size(); ++j) {
      if (std::find(untold_.begin(), untold_.end(), told_[j]) == untold_.end()) continue;
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
  auto settled = look_at(genomes, held);
  if (!settled) return settled.error();
  for (std::size_t j = 0; j < whose.size(); ++j) {
    std::optional<At>& look = (*looks)[whose[j]];
    if ((*settled)[j] && (*settled)[j]->nats > look->nats) look = std::move((*settled)[j]);
  }
  return {};
}

Result<std::vector<Climb>> SimulationFit::other_climbs(const Climb& first) {
  std::vector<Climb> climbs;
  if (untold_.size() < 2 || first.slopes.empty()) return climbs;
  const auto starts = spread_starts(start_, untold_, kLooks * untold_.size());
  std::vector<Hold> holds;
  for (const Genome& start : starts) holds.push_back({start, 1});
  auto looks = look_at(starts, holds);
  if (!looks) return looks.error();
  for (int round = 0; round < 2; ++round) {
    if (Status s = settle(&*looks, holds, first); !s) return s.error();
  }
  for (std::size_t k = 0; k < looks->size(); ++k) {
    std::optional<At>& look = (*looks)[k];
    if (look) climbs.push_back({std::move(*look), holds[k], {}, {}, false});
  }
  std::stable_sort(climbs.begin(), climbs.end(),
                   [](const Climb& a, const Climb& b) { return a.at.nats > b.at.nats; });
  climbs.resize(std::min(climbs.size(), untold_.size() / 2));
  return climbs;
}

double SimulationFit::left_out(const Climb& climb, double strength) const {
  const Hold hold{climb.hold.start, strength};
  return left_out_nats(*errors_, climb.at.ends, climb.slopes, prior_at(climb.at.genome, hold),
                       stretches_);
}

// What foretells stretches that were left out best, held as firmly as is best for these.
Result<Climb> SimulationFit::best_of(std::vector<Climb> climbs) {
  const auto by_nats = [](const Climb& a, const Climb& b) { return a.at.nats > b.at.nats; };
  for (Climb& climb : climbs) {
    if (Status s = climb_on(&climb, kRaceRounds); !s) return s.error();
  }
  std::stable_sort(climbs.begin(), climbs.end(), by_nats);
  if (climbs.size() > 2) climbs.resize(2);
  std::size_t best = 0;
  double strength = 1, most = 0;
  for (std::size_t k = 0; k < climbs.size(); ++k) {
    if (Status s = climb_on(&climbs[k], kMostRounds); !s) return s.error();
    if (climbs[k].slopes.empty()) continue;
    for (const double held : kHolds) {
      const double nats = left_out(climbs[k], held);
      if (most != 0 && nats <= most) continue;
      best = k;
      strength = held;
      most = nats;
    }
  }
  Climb& chosen = climbs[best];
  if (strength > 1) {
    chosen.hold.strength = strength;
    chosen.at.nats = errors_->nats(chosen.at.ends) - cost_of(chosen.at.genome, chosen.hold);
    chosen.over = false;
    if (Status s = climb_on(&chosen, kMostRounds); !s) return s.error();
  }
  return std::move(chosen);
}

// Against the kinematics, whose values in the simulation are `begin`.
void SimulationFit::judge(const Climb& best, const At& begin, SimulatedStart* found) const {
  const double windows = static_cast<double>(errors_->windows());
  const WindowEnds ends = window_errors(problem_, kinematic_ends(problem_, kinematics_));
  const double rival = kinematic_left_out(problem_, kinematics_, *errors_, stretches_);
  const double own = left_out(best, best.hold.strength);
  found->left_out_gain = (own - rival) / windows;
  // What the simulation makes of the kinematics' values is nearly what they make of them.
  const double in_simulation = errors_->nats(begin.ends) - errors_->nats(ends);
  found->kinematic = rival + in_simulation > own;
  if (found->kinematic) return;
  found->genome = best.at.genome;
  found->gain = (errors_->nats(best.at.ends) - errors_->nats(begin.ends)) / windows;
}

void SimulationFit::take_spread(const Climb& climb, double widest, SimulatedStart* found) const {
  const auto n = static_cast<Eigen::Index>(start_.size());
  Eigen::MatrixXd precision = Eigen::MatrixXd::Identity(n, n) / (widest * widest);
  for (std::size_t j = 0; j < told_.size(); ++j) {
    for (std::size_t k = 0; k < told_.size(); ++k) {
      precision(static_cast<Eigen::Index>(told_[j]), static_cast<Eigen::Index>(told_[k])) +=
          climb.equations.H(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(k)) /
          (kFoundSpread * kFoundSpread);
    }
    if (!found->kinematic) continue;
    const auto own = static_cast<Eigen::Index>(told_[j]);
    precision(own, own) += 1 / (kHeldSpread * kHeldSpread);
  }
  const Eigen::MatrixXd spread = inverse_of_symmetric(precision);
  found->spread.assign(spread.data(), spread.data() + spread.size());
}

Result<SimulatedStart> SimulationFit::run(double widest) {
  const auto kinematics = fit_kinematics(problem_);
  if (!kinematics) return kinematics.error();
  kinematics_ = *kinematics;
  std::vector<double> durations_s;
  for (const Trial& trial : problem_.log.trials) durations_s.push_back(*trial.duration_s);
  errors_.emplace(durations_s, window_errors(problem_, kinematic_ends(problem_, kinematics_)));
  const ParameterValues values = kinematic_start(problem_, kinematics_);
  for (const Gene& gene : problem_.genes) {
    start_.push_back(encode_gene(problem_.table(), gene, values[gene.row]));
  }
  const Hold hold{start_, 1};
  auto first = look_at({start_}, {hold});
  if (!first) return first.error();
  SimulatedStart found;
  found.genome = start_;
  found.simulations = simulations_;
  if (!first->front() || told_.empty()) return found;
  const At begin = *first->front();
  std::vector<Climb> climbs = {{begin, hold, {}, {}, false}};
  if (Status s = step(&climbs.front()); !s) return s.error();
  found.simulations = simulations_;
  if (climbs.front().slopes.empty()) return found;
  auto others = other_climbs(climbs.front());
  if (!others) return others.error();
  for (Climb& climb : *others) climbs.push_back(std::move(climb));
  found.starts = climbs.size();
  const auto best = best_of(std::move(climbs));
  if (!best) return best.error();
  found.simulations = simulations_;
  judge(*best, begin, &found);
  take_spread(*best, widest, &found);
  return found;
}

}  // namespace

Result<SimulatedStart> fit_by_simulation(Farm& farm, const Problem& problem, double widest) {
  return SimulationFit(farm, problem).run(widest);
}

}  // namespace gapfarm
