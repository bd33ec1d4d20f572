#include "master/experiments/determine/determine.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/math/algebra.h"
#include "common/random/stream.h"

namespace gapfarm {
namespace {

constexpr double kLeastLevels = 10;
constexpr double kCorrelated = 0.9;
constexpr double kNormal_95 = 1.96;
constexpr double kAtBound_share = 0.01;

// Half widths that are tried, shares of the range.
constexpr double kProbes[] = {0.3, 0.1, 0.03, 0.01, 0.003, 0.001, 0.0003};
constexpr double kWanted_nats = 2;  // that a gene alone changes the likelihood by at its half width
constexpr double kExplained = 0.9;  // of the variance: the quadratic fits
constexpr double kCalm_nats = 0.5;  // or the scatter about it is as small as this
constexpr int kRounds = 5;
constexpr int kMoves = 8;            // of the box after the quadratic's top, at most
constexpr double kFarthestMove = 2;  // half widths, along an axis by one move

struct Design {
  std::vector<Genome> points;
  Eigen::MatrixXd offsets;  // one row a point, in half widths, from the centre
};

std::size_t terms(std::size_t n) { return (n + 1) * (n + 2) / 2; }

bool takes_part(const ParameterTable& table, const Gene& gene) {
  switch (table[gene.row].kind) {
    case ParameterKind::kReal:
      return true;
    case ParameterKind::kInteger:
      return gene.upper - gene.lower + 1 >= kLeastLevels;
    default:
      return false;
  }
}

// 1, x_i, x_i x_j (i <= j).
Eigen::RowVectorXd features(const Eigen::VectorXd& x) {
  Eigen::RowVectorXd row(static_cast<Eigen::Index>(terms(x.size())));
  Eigen::Index at = 0;
  row[at++] = 1;
  for (Eigen::Index i = 0; i < x.size(); ++i) row[at++] = x[i];
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    for (Eigen::Index j = i; j < x.size(); ++j) row[at++] = x[i] * x[j];
  }
  return row;
}

struct Quadratic {
  double value = 0;  // at the centre
  Eigen::VectorXd gradient;
  Eigen::MatrixXd hessian;  // of the function itself
  double roughness = 0;
  double explained = 0;
};

// `offsets` in half widths; the result in shares of the range.
Quadratic fit(const Eigen::MatrixXd& offsets, const Eigen::VectorXd& values,
              const Eigen::VectorXd& widths) {
  const Eigen::Index n = offsets.cols();
  Eigen::MatrixXd design(offsets.rows(), static_cast<Eigen::Index>(terms(n)));
  for (Eigen::Index i = 0; i < offsets.rows(); ++i) {
    design.row(i) = features(offsets.row(i).transpose());
  }
  const Eigen::VectorXd b = least_squares(design, values);
  Quadratic q;
  q.value = b[0];
  q.gradient = b.segment(1, n).cwiseQuotient(widths);
  q.hessian.resize(n, n);
  Eigen::Index at = 1 + n;
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = i; j < n; ++j) {
      const double second = b[at++] / (widths[i] * widths[j]);
      q.hessian(i, j) = q.hessian(j, i) = i == j ? 2 * second : second;
    }
  }
  const Eigen::VectorXd residuals = values - design * b;
  const auto freedom = std::max<Eigen::Index>(1, offsets.rows() - design.cols());
  q.roughness = std::sqrt(residuals.squaredNorm() / static_cast<double>(freedom));
  const Eigen::VectorXd centred = values.array() - values.mean();
  q.explained = centred.squaredNorm() > 0 ? 1 - residuals.squaredNorm() / centred.squaredNorm() : 1;
  return q;
}

void add_genes(const Problem& problem, const Genome& point, const std::vector<std::size_t>& moving,
               const Eigen::VectorXd& top, const Eigen::MatrixXd& covariance,
               const DetermineSettings& settings, DetermineReport& report) {
  for (std::size_t k = 0; k < moving.size(); ++k) {
    const Gene& gene = problem.genes[moving[k]];
    const double g = point[moving[k]];
    GeneDetermined of;
    of.gene = gene;
    of.value = decode_gene(problem.table(), gene, g);
    of.deviation = std::sqrt(covariance(k, k));
    const double low = top[k] - kNormal_95 * of.deviation;
    const double high = top[k] + kNormal_95 * of.deviation;
    of.interval_95 = {decode_gene(problem.table(), gene, std::clamp(low, 0.0, 1.0)),
                      decode_gene(problem.table(), gene, std::clamp(high, 0.0, 1.0))};
    of.determined = report.reliable && 2 * kNormal_95 * of.deviation < settings.share;
    const auto [least, most] = of.determined ? std::minmax({g, low, high}) : std::minmax({g, g});
    of.at_bound = least < kAtBound_share || most > 1 - kAtBound_share;
    report.genes.push_back(of);
  }
}

class Determination {
 public:
  Determination(const Problem& problem, const Genome& point, const LikelihoodOf& likelihood,
                const DetermineSettings& settings, const StageHooks& hooks)
      : problem_(problem),
        point_(point),
        likelihood_(likelihood),
        settings_(settings),
        hooks_(hooks) {
    for (std::size_t i = 0; i < problem.genes.size(); ++i) {
      if (takes_part(problem.table(), problem.genes[i])) moving_.push_back(i);
    }
    widths_ = Eigen::VectorXd::Constant(size(), settings.half_width);
  }

  Result<DetermineReport> run() {
    if (moving_.empty()) {
      return Error{
          "none of the genes is a number with room to move; there is nothing to determine"};
    }
    // Most often the first box will do.
    const std::uint64_t probes = 1 + 2 * std::size(kProbes) * moving_.size();
    const std::uint64_t points = points_of_a_box();
    hooks_.planned({{"find how far to look", double(probes), probes},
                    {"fit the likelihood", double(points), points}});
    hooks_.began(0);
    RETURN_IF_ERROR(find_widths());
    hooks_.began(1);
    centre_.resize(size());
    for (Eigen::Index k = 0; k < size(); ++k) centre_[k] = point_[gene(k)];
    double highest = -INFINITY;
    Eigen::VectorXd best = centre_, step = Eigen::VectorXd::Zero(size());
    int shrunk = 0;
    for (std::uint64_t round = 0; round < kRounds + kMoves && shrunk < kRounds; ++round) {
      if (round > 0) hooks_.began(1, points);
      centre_ = best + step;
      ASSIGN_OR_RETURN(const auto quadratic, fit_box(round));
      const bool fits = quadratic.explained > kExplained || quadratic.roughness < kCalm_nats;
      if (fits && quadratic.value >= highest) {
        report_.reliable = true;
        highest = quadratic.value;
        best = centre_;
        step = read_off(quadratic);
        if (!report_.outside) break;
        shrunk = 0;
      } else {  // too far for a quadratic
        if (!report_.reliable) read_off(quadratic);
        widths_ /= 2;
        step /= 2;
        ++shrunk;
      }
    }
    add_genes(problem_, point_, moving_, top_, covariance_, settings_, report_);
    if (report_.reliable) add_compensations();
    return report_;
  }

 private:
  Eigen::Index size() const { return static_cast<Eigen::Index>(moving_.size()); }
  std::size_t points_of_a_box() const {
    return static_cast<std::size_t>(
        std::ceil(settings_.points_a_term * static_cast<double>(terms(moving_.size()))));
  }
  std::size_t gene(Eigen::Index k) const { return moving_[k]; }

  Result<std::vector<double>> nats(const std::vector<Genome>& genomes) {
    auto scores = likelihood_(genomes);
    if (!scores) return scores;
    report_.evaluations += scores->size();
    for (double& score : *scores) {
      score *= static_cast<double>(problem_.log.trials.size());
      report_.failures += std::isfinite(score) ? 0 : 1;
    }
    return scores;
  }

  // As wide as changes the likelihood by kWanted_nats, each gene alone.
  Status find_widths() {
    std::vector<Genome> genomes = {point_};
    for (const std::size_t moving : moving_) {
      for (const double width : kProbes) {
        for (const double side : {-width, width}) {
          genomes.push_back(point_);
          genomes.back()[moving] = std::clamp(point_[moving] + side, 0.0, 1.0);
        }
      }
    }
    ASSIGN_OR_RETURN(const auto values, nats(genomes));
    if (!std::isfinite(values.front()))
      return Error{"the model itself does not end well on this log"};
    at_point_ = values.front();
    std::size_t at = 1;
    for (Eigen::Index k = 0; k < size(); ++k) {
      for (const double width : kProbes) {
        double change = 0;
        for (int side = 0; side < 2; ++side) {
          const double value = values[at++];
          // What does not end well is beyond any quadratic.
          change = std::max(change, std::isfinite(value) ? std::abs(value - values.front()) : 1e6);
        }
        // Narrower ones follow: the last that changes enough decides.
        if (change >= kWanted_nats / 2) {
          widths_[k] = std::min(settings_.half_width, width * std::sqrt(kWanted_nats / change));
        }
      }
    }
    return {};
  }

  // A box about the centre, which moves inward where the range ends.
  Design draw(std::uint64_t round) {
    centre_ = centre_.cwiseMax(widths_).cwiseMin(Eigen::VectorXd::Ones(size()) - widths_);
    Design design;
    design.offsets.resize(points_of_a_box(), size());
    Stream stream(
        {.run_seed = settings_.seed, .purpose = Purpose::kStatistics, .generation = round});
    for (Eigen::Index i = 0; i < design.offsets.rows(); ++i) {
      Genome genome = point_;
      for (Eigen::Index k = 0; k < size(); ++k) {
        design.offsets(i, k) = stream.uniform(-1, 1);
        genome[gene(k)] = std::clamp(centre_[k] + widths_[k] * design.offsets(i, k), 0.0, 1.0);
      }
      design.points.push_back(std::move(genome));
    }
    return design;
  }

  Result<Quadratic> fit_box(std::uint64_t round) {
    const Design design = draw(round);
    ASSIGN_OR_RETURN(const auto values, nats(design.points));
    std::vector<Eigen::Index> usable;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (std::isfinite(values[i])) usable.push_back(static_cast<Eigen::Index>(i));
    }
    if (usable.size() < terms(moving_.size())) {
      return Error{"only " + std::to_string(usable.size()) + " of " +
                   std::to_string(values.size()) +
                   " points about the model end well; the quadratic needs " +
                   std::to_string(terms(moving_.size()))};
    }
    const Eigen::Map<const Eigen::VectorXd> all(values.data(), design.offsets.rows());
    return fit(design.offsets(usable, Eigen::all), all(usable), widths_);
  }

  // In half widths every gene counts alike, so that where one hardly matters the axes of the others
  // stay their own.  Nothing is known less well along an axis than leads out of some gene's range.
  // Gives the step to the top, as far along each axis as the quadratic is trusted.
  Eigen::VectorXd read_off(const Quadratic& quadratic) {
    const SymmetricAxes axes =
        axes_of_symmetric(widths_.asDiagonal() * -quadratic.hessian * widths_.asDiagonal());
    const Eigen::MatrixXd directions = widths_.asDiagonal() * axes.vectors;
    const Eigen::VectorXd least =
        directions.cwiseAbs().colwise().maxCoeff().transpose().cwiseAbs2();
    const Eigen::VectorXd stiffness = axes.values.cwiseMax(least);
    covariance_ = directions * stiffness.cwiseInverse().asDiagonal() * directions.transpose();
    const Eigen::VectorXd up =
        (directions.transpose() * quadratic.gradient).cwiseQuotient(stiffness);
    top_ = (centre_ + directions * up).cwiseMax(0).cwiseMin(1);
    const Eigen::VectorXd reach = widths_ + covariance_.diagonal().cwiseSqrt();
    report_.outside = ((top_ - centre_).cwiseAbs().array() > reach.array()).any();
    if (report_.outside) top_ = centre_;
    const Eigen::VectorXd to = top_ - centre_;
    report_.rise =
        quadratic.value + to.dot(quadratic.gradient + 0.5 * quadratic.hessian * to) - at_point_;
    report_.roughness = quadratic.roughness;
    report_.explained = quadratic.explained;
    return directions * up.cwiseMin(kFarthestMove).cwiseMax(-kFarthestMove);
  }

  void add_compensations() {
    for (Eigen::Index a = 0; a < size(); ++a) {
      for (Eigen::Index b = a + 1; b < size(); ++b) {
        const double r = covariance_(a, b) / std::sqrt(covariance_(a, a) * covariance_(b, b));
        if (std::abs(r) < kCorrelated) continue;
        report_.compensations.push_back(
            {static_cast<std::size_t>(a), static_cast<std::size_t>(b), r});
      }
    }
    std::ranges::sort(report_.compensations, [](const Compensation& x, const Compensation& y) {
      return std::abs(x.correlation) > std::abs(y.correlation);
    });
  }

  const Problem& problem_;
  const Genome& point_;
  const LikelihoodOf& likelihood_;
  const DetermineSettings& settings_;
  const StageHooks& hooks_;
  std::vector<std::size_t> moving_;  // genes that take part
  Eigen::VectorXd widths_, centre_, top_;
  Eigen::MatrixXd covariance_;
  double at_point_ = 0;  // log likelihood, nats
  DetermineReport report_;
};

}  // namespace

Result<DetermineReport> determine(const Problem& problem, const Genome& point,
                                  const LikelihoodOf& likelihood, const DetermineSettings& settings,
                                  const StageHooks& hooks) {
  return Determination(problem, point, likelihood, settings, hooks).run();
}

std::string determine_text(const DetermineReport& report, const ParameterTable& table) {
  std::string text = fmt::format("{:<26} {:>14}  {:<30}  {:>10}\n", "parameter", "value",
                                 "95 % interval", "of range");
  for (const GeneDetermined& g : report.genes) {
    text += fmt::format("{:<26} {:>14}  {:<30}  {:>9.0f}%  {}{}\n", table[g.gene.row].key,
                        fmt::format("{:.4g}", g.value),
                        fmt::format("{:.4g} to {:.4g}", g.interval_95.lower, g.interval_95.upper),
                        100 * std::min(1.0, 2 * kNormal_95 * g.deviation),
                        !report.reliable ? "unclear"
                        : g.determined   ? "determined"
                                         : "NOT DETERMINED",
                        g.at_bound ? ", at the end of its range" : "");
  }
  for (const Compensation& c : report.compensations) {
    text += fmt::format("{} and {} make up for one another (correlation {:.2f})\n",
                        table[report.genes[c.a].gene.row].key,
                        table[report.genes[c.b].gene.row].key, c.correlation);
  }
  if (!report.reliable) {
    text +=
        "the likelihood about the model is too rough or too bent for any of this to be read off\n";
  }
  if (report.outside) {
    text +=
        "the likelihood rises beyond where was looked: the model is not at its maximum, evolve "
        "further\n";
  } else if (report.reliable && report.rise > kWanted_nats) {
    text += fmt::format(
        "the likelihood's maximum, about which the intervals are, is {:.1f} nats above the model: "
        "evolve further\n",
        report.rise);
  }
  text += fmt::format(
      "{} evaluations, {} failed; the simulation scatters by {:.2g} nats about the quadratic\n",
      report.evaluations, report.failures, report.roughness);
  return text;
}

std::string determine_csv(const DetermineReport& report, const ParameterTable& table) {
  std::string text = "parameter,value,low_95,high_95,deviation_share,determined,at_bound\n";
  for (const GeneDetermined& g : report.genes) {
    text +=
        fmt::format("{},{},{},{},{},{},{}\n", table[g.gene.row].key, g.value, g.interval_95.lower,
                    g.interval_95.upper, g.deviation, g.determined ? 1 : 0, g.at_bound ? 1 : 0);
  }
  return text;
}

}  // namespace gapfarm
