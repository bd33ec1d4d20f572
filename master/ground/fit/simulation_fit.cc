#include "master/ground/fit/simulation_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/ranges.h"
#include "common/math/algebra.h"
#include "common/score/kinematic_start.h"

namespace gapfarm {
namespace {

constexpr double kGeneStep = 0.01;     // to find slopes; contacts are noisy below
constexpr double kEnoughNats = 1;      // less is within a standard error or so of the values
constexpr double kLeastSecant = 3e-3;  // of a move from which slopes can be measured
constexpr std::array<double, 2> kDampings = {0, 1};
constexpr std::array<double, 3> kGreatDampings = {10, 100, 1000};
constexpr std::size_t kStretches = 6;
constexpr std::size_t kParts = 12;    // of the log, that show how sure a gain is
constexpr double kFreelyMoves = 0.3;  // of a gene's range, where the windows do not show

}  // namespace

SimulationFit::SimulationFit(Farm& farm, const Problem& problem)
    : farm_(farm),
      problem_(problem),
      hash_(farm.add_problem(to_proto(problem))),
      stretches_(held_out_stretches(problem.log.trials, problem.runs, kStretches)),
      parts_(held_out_stretches(problem.log.trials, problem.runs, kParts)) {
  const std::vector<bool> kinematic = identified_by_kinematics(problem);
  for (std::size_t g = 0; g < problem.genes.size(); ++g) {
    const Parameter& row = problem.table()[problem.genes[g].row];
    const bool noise = row.key.find("_noise_") != std::string::npos;
    if (noise || row.kind != ParameterKind::kReal) continue;
    fitted_rows_.push_back(g);
    if (!kinematic[g]) untold_.push_back(g);
  }
}

Result<std::vector<std::optional<At>>> SimulationFit::look_at(const std::vector<Genome>& genomes,
                                                              const std::vector<Hold>& holds) {
  const auto tasks = mapped(genomes, [](const Genome& g) { return prediction_task(g, true); });
  simulations_ += tasks.size();
  ASSIGN_OR_RETURN(const auto results, farm_.run(hash_, tasks));
  std::vector<std::optional<At>> all;
  for (std::size_t k = 0; k < genomes.size(); ++k) {
    const v1::TaskResult& result = results[k];
    all.emplace_back();
    if (result.outcome() != v1::OK) continue;
    std::vector<Pose> ends = mapped(result.predict().predictions(),
                                    [](const v1::Predicted& p) { return from_proto(p.end()); });
    At at{genomes[k], window_errors(problem_, ends), 0};
    at.nats = errors_->nats(at.ends);
    at.nats -= cost_of(at.genome, holds[holds.size() == 1 ? 0 : k]);
    all.back() = std::move(at);
  }
  return all;
}

double SimulationFit::strength_of(const Hold& hold, std::size_t gene) const {
  const bool untold = contains(untold_, gene);
  return hold.strength * (untold ? hold.untold : 1);
}

double SimulationFit::cost_of(const Genome& genome, const Hold& hold) const {
  double sum = 0;
  for (const std::size_t g : fitted_rows_) {
    const double moved = (genome[g] - hold.start[g]) / kFreelyMoves;
    sum += strength_of(hold, g) * moved * moved / 2;
  }
  return sum;
}

NormalEquations SimulationFit::prior_at(const Genome& genome, const Hold& hold) const {
  const auto n = static_cast<Eigen::Index>(fitted_rows_.size());
  NormalEquations prior{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd(n)};
  for (std::size_t k = 0; k < fitted_rows_.size(); ++k) {
    const std::size_t gene = fitted_rows_[k];
    prior.H(k, k) = strength_of(hold, gene) / (kFreelyMoves * kFreelyMoves);
    prior.g[k] = prior.H(k, k) * (genome[gene] - hold.start[gene]);
  }
  return prior;
}

Eigen::VectorXd SimulationFit::fitted_values(const Genome& genome) const {
  return vector_of(fitted_rows_, [&](std::size_t gene) { return genome[gene]; });
}

Genome SimulationFit::moved(const At& at, const NormalEquations& equations) const {
  return with_fitted_values(at.genome, step_within_bounds(equations, fitted_values(at.genome)));
}

Genome SimulationFit::with_fitted_values(const Genome& genome,
                                         const Eigen::VectorXd& values) const {
  Genome to = genome;
  for (std::size_t k = 0; k < fitted_rows_.size(); ++k) {
    to[fitted_rows_[k]] = std::clamp(values[k], 0.0, 1.0);
  }
  return to;
}

NormalEquations SimulationFit::equations_at(const At& at, const Hold& hold,
                                            const WindowSlopes& slopes) const {
  NormalEquations equations = normal_equations(*errors_, at.ends, slopes);
  const NormalEquations prior = prior_at(at.genome, hold);
  equations.H += prior.H;
  equations.g += prior.g;
  return equations;
}

Status SimulationFit::look_round(Climb* climb) {
  const At& at = climb->at;
  if (climb->sloped == at.genome) return {};
  std::vector<Genome> genomes;
  for (const std::size_t gene : fitted_rows_) {
    genomes.push_back(at.genome);
    double& value = genomes.back()[gene];
    value += value + kGeneStep > 1 ? -kGeneStep : kGeneStep;
  }
  ASSIGN_OR_RETURN(const auto beside, look_at(genomes, {climb->hold}));
  climb->over = std::any_of(beside.begin(), beside.end(), [](const auto& b) { return !b; });
  if (climb->over) return {};
  climb->sloped = at.genome;
  climb->slopes.assign(at.ends.size(), Eigen::MatrixXd(3, fitted_rows_.size()));
  for (std::size_t k = 0; k < fitted_rows_.size(); ++k) {
    const At& there = *beside[k];
    const double step = there.genome[fitted_rows_[k]] - at.genome[fitted_rows_[k]];
    for (std::size_t i = 0; i < at.ends.size(); ++i) {
      climb->slopes[i].col(k) = (there.ends[i] - at.ends[i]) / step;
    }
  }
  return {};
}

// Broyden's: so that they say what this move did.
void SimulationFit::correct_slopes(const At& before, Climb* climb) const {
  const Eigen::VectorXd move = fitted_values(climb->at.genome) - fitted_values(before.genome);
  if (move.norm() < kLeastSecant) return;
  for (std::size_t i = 0; i < climb->slopes.size(); ++i) {
    Eigen::MatrixXd& slopes = climb->slopes[i];
    const Eigen::Vector3d missed = climb->at.ends[i] - before.ends[i] - slopes * move;
    slopes += missed * move.transpose() / move.squaredNorm();
  }
}

double SimulationFit::promised(const Climb& climb) const {
  const Eigen::VectorXd move =
      fitted_values(moved(climb.at, climb.equations)) - fitted_values(climb.at.genome);
  return -climb.equations.g.dot(move) - move.dot(climb.equations.H * move) / 2;
}

// The best of these, and the nats that it gains.
Result<double> SimulationFit::try_steps(Climb* climb, std::span<const double> dampings) {
  std::vector<Genome> genomes;
  for (const double damping : dampings) {
    NormalEquations damped = climb->equations;
    damped.H.diagonal() *= 1 + damping;
    genomes.push_back(moved(climb->at, damped));
  }
  ASSIGN_OR_RETURN(auto tried, look_at(genomes, {climb->hold}));
  const At before = climb->at;
  for (std::optional<At>& there : tried) {
    if (there && there->nats > climb->at.nats) climb->at = std::move(*there);
  }
  correct_slopes(before, climb);
  return climb->at.nats - before.nats;
}

// By the slopes that there are while these lead up, else by new ones, with greater dampings where
// the usual do not help.
Status SimulationFit::step(Climb* climb) {
  if (!climb->slopes.empty() && climb->sloped != climb->at.genome) {
    climb->equations = equations_at(climb->at, climb->hold, climb->slopes);
    ASSIGN_OR_RETURN(const auto gained, try_steps(climb, kDampings));
    if (gained >= kEnoughNats) return {};
  }
  if (Status s = look_round(climb); !s || climb->over) return s;
  climb->equations = equations_at(climb->at, climb->hold, climb->slopes);
  const bool worth_more = promised(*climb) >= kEnoughNats;
  ASSIGN_OR_RETURN(double gained, try_steps(climb, kDampings));
  if (gained == 0 && worth_more) {
    ASSIGN_OR_RETURN(gained, try_steps(climb, kGreatDampings));
  }
  climb->over = gained < kEnoughNats;
  return {};
}

Status SimulationFit::climb_on(Climb* climb, int rounds) {
  for (int k = 0; k < rounds && !climb->over; ++k) {
    RETURN_IF_ERROR(step(climb));
  }
  return {};
}

WindowEnds window_errors(const Problem& problem, const std::vector<Pose>& predicted) {
  WindowEnds ends;
  for (std::size_t i = 0; i < predicted.size(); ++i) {
    ends.push_back(local_difference(predicted[i], problem.log.trials[i].X_WE));
  }
  return ends;
}

}  // namespace gapfarm
