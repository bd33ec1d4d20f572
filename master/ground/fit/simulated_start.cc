#include "master/ground/fit/simulated_start.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

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
using infer::Space;
using Ends = std::vector<Eigen::Vector3d>;  // measured less predicted: m, m, rad

constexpr double kUnit = 0.05;          // of a gene's range: of a coordinate
constexpr double kFreelyMoves = 0.3;    // of a gene's range, where the windows do not show
constexpr std::size_t kStretches = 6;   // held out in turn
constexpr std::size_t kParts = 12;      // of the log, that show how sure a gain is
constexpr std::size_t kLooks = 3;       // starts a gene that kinematics do not show
constexpr std::size_t kBestClimbs = 2;  // of all starts, to the end
constexpr int kRaceSteps = 4, kClimbSteps = 40;
constexpr double kHeadingCounts = 2;  // as much as each direction of a position
constexpr double kLeastScale = 1e-5;  // m or rad
// What windows of one run show is less than their number says: how much more than one of them a
// value's start counts is tried on stretches that were held out.
constexpr std::array<double, 6> kHolds = {1, 3, 10, 30, 100, 300};
// What is left to find is mostly the noise: a search that has the windows' whole spread to roam in
// trades ends for the noise's likelihood.
constexpr double kFoundSpread = 0.1;  // of what the windows leave unsure
constexpr double kHeldSpread = 1e-3;

double total_of(const std::vector<double>& of) {
  return std::accumulate(of.begin(), of.end(), 0.0);
}

class SimulationFit {
 public:
  SimulationFit(Farm& farm, const Problem& problem);
  Result<SimulatedStart> run(double widest);

 private:
  // A fit, and the space that it was made in.
  struct Climb {
    Space space;
    Fit fit;
  };

  // The first `kept` whatever they score, and the best of the others.
  static void keep_best(std::size_t count, std::ptrdiff_t kept, std::vector<Climb>* climbs) {
    std::stable_sort(climbs->begin() + kept, climbs->end(),
                     [](const Climb& a, const Climb& b) { return a.fit.score > b.fit.score; });
    if (climbs->size() > count)
      climbs->erase(climbs->begin() + static_cast<std::ptrdiff_t>(count), climbs->end());
  }

  Fitter fitter(const Space& space) const { return Fitter(forward_, observed_, space); }
  Coordinate coordinate(std::size_t gene, const Overrides& centre) const;
  Space space(const std::vector<std::size_t>& genes, const Overrides& start) const;
  Overrides start_of(const Genome& genome) const;
  Genome genome_at(const Overrides& at) const;
  void observe(const Kinematics& kinematics);
  Eigen::VectorXd whitened(const Ends& ends) const;
  Result<std::vector<Climb>> climbs(const Genome& start, const Genome& firm);
  Status follow(Climb* climb, int steps) const;
  // Weighted nats of the parts of the log, of stretches that were held out.
  std::vector<double> by_parts(const std::vector<double>& scores) const;
  Result<std::vector<double>> held_out(const Climb& climb) const;
  double hold_best(Climb* climb) const;
  Status judge(const Climb& best, const Genome& start, const Genome& firm, SimulatedStart* found);
  void take_spread(const Climb& climb, double widest, SimulatedStart* found) const;

  const Problem& problem_;
  Predictor predictor_;
  infer::Forward forward_;
  std::size_t simulations_ = 0;
  infer::Observations observed_;
  Ends kinematic_ends_, baseline_;   // of the kinematics: fitted to all, and held out
  std::vector<std::size_t> fitted_;  // genes that move ends
  // Of them, those that kinematics have a word for, and the others.
  std::vector<std::size_t> kinematic_, dynamic_;
  std::vector<std::size_t> parts_;  // of each window
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
    (kinematic[g] ? kinematic_ : dynamic_).push_back(g);
  }
}

Coordinate SimulationFit::coordinate(std::size_t g, const Overrides& centre) const {
  const Gene& gene = problem_.genes[g];
  const bool log = gene.scale == ParameterScale::kLog;
  const auto of = [log](double value) { return log ? std::log(value) : value; };
  Coordinate c;
  c.kind = log ? Coordinate::Kind::kLogarithm : Coordinate::Kind::kLinear;
  c.row = gene.row;
  c.size = kUnit * (of(gene.upper) - of(gene.lower));
  c.within = Interval{gene.lower, gene.upper};
  c.prior_sd = kFreelyMoves / kUnit;
  c.centre = of(centre.at(gene.row)) / c.size;
  return c;
}

// Genes that are none of these stand where they start.
Space SimulationFit::space(const std::vector<std::size_t>& genes, const Overrides& start) const {
  return Space(problem_.table(), mapped(genes, [&](std::size_t g) { return coordinate(g, start); }))
      .holding(start);
}

Overrides SimulationFit::start_of(const Genome& genome) const {
  Overrides at;
  for (const std::size_t g : fitted_) {
    const Gene& gene = problem_.genes[g];
    at[gene.row] = decode_gene(problem_.table(), gene, genome[g]);
  }
  return at;
}

Genome SimulationFit::genome_at(const Overrides& at) const {
  return mapped(problem_.genes, [&](const Gene& gene) {
    return encode_gene(problem_.table(), gene, value_at(problem_, at, gene.row));
  });
}

// Windows, each length scaled by what the kinematics leave of it.
void SimulationFit::observe(const Kinematics& kinematics) {
  const std::vector<Trial>& trials = problem_.log.trials;
  const std::vector<Pose> ends = kinematic_ends(problem_, kinematics);
  const auto lengths = window_lengths(mapped(trials, [](const Trial& t) { return *t.duration_s; }));
  std::vector<std::array<std::vector<double>, 2>> sizes(1 + std::ranges::max(lengths));
  for (std::size_t i = 0; i < trials.size(); ++i) {
    kinematic_ends_.push_back(local_difference(ends[i], trials[i].X_WE));
    sizes[lengths[i]][0].push_back(kinematic_ends_[i].head<2>().norm() / std::sqrt(2.0));
    sizes[lengths[i]][1].push_back(std::abs(kinematic_ends_[i][2]));
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
  baseline_ = kinematic_held_out(problem_, kinematics, observed_.fold);
}

Eigen::VectorXd SimulationFit::whitened(const Ends& ends) const {
  Eigen::VectorXd z(static_cast<Eigen::Index>(3 * ends.size()));
  for (std::size_t i = 0; i < ends.size(); ++i) {
    z.segment<3>(static_cast<Eigen::Index>(3 * i)) = observed_.whitener[i] * ends[i];
  }
  return z;
}

// From the kinematics' values first; no others where that cannot be simulated.
Result<std::vector<SimulationFit::Climb>> SimulationFit::climbs(const Genome& start,
                                                                const Genome& firm) {
  std::vector<Genome> from = {start};
  if (dynamic_.size() >= 2) {
    for (Genome& g : spread_starts(start, dynamic_, kLooks * dynamic_.size())) {
      from.push_back(std::move(g));
    }
  }
  std::vector<Space> spaces =
      mapped(from, [&](const Genome& g) { return space(fitted_, start_of(g)); });
  std::vector<Eigen::VectorXd> points;
  for (std::size_t k = 0; k < from.size(); ++k) points.push_back(spaces[k].from(start_of(from[k])));
  ASSIGN_OR_RETURN(const auto fits, fitter(spaces.front()).starts(points, spaces));
  std::vector<Climb> all;
  for (std::size_t k = 0; k < fits.size(); ++k) {
    if (!std::isfinite(fits[k].score)) continue;
    all.push_back({spaces[k], fitter(spaces[k]).known(points[k], fits[k].z)});
  }
  const Space grips = space(kinematic_, start_of(firm));
  ASSIGN_OR_RETURN(auto fit, fitter(grips).start(grips.from(start_of(firm))));
  all.push_back({grips, std::move(fit)});
  if (!std::isfinite(fits.front().score)) all.clear();
  return all;
}

Status SimulationFit::follow(Climb* climb, int steps) const {
  const Fitter fits = fitter(climb->space);
  RETURN_IF_ERROR(fits.improve(&climb->fit, steps));
  if (climb->fit.fresh || !std::isfinite(climb->fit.score)) return {};
  return fits.differentiate(&climb->fit);
}

std::vector<double> SimulationFit::by_parts(const std::vector<double>& scores) const {
  std::vector<double> sums(1 + std::ranges::max(parts_));
  for (std::size_t i = 0; i < scores.size(); ++i) {
    sums[parts_[i]] += observed_.weight[i] * scores[i] / static_cast<double>(scores.size());
  }
  return sums;
}

// By simulations at the values that fit the other stretches: where contacts begin to slip the first
// order promises too much.
Result<std::vector<double>> SimulationFit::held_out(const Climb& climb) const {
  const Fitter fits = fitter(climb.space);
  std::vector<Eigen::VectorXd> points;
  for (std::size_t f = 0; f <= std::ranges::max(observed_.fold); ++f) {
    points.push_back(fits.linear_step(climb.fit, f).u);
  }
  ASSIGN_OR_RETURN(const auto there,
                   fits.starts(points, std::vector<Space>(points.size(), climb.space)));
  Eigen::VectorXd z = climb.fit.z;
  for (std::size_t i = 0; i < observed_.size(); ++i) {
    const Fit& of = there[observed_.fold[i]];
    const auto at = static_cast<Eigen::Index>(3 * i);
    if (of.z.size() > 0) z.segment<3>(at) = of.z.segment<3>(at);
  }
  return by_parts(fits.scores(z));
}

// Held to where it began as firmly as predicts best what was held out; the nats of that.
double SimulationFit::hold_best(Climb* climb) const {
  const std::vector<Coordinate> begun = climb->space.all();
  double most = -INFINITY;
  for (const double hold : kHolds) {
    const Space held = climb->space.only(mapped(begun, [&](Coordinate c) {
      c.prior_sd /= std::sqrt(hold);
      return c;
    }));
    const double nats = total_of(by_parts(fitter(held).held_out(climb->fit)));
    if (!(nats > most)) continue;
    most = nats;
    climb->space = held;
  }
  climb->fit.score = fitter(climb->space).known(climb->fit.u, climb->fit.z).score;
  climb->fit.settled = false;
  return most;
}

// Against the kinematics, whose values in the simulation are `start` or, without slip, `firm`.
Status SimulationFit::judge(const Climb& best, const Genome& start, const Genome& firm,
                            SimulatedStart* found) {
  // Of one stretch nothing can be held out, and no fit to it shows what it predicts.
  const auto& folds = observed_.fold;
  found->kinematic = std::ranges::count(folds, folds.front()) == std::ssize(folds);
  if (found->kinematic) return {};
  ASSIGN_OR_RETURN(const auto own, held_out(best));
  const Fitter fits = fitter(best.space);
  const auto theirs = by_parts(fits.scores(whitened(baseline_)));
  const infer::PairedGain gain = infer::paired_gain(own, theirs);
  found->held_out_gain = gain.sum;
  found->genome = genome_at(best.space.values(best.fit.u));
  double most = gain.sum - gain.se;
  const std::array<const Genome*, 2> kinematic = {&start, &firm};
  for (const Genome* genome : kinematic) {
    const Space at = space({}, start_of(*genome));
    ASSIGN_OR_RETURN(const Fit there, fitter(at).start(Eigen::VectorXd(0)));
    if (!std::isfinite(there.score)) continue;
    if (genome == &start) {
      found->gain = (fits.known(best.fit.u, best.fit.z).score - there.score) /
                    static_cast<double>(observed_.size());
    }
    // What the simulation makes of the kinematics' values is nearly what they make of them.
    const Eigen::VectorXd z = whitened(baseline_) + there.z - whitened(kinematic_ends_);
    const infer::PairedGain kept = infer::paired_gain(by_parts(fits.scores(z)), theirs);
    if (kept.sum - kept.se <= most) continue;
    most = kept.sum - kept.se;
    found->kinematic = true;
    found->genome = *genome;
  }
  if (found->kinematic) found->gain = 0;
  return {};
}

void SimulationFit::take_spread(const Climb& climb, double widest, SimulatedStart* found) const {
  const auto n = static_cast<Eigen::Index>(problem_.genes.size());
  Eigen::MatrixXd precision = Eigen::MatrixXd::Identity(n, n) / (widest * widest);
  const Eigen::MatrixXd known = fitter(climb.space).normal(climb.fit).matrix;
  const std::vector<std::size_t>& genes =
      climb.space.coordinates() == fitted_.size() ? fitted_ : kinematic_;
  const double unit = kUnit * kFoundSpread;
  for (std::size_t j = 0; j < genes.size(); ++j) {
    for (std::size_t k = 0; k < genes.size(); ++k) {
      precision(genes[j], genes[k]) += known(j, k) / (unit * unit);
    }
  }
  for (const std::size_t g : fitted_) {
    const bool held = found->kinematic || !contains(genes, g);
    if (held) precision(g, g) += 1 / (kHeldSpread * kHeldSpread);
  }
  const Eigen::MatrixXd spread = inverse_of_symmetric(precision);
  found->spread.assign(spread.data(), spread.data() + spread.size());
}

Result<SimulatedStart> SimulationFit::run(double widest) {
  ASSIGN_OR_RETURN(const auto kinematics, fit_kinematics(problem_));
  observe(kinematics);
  const ParameterValues values = kinematic_start(problem_, kinematics);
  const ParameterValues grip = without_slip(problem_, values);
  const auto genome_of = [&](const ParameterValues& of) {
    Overrides at;
    for (const Gene& gene : problem_.genes) at[gene.row] = of[gene.row];
    return genome_at(at);
  };
  const Genome start = genome_of(values), firm = genome_of(grip);
  SimulatedStart found;
  found.genome = start;
  if (fitted_.empty()) return found;
  ASSIGN_OR_RETURN(auto all, climbs(start, firm));
  found.simulations = simulations_;
  if (all.empty()) return found;
  found.starts = all.size();
  Climb grips = std::move(all.back());
  all.pop_back();
  keep_best(1 + std::max<std::size_t>(dynamic_.size() / 2, 1), 1, &all);
  for (Climb& climb : all) RETURN_IF_ERROR(follow(&climb, kRaceSteps));
  keep_best(kBestClimbs, 0, &all);
  all.push_back(std::move(grips));
  std::optional<Climb> best;
  double most = -INFINITY;
  for (Climb& climb : all) {
    RETURN_IF_ERROR(follow(&climb, kClimbSteps));
    if (climb.fit.slopes.size() == 0) continue;
    const double nats = hold_best(&climb);
    if (!(nats > most)) continue;
    most = nats;
    best = climb;
  }
  if (!best) return found;
  RETURN_IF_ERROR(follow(&*best, kClimbSteps));
  RETURN_IF_ERROR(judge(*best, start, firm, &found));
  found.simulations = simulations_;
  take_spread(*best, widest, &found);
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
