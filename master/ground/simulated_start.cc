#include "master/ground/simulated_start.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "common/score/algebra.h"
#include "common/score/kinematic_start.h"
#include "master/ground/window_prior.h"

namespace gapfarm {
namespace {

constexpr double kGeneStep = 0.01;  // to find slopes; contacts are noisy below
constexpr int kMostRounds = 24;
constexpr double kEnoughNats = 0.1;
constexpr double kLeastScale = 1e-5;
constexpr std::array<double, 4> kDampings = {0, 0.1, 1, 10};
constexpr double kParts[] = {2, 1};   // dimensions of position and heading
constexpr double kStrayShare = 0.25;  // of what windows of the commonest length cover
constexpr double kFreelyMoves = 0.3;  // of a gene's range, where the windows do not tell

using Ends = std::vector<Eigen::Vector3d>;  // residuals, m, m, rad

// Everything at one genome.
struct At {
  Genome genome;
  Ends residuals;
  double nats = 0;  // a window of each length, and what was moved
};

class SimulationFit {
 public:
  SimulationFit(Farm& farm, const Problem& problem) : farm_(farm), problem_(problem) {
    hash_ = farm.add_problem(to_proto(problem));
    std::vector<double> durations_s;
    for (const Trial& trial : problem.log.trials) durations_s.push_back(*trial.duration_s);
    length_ = window_lengths(durations_s);
    for (const std::size_t length : length_) {
      if (length >= count_.size()) count_.resize(length + 1, 0);
      count_[length] += 1;
    }
    for (std::size_t g = 0; g < problem.genes.size(); ++g) {
      const Parameter& row = problem.table()[problem.genes[g].row];
      const bool noise = row.key.find("_noise_") != std::string::npos;
      if (!noise && row.kind == ParameterKind::kReal) told_.push_back(g);
    }
  }

  Result<SimulatedStart> run(double widest);

 private:
  Result<std::vector<std::optional<At>>> look_at(const std::vector<Genome>& genomes);
  void take_scales(const Ends& residuals);
  void weigh(At* at) const;
  // Equations of one step: H and the gradient, over the genes that are told.
  Result<bool> slopes(const At& at, Eigen::MatrixXd* H, Eigen::VectorXd* g);
  Result<bool> step(At* at);
  double use(std::size_t window) const { return 1 / count_[length_[window]]; }
  double sum_of_uses() const { return static_cast<double>(count_.size()); }

  Farm& farm_;
  const Problem& problem_;
  std::string hash_;
  std::vector<std::size_t> length_;  // of each window: which
  std::vector<double> count_;        // of windows of each length
  // Of each length, m and rad: those of the kinematics' own residuals, so that no length and
  // neither position nor heading is given up for another.
  std::vector<std::array<double, 2>> scales_;
  std::vector<std::size_t> told_;  // genes that move ends
  Genome start_;
  Eigen::MatrixXd information_;  // at the last step
  std::size_t simulations_ = 0;
};

// Of a residual's part: position or heading.
double size_of(const Eigen::Vector3d& r, int part) {
  return part == 0 ? r.head<2>().norm() : std::abs(r[2]);
}

// Student's density in one or two dimensions: weight in least squares, and nats.
double weight_of(double size, double s, int part) {
  const double z = size / s;
  return (kWindowTail + kParts[part]) / (kWindowTail + z * z) / (s * s);
}
double nats_of(double size, double s, int part) {
  const double z = size / s;
  return -kParts[part] * std::log(s) -
         (kWindowTail + kParts[part]) / 2 * std::log1p(z * z / kWindowTail);
}

// Scales of the density of some residuals, by its iteration.
void SimulationFit::take_scales(const Ends& residuals) {
  scales_.assign(count_.size(), {1, 1});
  for (std::size_t length = 0; length < count_.size(); ++length) {
    for (int part = 0; part < 2; ++part) {
      std::vector<double> sizes;
      for (std::size_t i = 0; i < length_.size(); ++i) {
        if (length_[i] == length) sizes.push_back(size_of(residuals[i], part));
      }
      const auto middle = sizes.begin() + static_cast<long>(sizes.size() / 2);
      std::nth_element(sizes.begin(), middle, sizes.end());
      double s = std::max(1.3 * *middle / std::sqrt(kParts[part]), kLeastScale);
      for (int round = 0; round < 20; ++round) {
        double sum = 0;
        for (const double size : sizes) sum += weight_of(size, s, part) * s * s * size * size;
        s = std::max(std::sqrt(sum / count_[length] / kParts[part]), kLeastScale);
      }
      scales_[length][part] = s;
    }
  }
}

void SimulationFit::weigh(At* at) const {
  at->nats = 0;
  for (std::size_t i = 0; i < length_.size(); ++i) {
    for (int part = 0; part < 2; ++part) {
      const double s = scales_[length_[i]][part];
      at->nats += use(i) * nats_of(size_of(at->residuals[i], part), s, part);
    }
  }
  const double windows = static_cast<double>(length_.size());
  for (const std::size_t g : told_) {
    const double moved = (at->genome[g] - start_[g]) / kFreelyMoves;
    at->nats -= moved * moved / 2 / windows;
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
    At at{genomes[k], {}, 0};
    int next = 0;
    for (const Trial& trial : problem_.log.trials) {
      const Pose end = from_proto(result.predict().predictions(next++).end());
      at.residuals.push_back(local_difference(end, trial.X_WE));
    }
    weigh(&at);
    all.back() = std::move(at);
  }
  return all;
}

Result<bool> SimulationFit::slopes(const At& at, Eigen::MatrixXd* H, Eigen::VectorXd* g) {
  std::vector<Genome> genomes;
  for (const std::size_t gene : told_) {
    genomes.push_back(at.genome);
    double& moved = genomes.back()[gene];
    moved += moved + kGeneStep > 1 ? -kGeneStep : kGeneStep;
  }
  const auto beside = look_at(genomes);
  if (!beside) return beside.error();
  const auto n = static_cast<Eigen::Index>(told_.size());
  *H = Eigen::MatrixXd::Zero(n, n);
  *g = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd J(3, n);
  const double windows = static_cast<double>(length_.size());
  for (std::size_t i = 0; i < length_.size(); ++i) {
    for (Eigen::Index k = 0; k < n; ++k) {
      const auto& there = (*beside)[static_cast<std::size_t>(k)];
      if (!there) return false;
      const std::size_t gene = told_[static_cast<std::size_t>(k)];
      J.col(k) = (there->residuals[i] - at.residuals[i]) / (there->genome[gene] - at.genome[gene]);
    }
    for (Eigen::Index c = 0; c < 3; ++c) {
      const double r = at.residuals[i][c];
      const int part = c < 2 ? 0 : 1;
      const double size = size_of(at.residuals[i], part);
      const double w = windows * use(i) * weight_of(size, scales_[length_[i]][part], part);
      *H += w * J.row(c).transpose() * J.row(c);
      *g += w * r * J.row(c).transpose();
    }
  }
  for (Eigen::Index k = 0; k < n; ++k) {
    const std::size_t gene = told_[static_cast<std::size_t>(k)];
    (*H)(k, k) += 1 / (kFreelyMoves * kFreelyMoves);
    (*g)[k] += (at.genome[gene] - start_[gene]) / (kFreelyMoves * kFreelyMoves);
  }
  return true;
}

// Whether that was worth another one.
Result<bool> SimulationFit::step(At* at) {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  const auto known = slopes(*at, &H, &g);
  if (!known) return known.error();
  if (!*known) return false;
  information_ = H / sum_of_uses();
  std::vector<Genome> genomes;
  for (const double damping : kDampings) {
    Eigen::MatrixXd damped = H;
    damped.diagonal() *= 1 + damping;
    const Eigen::VectorXd move = solve_symmetric(damped, g);
    genomes.push_back(at->genome);
    for (std::size_t k = 0; k < told_.size(); ++k) {
      double& value = genomes.back()[told_[k]];
      value = std::clamp(value - move[static_cast<Eigen::Index>(k)], 0.0, 1.0);
    }
  }
  auto tried = look_at(genomes);
  if (!tried) return tried.error();
  const double before = at->nats;
  for (std::optional<At>& there : *tried) {
    if (there && there->nats > at->nats) *at = std::move(*there);
  }
  return (at->nats - before) * static_cast<double>(length_.size()) / sum_of_uses() > kEnoughNats;
}

Result<SimulatedStart> SimulationFit::run(double widest) {
  const auto kinematics = fit_kinematics(problem_);
  if (!kinematics) return kinematics.error();
  Ends residuals;
  const std::vector<Pose> ends = kinematic_ends(problem_, *kinematics);
  for (std::size_t i = 0; i < ends.size(); ++i) {
    residuals.push_back(local_difference(ends[i], problem_.log.trials[i].X_WE));
  }
  take_scales(residuals);
  const ParameterValues values = kinematic_start(problem_, *kinematics);
  for (const Gene& gene : problem_.genes) {
    start_.push_back(encode_gene(problem_.table(), gene, values[gene.row]));
  }
  const auto first = look_at({start_});
  if (!first) return first.error();
  SimulatedStart found{start_, {}, simulations_, 0};
  if (!first->front() || told_.empty()) return found;
  At at = *first->front();
  for (int k = 0; k < kMostRounds; ++k) {
    const auto more = step(&at);
    if (!more) return more.error();
    if (!*more) break;
  }
  found.genome = at.genome;
  found.simulations = simulations_;
  found.gain = (at.nats - first->front()->nats) / sum_of_uses();
  if (information_.size() == 0) return found;
  const auto n = static_cast<Eigen::Index>(start_.size());
  Eigen::MatrixXd precision = Eigen::MatrixXd::Identity(n, n) / (widest * widest);
  for (std::size_t j = 0; j < told_.size(); ++j) {
    for (std::size_t k = 0; k < told_.size(); ++k) {
      precision(static_cast<Eigen::Index>(told_[j]), static_cast<Eigen::Index>(told_[k])) +=
          information_(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(k));
    }
  }
  const Eigen::MatrixXd spread = inverse_of_symmetric(precision);
  found.spread.assign(spread.data(), spread.data() + spread.size());
  return found;
}

}  // namespace

std::vector<std::size_t> window_lengths(std::span<const double> durations_s) {
  const auto octave = [](double s) { return std::lround(std::log2(std::max(s, 1e-3))); };
  std::map<long, double> covered_s;
  for (const double s : durations_s) covered_s[octave(s)] += s;
  double most_s = 0;
  for (const auto& [key, s] : covered_s) most_s = std::max(most_s, s);
  std::map<long, std::size_t> kept;
  for (const auto& [key, s] : covered_s) {
    if (s >= kStrayShare * most_s) kept.try_emplace(key, kept.size());
  }
  std::vector<std::size_t> lengths;
  for (const double s : durations_s) {
    const long own = octave(s);
    const auto nearest =
        std::min_element(kept.begin(), kept.end(), [own](const auto& a, const auto& b) {
          return std::abs(a.first - own) < std::abs(b.first - own);
        });
    lengths.push_back(nearest->second);
  }
  return lengths;
}

Result<SimulatedStart> fit_by_simulation(Farm& farm, const Problem& problem, double widest) {
  return SimulationFit(farm, problem).run(widest);
}

}  // namespace gapfarm
