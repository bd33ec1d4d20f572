#include "master/ground/fit/simulated_start.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "common/base/ranges.h"
#include "common/math/algebra.h"
#include "common/math/statistics.h"
#include "common/score/kinematic.h"
#include "master/ground/fit/kinematic_baseline.h"
#include "master/ground/fit/stretches.h"
#include "master/infer/compete.h"
#include "master/infer/fit.h"

namespace gapfarm {
namespace {

using infer::Coordinate;
using infer::Fit;
using infer::Fitter;
using infer::Model;
using infer::Space;

constexpr double kUnit = 0.05;         // of a gene's range: of a coordinate
constexpr double kFreelyMoves = 0.3;   // of a gene's range, where the windows do not show
constexpr std::size_t kStretches = 6;  // held out in turn
constexpr std::size_t kParts = 12;     // of the log, that show how sure a gain is
constexpr std::size_t kLooks = 3;      // starts a gene that kinematics do not show
constexpr int kClimbSteps = 40;
// What windows of one run show is less than their number says: how much more than one of them a
// value's start counts is tried on stretches that were held out.
constexpr std::array<double, 6> kHolds = {1, 3, 10, 30, 100, 300};
constexpr double kHeadingCounts = 2;  // as much as each direction of a position
constexpr double kLeastScale = 1e-5;  // m or rad
// What is left to find is mostly the noise: a search that has the windows' whole spread to roam in
// trades ends for the noise's likelihood.
constexpr double kFoundSpread = 0.1;  // of what the windows leave unsure
constexpr double kHeldSpread = 1e-3;

class SimulationFit {
 public:
  SimulationFit(Farm& farm, const Problem& problem);
  Result<SimulatedStart> run(double widest);

 private:
  Fitter fitter(const Space& space) const { return Fitter(forward_, observed_, space); }
  std::vector<Coordinate> coordinates(const Overrides& start) const;
  Overrides start_of(const Genome& genome) const;
  void observe(const Kinematics& kinematics);
  Result<std::vector<Genome>> starts(const Genome& slips, const Genome& grips) const;
  Eigen::VectorXd whitened(const std::vector<Eigen::Vector3d>& ends) const;
  // Weighted nats of the parts of the log.
  std::vector<double> by_parts(const std::vector<double>& scores) const;
  // The same of stretches that were held out.
  Result<std::vector<double>> held_out(const Model& model) const;
  double hold_best(Model* model) const;
  Result<Model> followed(Model model) const;  // to the end of its climb
  Result<Model> contest(Model kinematic, const std::vector<Genome>& starts) const;
  void take_spread(const Model& model, double widest, SimulatedStart* found) const;

  const Problem& problem_;
  Predictor predictor_;
  infer::Forward forward_;
  std::size_t simulations_ = 0;
  infer::Observations observed_;
  Eigen::VectorXd kinematic_, unseen_;  // of the kinematics: fitted to all, and held out
  std::vector<std::size_t> fitted_;     // genes that move ends
  std::vector<std::size_t> dynamic_;    // of them, those that kinematics have no word for
  std::vector<std::size_t> parts_;      // of each window
};

SimulationFit::SimulationFit(Farm& farm, const Problem& problem)
    : problem_(problem),
      predictor_(farm, problem),
      forward_([this](const auto& points) {
        simulations_ += points.size();
        return predictor_.attempt(points);
      }),
      parts_(held_out_stretches(problem.log.trials, problem.runs, kParts)) {
  const std::vector<bool> kinematic = identified_by_kinematics(problem);
  for (std::size_t g = 0; g < problem.genes.size(); ++g) {
    const Parameter& row = problem.table()[problem.genes[g].row];
    const bool noise = row.key.find("_noise_") != std::string::npos;
    if (noise || row.kind != ParameterKind::kReal) continue;
    fitted_.push_back(g);
    if (!kinematic[g]) dynamic_.push_back(g);
  }
}

std::vector<Coordinate> SimulationFit::coordinates(const Overrides& start) const {
  return mapped(fitted_, [&](std::size_t g) {
    const Gene& gene = problem_.genes[g];
    const bool log = gene.scale == ParameterScale::kLog;
    const auto of = [log](double value) { return log ? std::log(value) : value; };
    Coordinate c;
    c.kind = log ? Coordinate::Kind::kLogarithm : Coordinate::Kind::kLinear;
    c.row = gene.row;
    c.size = kUnit * (of(gene.upper) - of(gene.lower));
    c.within = Interval{gene.lower, gene.upper};
    c.prior_sd = kFreelyMoves / kUnit;
    c.centre = of(start.at(gene.row)) / c.size;
    return c;
  });
}

Overrides SimulationFit::start_of(const Genome& genome) const {
  Overrides at;
  for (const std::size_t g : fitted_) {
    const Gene& gene = problem_.genes[g];
    at[gene.row] = decode_gene(problem_.table(), gene, genome[g]);
  }
  return at;
}

// Windows, each length scaled by what the kinematics leave of it.
void SimulationFit::observe(const Kinematics& kinematics) {
  const std::vector<Trial>& trials = problem_.log.trials;
  const std::vector<Pose> ends = kinematic_ends(problem_, kinematics);
  const auto lengths = window_lengths(mapped(trials, [](const Trial& t) { return *t.duration_s; }));
  std::vector<std::array<std::vector<double>, 2>> sizes(1 + std::ranges::max(lengths));
  std::vector<Eigen::Vector3d> missed;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    missed.push_back(local_difference(ends[i], trials[i].X_WE));
    sizes[lengths[i]][0].push_back(missed[i].head<2>().norm() / std::sqrt(2.0));
    sizes[lengths[i]][1].push_back(std::abs(missed[i][2]));
  }
  observed_.measured = mapped(trials, &Trial::X_WE);
  observed_.weight = window_weights(lengths);
  observed_.fold = held_out_stretches(trials, problem_.runs, kStretches);
  observed_.least_scale = 1e-3;
  for (const std::size_t length : lengths) {
    const auto scale = [&](int part) {
      return std::max(1.3 * median(sizes[length][static_cast<std::size_t>(part)]), kLeastScale);
    };
    const Eigen::Vector3d scales(scale(0), scale(0), scale(1) / std::sqrt(kHeadingCounts));
    observed_.whitener.emplace_back(scales.cwiseInverse().asDiagonal());
  }
  kinematic_ = whitened(missed);
  unseen_ = whitened(kinematic_held_out(problem_, kinematics, observed_.fold));
}

Eigen::VectorXd SimulationFit::whitened(const std::vector<Eigen::Vector3d>& ends) const {
  Eigen::VectorXd z(static_cast<Eigen::Index>(3 * ends.size()));
  for (std::size_t i = 0; i < ends.size(); ++i) {
    z.segment<3>(static_cast<Eigen::Index>(3 * i)) = observed_.whitener[i] * ends[i];
  }
  return z;
}

std::vector<double> SimulationFit::by_parts(const std::vector<double>& scores) const {
  std::vector<double> sums(1 + std::ranges::max(parts_));
  for (std::size_t i = 0; i < scores.size(); ++i) {
    sums[parts_[i]] += observed_.weight[i] * scores[i] / static_cast<double>(scores.size());
  }
  return sums;
}

// The kinematics' values with and without slip, the better first; none where neither can be
// simulated.  Behind them the best of some others.
Result<std::vector<Genome>> SimulationFit::starts(const Genome& slips, const Genome& grips) const {
  std::vector<Genome> from = {slips, grips};
  if (dynamic_.size() >= 2) {
    for (Genome& g : spread_starts(slips, dynamic_, kLooks * dynamic_.size())) {
      from.push_back(std::move(g));
    }
  }
  const auto spaces = mapped(
      from, [&](const Genome& g) { return Space(problem_.table(), coordinates(start_of(g))); });
  std::vector<Eigen::VectorXd> points;
  for (std::size_t k = 0; k < from.size(); ++k) points.push_back(spaces[k].from(start_of(from[k])));
  ASSIGN_OR_RETURN(const auto fits, fitter(spaces.front()).starts(points, spaces));
  std::vector<std::size_t> order = indices(from.size());
  const auto better = [&](std::size_t a, std::size_t b) { return fits[a].score > fits[b].score; };
  std::stable_sort(order.begin(), order.begin() + 2, better);
  std::stable_sort(order.begin() + 2, order.end(), better);
  order.resize(std::min(order.size(), 2 + dynamic_.size() / 2));
  if (!std::isfinite(fits[order[0]].score)) order.clear();
  std::erase_if(order, [&](std::size_t k) { return !std::isfinite(fits[k].score); });
  return mapped(order, [&](std::size_t k) { return from[k]; });
}

// By simulations at the values that fit the other stretches: where contacts begin to slip the first
// order promises too much.
Result<std::vector<double>> SimulationFit::held_out(const Model& model) const {
  const Fitter fits = fitter(model.space);
  std::vector<Eigen::VectorXd> points;
  for (std::size_t f = 0; f <= std::ranges::max(observed_.fold); ++f) {
    points.push_back(fits.linear_step(model.fit, f).u);
  }
  ASSIGN_OR_RETURN(const auto there,
                   fits.starts(points, std::vector<Space>(points.size(), model.space)));
  Eigen::VectorXd z = model.fit.z;
  for (std::size_t i = 0; i < observed_.size(); ++i) {
    const Fit& of = there[observed_.fold[i]];
    const auto at = static_cast<Eigen::Index>(3 * i);
    if (of.z.size() > 0) z.segment<3>(at) = of.z.segment<3>(at);
  }
  return by_parts(fits.scores(z));
}

// Held to where it began as firmly as predicts best what was held out; the nats of that.
double SimulationFit::hold_best(Model* model) const {
  const std::vector<Coordinate> begun = model->space.all();
  double most = -INFINITY;
  for (const double hold : kHolds) {
    const Space held = model->space.only(mapped(begun, [&](Coordinate c) {
      c.prior_sd /= std::sqrt(hold);
      return c;
    }));
    const std::vector<double> scores = fitter(held).held_out(model->fit);
    const double nats = std::accumulate(scores.begin(), scores.end(), 0.0);
    if (!(nats > most)) continue;
    most = nats;
    model->space = held;
  }
  model->fit.score = fitter(model->space).known(model->fit.u, model->fit.z).score;
  model->fit.settled = false;
  return most;
}

Result<Model> SimulationFit::followed(Model model) const {
  RETURN_IF_ERROR(fitter(model.space).improve(&model.fit, kClimbSteps));
  return infer::model_of(forward_, observed_, std::move(model.space), std::move(model.fit));
}

// The best of the finalists, held so and followed to its end; the kinematics' where nobody gains.
Result<Model> SimulationFit::contest(Model kinematic, const std::vector<Genome>& starts) const {
  const auto hypotheses = mapped(starts, [&](const Genome& genome) {
    const Overrides at = start_of(genome);
    return infer::Hypothesis{"simulation", coordinates(at), {{at, {}}}, false};
  });
  const infer::Terms terms{infer::Effort::kLocal, {}, 0};
  ASSIGN_OR_RETURN(auto contest, infer::compete(forward_, observed_, std::move(kinematic),
                                                hypotheses, terms, {}));
  Model best = std::move(contest.base);
  double most = -INFINITY;
  for (infer::Contender& contender : contest.contenders) {
    ASSIGN_OR_RETURN(auto model, followed(std::move(contender.model)));
    const double nats = hold_best(&model);
    if (!(nats > most)) continue;
    most = nats;
    best = std::move(model);
  }
  return followed(std::move(best));
}

void SimulationFit::take_spread(const Model& model, double widest, SimulatedStart* found) const {
  const auto n = static_cast<Eigen::Index>(problem_.genes.size());
  Eigen::MatrixXd precision = Eigen::MatrixXd::Identity(n, n) / (widest * widest);
  const double unit = kUnit * kFoundSpread;
  const Eigen::MatrixXd known = fitter(model.space).normal(model.fit).matrix / (unit * unit);
  for (Eigen::Index j = 0; j < known.rows(); ++j) {
    for (Eigen::Index k = 0; k < known.rows(); ++k) {
      precision(fitted_[j], fitted_[k]) += known(j, k);
    }
  }
  for (const std::size_t g : fitted_) {
    if (found->kinematic) precision(g, g) += 1 / (kHeldSpread * kHeldSpread);
  }
  const Eigen::MatrixXd spread = inverse_of_symmetric(precision);
  found->spread.assign(spread.data(), spread.data() + spread.size());
}

Result<SimulatedStart> SimulationFit::run(double widest) {
  ASSIGN_OR_RETURN(const auto kinematics, fit_kinematics(problem_));
  observe(kinematics);
  const ParameterValues values = kinematic_start(problem_, kinematics);
  const auto genome_of = [&](const ParameterValues& of) {
    return mapped(problem_.genes, [&](const Gene& gene) {
      return encode_gene(problem_.table(), gene, of[gene.row]);
    });
  };
  SimulatedStart found;
  found.genome = genome_of(values);
  if (fitted_.empty()) return found;
  ASSIGN_OR_RETURN(const auto from,
                   starts(found.genome, genome_of(without_slip(problem_, values))));
  found.simulations = simulations_;
  if (from.empty()) return found;
  found.genome = from.front();
  found.starts = from.size();
  const Space held(problem_.table(), {}, start_of(from.front()));
  ASSIGN_OR_RETURN(auto there, fitter(held).start(Eigen::VectorXd(0)));
  ASSIGN_OR_RETURN(const auto kinematic,
                   infer::model_of(forward_, observed_, held, std::move(there)));
  ASSIGN_OR_RETURN(const auto best, contest(kinematic, from));
  ASSIGN_OR_RETURN(const auto own, held_out(best));
  // What the simulation makes of the kinematics' values is nearly what they make of them, of
  // stretches that they were not fitted to, too.
  const Eigen::VectorXd theirs = unseen_ + kinematic.fit.z - kinematic_;
  const infer::PairedGain gain =
      infer::paired_gain(own, by_parts(fitter(best.space).scores(theirs)));
  // Of one stretch nothing can be held out, and no fit to it shows what it predicts.
  const auto& folds = observed_.fold;
  const bool one = std::ranges::count(folds, folds.front()) == std::ssize(folds);
  found.held_out_gain = one ? 0 : gain.sum;
  found.kinematic = one || gain.sum <= gain.se;
  if (!found.kinematic) {
    found.gain =
        (best.fit.score - kinematic.fit.score) / static_cast<double>(problem_.log.trials.size());
    const Overrides at = best.space.values(best.fit.u);
    found.genome = mapped(problem_.genes, [&](const Gene& gene) {
      return encode_gene(problem_.table(), gene, value_at(problem_, at, gene.row));
    });
  }
  found.simulations = simulations_;
  take_spread(best, widest, &found);
  return found;
}

}  // namespace

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
