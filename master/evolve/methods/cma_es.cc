#include "master/evolve/methods/cma_es.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/base/ranges.h"
#include "common/math/algebra.h"

namespace gapfarm {
namespace {

// Less decides nothing in a simulation, and a restart may.
constexpr double kLeastStep_share = 1e-7;
constexpr double kFlatCost = 1e-12;
// Above this doubling stops: a generation would outlast most runs.
constexpr std::size_t kLargestPopulation = 1024;
constexpr double kLevelDeviation = 0.2;
// A narrower gene is not mirrored before it is learned from.
constexpr double kNarrow_share = 0.05;

struct Axes {
  Eigen::MatrixXd directions;
  Eigen::VectorXd deviations;
};

Axes axes_of(const Eigen::MatrixXd& covariance) {
  const SymmetricAxes axes = axes_of_symmetric(covariance);
  return {axes.vectors, axes.values.cwiseMax(1e-300).cwiseSqrt()};
}

Eigen::VectorXd to_vector(const Genome& genome) {
  return Eigen::Map<const Eigen::VectorXd>(genome.data(), static_cast<Eigen::Index>(genome.size()));
}

Genome to_genome(const Eigen::VectorXd& vector) { return {vector.begin(), vector.end()}; }

}  // namespace

CmaEs::CmaEs(const MethodSetup& setup) : setup_(setup) {
  const auto n = static_cast<Eigen::Index>(setup.space.size());
  begin(setup.start.empty() ? Eigen::VectorXd::Constant(n, 0.5) : to_vector(setup.start));
  if (setup.start.empty() || setup.spread.empty()) return;
  covariance_ = Eigen::Map<const Eigen::MatrixXd>(setup.spread.data(), n, n) / (sigma_ * sigma_);
}

void CmaEs::begin(Eigen::VectorXd mean) {
  const Eigen::Index n = mean.size();
  generation_ = 0;
  sigma_ = first_sigma_ > 0 ? first_sigma_ : setup_.settings.sigma;
  evaluations_ = 0;
  mean_ = std::move(mean);
  path_sigma_ = Eigen::VectorXd::Zero(n);
  path_c_ = Eigen::VectorXd::Zero(n);
  covariance_ = Eigen::MatrixXd::Identity(n, n);
  bests_.clear();
  anywhere_ = false;
}

// Somewhere else, after convergence.
void CmaEs::begin_again() {
  const bool first = restarts_ == 0;
  if (!first) (small_population_ > 0 ? small_evaluations_ : large_evaluations_) += evaluations_;
  small_population_ = 0;
  first_sigma_ = 0;
  const bool by_turns = setup_.settings.restarts == RestartKind::kBipop;
  if (by_turns && !first && small_evaluations_ < large_evaluations_) {
    const double large = static_cast<double>(population());
    const double base = static_cast<double>(
        setup_.settings.population.value_or(default_population(setup_.space.size())));
    const double u = std::fmod(static_cast<double>(++small_starts_) * std::numbers::phi, 1);
    const double small = base * std::pow(std::max(1.0, large / base / 2), u * u);
    small_population_ = std::max<std::size_t>(4, static_cast<std::size_t>(small));
    first_sigma_ = setup_.settings.sigma * std::pow(10, -2 * u);
  } else {
    ++restarts_;
  }
  begin(mean_);
  anywhere_ = true;
}

unsigned CmaEs::default_population(std::size_t genes) {
  return static_cast<unsigned>(4 + std::floor(3 * std::log(static_cast<double>(genes))));
}

std::size_t CmaEs::population() const {
  if (small_population_ > 0) return small_population_;
  const std::size_t base =
      setup_.settings.population.value_or(default_population(setup_.space.size()));
  return std::max(base,
                  std::min(base << std::min<std::uint64_t>(restarts_, 20), kLargestPopulation));
}

CmaEs::Weights CmaEs::weights(Eigen::Index points) const {
  const double n = static_cast<double>(setup_.space.size());
  const auto lambda = static_cast<double>(points);
  Weights w;
  w.of_rank.resize(points);
  for (Eigen::Index i = 0; i < w.of_rank.size(); ++i) {
    w.of_rank[i] = std::log((lambda + 1) / 2) - std::log(static_cast<double>(i + 1));
  }
  const Eigen::Index parents = points / 2;
  auto best = w.of_rank.head(parents);
  auto worst = w.of_rank.tail(w.of_rank.size() - parents);
  best /= best.sum();
  w.mu_eff = 1 / best.squaredNorm();
  w.c_sigma = (w.mu_eff + 2) / (n + w.mu_eff + 5);
  w.d_sigma = 1 + 2 * std::max(0.0, std::sqrt((w.mu_eff - 1) / (n + 1)) - 1) + w.c_sigma;
  w.c_c = (4 + w.mu_eff / n) / (n + 4 + 2 * w.mu_eff / n);
  w.c_1 = 2 / ((n + 1.3) * (n + 1.3) + w.mu_eff);
  w.c_mu = std::min(1 - w.c_1,
                    2 * (0.25 + w.mu_eff + 1 / w.mu_eff - 2) / ((n + 2) * (n + 2) + w.mu_eff));
  worst /= -worst.sum();
  const double repelled = 1 / worst.squaredNorm();
  worst *= std::min(
      {1 + w.c_1 / w.c_mu, 1 + 2 * repelled / (repelled + 2), (1 - w.c_1 - w.c_mu) / (n * w.c_mu)});
  w.chi_n = std::sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n * n));
  return w;
}

std::vector<Genome> CmaEs::propose(const StreamOf& stream_of) const {
  Eigen::VectorXd mean = mean_;
  if (anywhere_) {
    Stream stream = stream_of(population());
    mean = to_vector(setup_.space.random(stream));
  }
  const Axes axes = axes_of(covariance_);
  const bool with_mean = generation_ == 0 && (anywhere_ || !setup_.start.empty());
  std::vector<Genome> proposed;
  std::vector<Eigen::VectorXd> directions;  // of the draws, orthogonal to one another
  while (proposed.size() < population()) {
    if (with_mean && proposed.empty()) {
      proposed.push_back(to_genome(mean));
      continue;
    }
    Stream stream = stream_of(proposed.size());
    Eigen::VectorXd draw(mean.size());
    for (double& number : draw) number = stream.normal();
    const double length = draw.norm();
    if (std::ssize(directions) == mean.size()) directions.clear();
    for (const Eigen::VectorXd& direction : directions) draw -= draw.dot(direction) * direction;
    directions.push_back(draw.normalized());
    const Eigen::VectorXd step = axes.directions * axes.deviations.cwiseProduct(directions.back());
    proposed.push_back(to_genome(mean + sigma_ * length * step));
    for (std::size_t gene = 0; gene < setup_.space.size(); ++gene) {
      const auto i = static_cast<Eigen::Index>(gene);
      if (sigma_ * std::sqrt(covariance_(i, i)) < kNarrow_share) continue;
      proposed.back()[gene] = mirrored(proposed.back()[gene]);
    }
  }
  return proposed;
}

// No further from the mean than draws are (Hansen, INRIA RR-7748, 2011).
Genome CmaEs::taken(const Genome& migrant) const {
  if (anywhere_) return migrant;
  const Axes axes = axes_of(covariance_);
  const Eigen::VectorXd step = (to_vector(migrant) - mean_) / sigma_;
  const double n = static_cast<double>(step.size());
  const double length = (axes.directions.transpose() * step).cwiseQuotient(axes.deviations).norm();
  const double most = std::sqrt(n) + 2 * n / (n + 2);
  return to_genome(mean_ + sigma_ * std::min(1.0, most / length) * step);
}

void CmaEs::learn(std::span<const Genome> proposed, std::span<const Standing> standings) {
  assert(proposed.size() == population() && standings.size() == proposed.size());
  if (anywhere_) begin(to_vector(proposed.front()));  // the first proposal was the mean itself
  evaluations_ += proposed.size();
  const std::vector<std::size_t> order = order_of(standings, better);
  Eigen::MatrixXd steps(mean_.size(), static_cast<Eigen::Index>(population()));
  for (Eigen::Index i = 0; i < steps.cols(); ++i) {
    steps.col(i) = (to_vector(proposed[order[static_cast<std::size_t>(i)]]) - mean_) / sigma_;
  }
  // After a restart each searches elsewhere.
  if (restarts_ > 0) others_.clear();
  adapt(steps, with_others(steps));
  others_.clear();
  keep_levels_alive();
  ++generation_;
  const Standing& best = standings[order.front()];
  const bool ranked = best.outcome == v1::OK || best.outcome == v1::INFEASIBLE;
  bests_.push_back(ranked ? best.cost : std::numeric_limits<double>::infinity());
  const auto n = static_cast<double>(mean_.size());
  const auto span =
      static_cast<std::size_t>(10 + std::ceil(30 * n / static_cast<double>(population())));
  if (bests_.size() > span) bests_.erase(bests_.begin());
  const auto [least, most] = std::ranges::minmax(bests_);
  const bool flat = bests_.size() == span && most <= least + kFlatCost;
  if (flat || converged()) begin_again();
}

// By their rank in their own generation.
Eigen::MatrixXd CmaEs::with_others(const Eigen::MatrixXd& steps) const {
  if (others_.empty()) return steps;
  const Axes axes = axes_of(covariance_);
  std::vector<std::pair<double, Eigen::VectorXd>> ranked;
  const auto add = [&](const Eigen::MatrixXd& its) {
    for (Eigen::Index i = 0; i < its.cols(); ++i) {
      ranked.emplace_back(static_cast<double>(i) / static_cast<double>(its.cols()), its.col(i));
    }
  };
  add(steps);
  for (const std::vector<Individual>& individuals : others_) {
    Eigen::MatrixXd its(steps.rows(), static_cast<Eigen::Index>(individuals.size()));
    for (Eigen::Index i = 0; i < its.cols(); ++i) {
      its.col(i) = to_vector(individuals[static_cast<std::size_t>(i)].genome);
    }
    its.colwise() -= its.rowwise().mean().eval();
    const Eigen::MatrixXd whitened =
        axes.deviations.cwiseInverse().asDiagonal() * (axes.directions.transpose() * its);
    const double unit = whitened.norm() / std::sqrt(static_cast<double>(its.size()));
    if (unit > 0) add(its / unit);
  }
  std::ranges::stable_sort(ranked, [](const auto& a, const auto& b) { return a.first < b.first; });
  Eigen::MatrixXd all(steps.rows(), std::ssize(ranked));
  for (Eigen::Index i = 0; i < all.cols(); ++i) {
    all.col(i) = ranked[static_cast<std::size_t>(i)].second;
  }
  return all;
}

// The mean and its paths by `steps`, the covariance by `all`.
void CmaEs::adapt(const Eigen::MatrixXd& steps, const Eigen::MatrixXd& all) {
  const Weights w = weights(steps.cols()), shared = weights(all.cols());
  const double n = static_cast<double>(mean_.size());
  const Axes axes = axes_of(covariance_);
  const Eigen::Index parents = steps.cols() / 2;
  const Eigen::VectorXd step = steps.leftCols(parents) * w.of_rank.head(parents);
  mean_ += sigma_ * step;
  const Eigen::VectorXd whitened =
      axes.directions * (axes.directions.transpose() * step).cwiseQuotient(axes.deviations);
  path_sigma_ =
      (1 - w.c_sigma) * path_sigma_ + std::sqrt(w.c_sigma * (2 - w.c_sigma) * w.mu_eff) * whitened;
  const double age = static_cast<double>(generation_ + 1);
  const double unbiased = std::sqrt(1 - std::pow(1 - w.c_sigma, 2 * age));
  const bool calm = path_sigma_.norm() / unbiased < (1.4 + 2 / (n + 1)) * w.chi_n;
  path_c_ *= 1 - w.c_c;
  if (calm) path_c_ += std::sqrt(w.c_c * (2 - w.c_c) * w.mu_eff) * step;
  const double lost = calm ? 0 : w.c_c * (2 - w.c_c);
  Eigen::VectorXd weights = shared.of_rank;
  for (Eigen::Index i = all.cols() / 2; i < weights.size(); ++i) {
    const double length =
        (axes.directions.transpose() * all.col(i)).cwiseQuotient(axes.deviations).squaredNorm();
    weights[i] *= n / std::max(length, 1e-30);
  }
  const double kept = 1 - shared.c_1 - shared.c_mu * shared.of_rank.sum() + shared.c_1 * lost;
  covariance_ = kept * covariance_ + shared.c_1 * path_c_ * path_c_.transpose() +
                shared.c_mu * all * weights.asDiagonal() * all.transpose();
  covariance_ = (covariance_ + covariance_.transpose().eval()) / 2;
  sigma_ *= std::exp(std::min(1.0, w.c_sigma / w.d_sigma * (path_sigma_.norm() / w.chi_n - 1)));
}

void CmaEs::keep_levels_alive() {
  for (std::size_t gene = 0; gene < setup_.space.size(); ++gene) {
    const GeneKind& kind = setup_.space[gene];
    if (kind.shape == GeneShape::kReal || kind.levels < 2) continue;
    const auto i = static_cast<Eigen::Index>(gene);
    const double least = kLevelDeviation / static_cast<double>(kind.levels) / sigma_;
    covariance_(i, i) = std::max(covariance_(i, i), least * least);
  }
}

bool CmaEs::converged() const {
  if (!std::isfinite(sigma_) || !covariance_.allFinite()) return true;
  double widest = 0;
  bool reals = false;
  for (std::size_t gene = 0; gene < setup_.space.size(); ++gene) {
    if (setup_.space[gene].shape != GeneShape::kReal) continue;
    reals = true;
    const auto i = static_cast<Eigen::Index>(gene);
    widest = std::max(widest, std::sqrt(covariance_(i, i)));
  }
  return reals && sigma_ * widest < kLeastStep_share;
}

std::vector<NamedNumber> CmaEs::figures() const {
  return {{"step_size", sigma_}, {"restarts", static_cast<double>(restarts_ + small_starts_)}};
}

void CmaEs::save(v1::MethodState& message) const {
  v1::CmaEsState& state = *message.mutable_cma_es();
  SAVE_STATE(generation, restarts, anywhere, sigma, small_population, evaluations,
             large_evaluations, small_evaluations, first_sigma, small_starts)
  state.mutable_mean()->Add(mean_.begin(), mean_.end());
  state.mutable_path_sigma()->Add(path_sigma_.begin(), path_sigma_.end());
  state.mutable_path_c()->Add(path_c_.begin(), path_c_.end());
  state.mutable_covariance()->Add(covariance_.data(), covariance_.data() + covariance_.size());
  state.mutable_bests()->Add(bests_.begin(), bests_.end());
}

Status CmaEs::restore(const v1::MethodState& message) {
  const v1::CmaEsState& state = message.cma_es();
  const auto n = mean_.size();
  if (state.mean_size() != n || state.path_sigma_size() != n || state.path_c_size() != n ||
      state.covariance_size() != n * n) {
    return damaged_method_state("CMA-ES");
  }
  LOAD_STATE(generation, restarts, anywhere, sigma, small_population, evaluations,
             large_evaluations, small_evaluations, first_sigma, small_starts)
  std::copy(state.mean().begin(), state.mean().end(), mean_.begin());
  std::copy(state.path_sigma().begin(), state.path_sigma().end(), path_sigma_.begin());
  std::copy(state.path_c().begin(), state.path_c().end(), path_c_.begin());
  std::copy(state.covariance().begin(), state.covariance().end(), covariance_.data());
  bests_.assign(state.bests().begin(), state.bests().end());
  return {};
}

GAPFARM_METHOD(CmaEs)

}  // namespace gapfarm
