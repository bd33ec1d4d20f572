#include "master/ground/simulated_start.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/score/algebra.h"
#include "common/score/kinematic_start.h"
#include "master/ground/robust_errors.h"

namespace gapfarm {
namespace {

constexpr double kGeneStep = 0.01;  // to find slopes; contacts are noisy below
constexpr int kMostRounds = 24;
constexpr int kRaceRounds = 3;  // of every start, before the best go on
constexpr double kEnoughNats = 0.1;
constexpr double kFreelyMoves = 0.3;  // of a gene's range, where the windows do not tell
constexpr std::size_t kStretches = 6;
constexpr std::size_t kLooks = 3;  // starts a gene that kinematics do not tell
// What is left to find is mostly the noise: a search that has the windows' whole spread to roam in
// trades ends for the noise's likelihood.
constexpr double kFoundSpread = 0.1;  // of what the windows leave unsure
constexpr double kHeldSpread = 1e-3;
constexpr double kKinematicsFreely = 1;  // of gains, m, s, rad: far more than windows leave

// Everything at one genome.
struct At {
  Genome genome;
  WindowEnds ends;
  double nats = 0;  // of the windows, and of what was moved
};

// One way uphill.
struct Climb {
  At at;
  WindowSlopes slopes;  // there, or one step before
  NormalEquations equations;
  bool over = false;
};

class SimulationFit {
 public:
  SimulationFit(Farm& farm, const Problem& problem);
  Result<SimulatedStart> run(double widest);

 private:
  Result<std::vector<std::optional<At>>> look_at(const std::vector<Genome>& genomes);
  Status look_round(Climb* climb);  // slopes and equations
  Status step(Climb* climb);
  Status climb_on(Climb* climb, int rounds);
  Result<std::vector<Climb>> other_climbs(const Climb& first);
  Status settle(std::vector<std::optional<At>>* looks, const Climb& first);
  Genome moved(const At& at, const NormalEquations& equations) const;
  NormalEquations prior_at(const Genome& genome) const;
  double left_out(const Climb& climb) const;
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

WindowEnds ends_of(const Problem& problem, const std::vector<Pose>& predicted) {
  WindowEnds ends;
  for (std::size_t i = 0; i < predicted.size(); ++i) {
    ends.push_back(local_difference(predicted[i], problem.log.trials[i].X_WE));
  }
  return ends;
}

WindowEnds kinematic_errors(const Problem& problem, const Kinematics& at) {
  return ends_of(problem, kinematic_ends(problem, at));
}

WindowSlopes kinematic_slopes(const Problem& problem, const Kinematics& at,
                              const WindowEnds& ends) {
  WindowSlopes slopes(ends.size(), Eigen::MatrixXd(3, at.values.size()));
  for (Eigen::Index k = 0; k < at.values.size(); ++k) {
    Kinematics moved = at;
    const double step = 1e-4 * std::max(1.0, std::abs(at.values[k]));
    moved.values[k] += step;
    const WindowEnds there = kinematic_errors(problem, moved);
    for (std::size_t i = 0; i < ends.size(); ++i) slopes[i].col(k) = (there[i] - ends[i]) / step;
  }
  return slopes;
}

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

Result<std::vector<std::optional<At>>> SimulationFit::look_at(const std::vector<Genome>& genomes) {
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
    At at{genomes[k], ends_of(problem_, ends), 0};
    at.nats = errors_->nats(at.ends);
    for (const std::size_t g : told_) {
      const double moved = (at.genome[g] - start_[g]) / kFreelyMoves;
      at.nats -= moved * moved / 2;
    }
    all.back() = std::move(at);
  }
  return all;
}

NormalEquations SimulationFit::prior_at(const Genome& genome) const {
  const auto n = static_cast<Eigen::Index>(told_.size());
  NormalEquations prior{Eigen::MatrixXd::Identity(n, n) / (kFreelyMoves * kFreelyMoves),
                        Eigen::VectorXd(n)};
  for (std::size_t k = 0; k < told_.size(); ++k) {
    prior.g[static_cast<Eigen::Index>(k)] =
        (genome[told_[k]] - start_[told_[k]]) / (kFreelyMoves * kFreelyMoves);
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
  const auto beside = look_at(genomes);
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
  const NormalEquations prior = prior_at(at.genome);
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
    auto tried = look_at(genomes);
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
Status SimulationFit::settle(std::vector<std::optional<At>>* looks, const Climb& first) {
  std::vector<Genome> genomes;
  std::vector<std::size_t> whose;
  for (std::size_t k = 0; k < looks->size(); ++k) {
    const std::optional<At>& look = (*looks)[k];
    if (!look) continue;
    NormalEquations equations = normal_equations(*errors_, look->ends, first.slopes);
    const NormalEquations prior = prior_at(look->genome);
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
  }
  auto settled = look_at(genomes);
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
  auto looks = look_at(spread_starts(start_, untold_, kLooks * untold_.size()));
  if (!looks) return looks.error();
  for (int round = 0; round < 2; ++round) {
    if (Status s = settle(&*looks, first); !s) return s.error();
  }
  for (std::optional<At>& look : *looks) {
    if (look) climbs.push_back({std::move(*look), {}, {}, false});
  }
  std::stable_sort(climbs.begin(), climbs.end(),
                   [](const Climb& a, const Climb& b) { return a.at.nats > b.at.nats; });
  climbs.resize(std::min(climbs.size(), untold_.size() / 2));
  return climbs;
}

double SimulationFit::left_out(const Climb& climb) const {
  return left_out_nats(*errors_, climb.at.ends, climb.slopes, prior_at(climb.at.genome),
                       stretches_);
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
  const WindowEnds kinematic = kinematic_errors(problem_, *kinematics);
  std::vector<double> durations_s;
  for (const Trial& trial : problem_.log.trials) durations_s.push_back(*trial.duration_s);
  errors_.emplace(durations_s, kinematic);
  const ParameterValues values = kinematic_start(problem_, *kinematics);
  for (const Gene& gene : problem_.genes) {
    start_.push_back(encode_gene(problem_.table(), gene, values[gene.row]));
  }
  auto first = look_at({start_});
  if (!first) return first.error();
  SimulatedStart found;
  found.genome = start_;
  found.simulations = simulations_;
  if (!first->front() || told_.empty()) return found;
  const At begin = *first->front();
  std::vector<Climb> climbs = {{begin, {}, {}, false}};
  if (Status s = step(&climbs.front()); !s) return s.error();
  found.simulations = simulations_;
  if (climbs.front().slopes.empty()) return found;
  auto others = other_climbs(climbs.front());
  if (!others) return others.error();
  for (Climb& climb : *others) climbs.push_back(std::move(climb));
  for (Climb& climb : climbs) {
    if (Status s = climb_on(&climb, kRaceRounds); !s) return s.error();
  }
  std::stable_sort(climbs.begin(), climbs.end(),
                   [](const Climb& a, const Climb& b) { return a.at.nats > b.at.nats; });
  found.starts = climbs.size();
  if (climbs.size() > 2) climbs.resize(2);
  for (Climb& climb : climbs) {
    if (Status s = climb_on(&climb, kMostRounds); !s) return s.error();
  }
  const Climb* best = nullptr;
  double most = 0;
  for (const Climb& climb : climbs) {
    if (climb.slopes.empty()) continue;
    const double nats = left_out(climb);
    if (best == nullptr || nats > most) most = nats;
    if (most == nats) best = &climb;
  }
  const double windows = static_cast<double>(errors_->windows());
  found.simulations = simulations_;
  if (best == nullptr) return found;
  const auto n = kinematics->values.size();
  const NormalEquations freely{
      Eigen::MatrixXd::Identity(n, n) / (kKinematicsFreely * kKinematicsFreely),
      Eigen::VectorXd::Zero(n)};
  const double rival = left_out_nats(
      *errors_, kinematic, kinematic_slopes(problem_, *kinematics, kinematic), freely, stretches_);
  found.left_out_gain = (most - rival) / windows;
  // What the simulation makes of the kinematics' values is nearly what they make of them.
  found.kinematic = rival + begin.nats - errors_->nats(kinematic) > most;
  found.genome = found.kinematic ? start_ : best->at.genome;
  found.gain = found.kinematic ? 0 : (best->at.nats - begin.nats) / windows;
  take_spread(*best, widest, &found);
  return found;
}

}  // namespace

std::vector<Genome> spread_starts(const Genome& middle, std::span<const std::size_t> free,
                                  std::size_t count) {
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
      const double away = kFreelyMoves * (2 * (turn - std::floor(turn)) - 1);
      double& value = starts[k][free[d]];
      value = std::abs(value + away);  // a bound reflects
      if (value > 1) value = 2 - value;
    }
  }
  return starts;
}

Result<SimulatedStart> fit_by_simulation(Farm& farm, const Problem& problem, double widest) {
  return SimulationFit(farm, problem).run(widest);
}

}  // namespace gapfarm
