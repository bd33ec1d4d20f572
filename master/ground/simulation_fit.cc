#include "master/ground/simulation_fit.h"

#include <algorithm>

#include "master/ground/kinematic_rival.h"

namespace gapfarm {
namespace {

constexpr double kGeneStep = 0.01;  // to find slopes; contacts are noisy below
constexpr double kEnoughNats = 0.1;
constexpr std::size_t kStretches = 6;
constexpr std::size_t kParts = 12;    // of the log, that tell how sure a gain is
constexpr double kFreelyMoves = 0.3;  // of a gene's range, where the windows do not tell

}  // namespace

SimulationFit::SimulationFit(Farm& farm, const Problem& problem)
    : farm_(farm),
      problem_(problem),
      hash_(farm.add_problem(to_proto(problem))),
      stretches_(left_out_stretches(problem.log.trials, problem.runs, kStretches)),
      parts_(left_out_stretches(problem.log.trials, problem.runs, kParts)) {
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

double SimulationFit::strength_of(const Hold& hold, std::size_t gene) const {
  const bool untold = std::find(untold_.begin(), untold_.end(), gene) != untold_.end();
  return hold.strength * (untold ? hold.untold : 1);
}

double SimulationFit::cost_of(const Genome& genome, const Hold& hold) const {
  double sum = 0;
  for (const std::size_t g : told_) {
    const double moved = (genome[g] - hold.start[g]) / kFreelyMoves;
    sum += strength_of(hold, g) * moved * moved / 2;
  }
  return sum;
}

NormalEquations SimulationFit::prior_at(const Genome& genome, const Hold& hold) const {
  const auto n = static_cast<Eigen::Index>(told_.size());
  NormalEquations prior{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd(n)};
  for (std::size_t k = 0; k < told_.size(); ++k) {
    const std::size_t gene = told_[k];
    const auto row = static_cast<Eigen::Index>(k);
    prior.H(row, row) = strength_of(hold, gene) / (kFreelyMoves * kFreelyMoves);
    prior.g[row] = prior.H(row, row) * (genome[gene] - hold.start[gene]);
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

}  // namespace gapfarm
