#include "master/determine/determine.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "common/random/stream.h"

namespace gapfarm {
namespace {

constexpr double kLeastLevels = 10;
constexpr double kCorrelated = 0.9;
constexpr double kNormal_95 = 1.96;
constexpr double kAtBound_share = 0.01;
// A direction along which the whole range changes the log likelihood by less than this is flat: its
// s.d. would be far beyond the range anyway.
constexpr double kFlat_nats = 0.02;

struct Design {
  std::vector<std::size_t> moving;  // genes
  std::vector<Genome> points;
  Eigen::MatrixXd offsets;  // one row a point, shares of the range, from the centre
  Eigen::VectorXd centre;   // of the moving genes
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

// A box about the point, moved inward where the range ends.
Design draw_design(const Problem& problem, const Genome& point, const DetermineSettings& settings) {
  Design design;
  for (std::size_t i = 0; i < problem.genes.size(); ++i) {
    if (takes_part(problem.table(), problem.genes[i])) design.moving.push_back(i);
  }
  const auto n = static_cast<Eigen::Index>(design.moving.size());
  design.centre.resize(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    design.centre[k] = std::clamp(point[design.moving[static_cast<std::size_t>(k)]],
                                  settings.half_width, 1 - settings.half_width);
  }
  const auto count = static_cast<Eigen::Index>(
      std::ceil(settings.points_a_term * static_cast<double>(terms(design.moving.size()))));
  design.offsets.resize(count, n);
  Stream stream({.run_seed = settings.seed, .purpose = Purpose::kStatistics});
  for (Eigen::Index i = 0; i < count; ++i) {
    Genome genome = point;
    for (Eigen::Index k = 0; k < n; ++k) {
      design.offsets(i, k) = stream.uniform(-settings.half_width, settings.half_width);
      genome[design.moving[static_cast<std::size_t>(k)]] = design.centre[k] + design.offsets(i, k);
    }
    design.points.push_back(std::move(genome));
  }
  return design;
}

// 1, x_i, x_i x_j (i <= j).
Eigen::RowVectorXd features(const Eigen::VectorXd& x) {
  Eigen::RowVectorXd row(static_cast<Eigen::Index>(terms(static_cast<std::size_t>(x.size()))));
  Eigen::Index at = 0;
  row[at++] = 1;
  for (Eigen::Index i = 0; i < x.size(); ++i) row[at++] = x[i];
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    for (Eigen::Index j = i; j < x.size(); ++j) row[at++] = x[i] * x[j];
  }
  return row;
}

struct Quadratic {
  Eigen::VectorXd gradient;
  Eigen::MatrixXd hessian;  // of the function itself
  double roughness = 0;
};

Quadratic fit(const Eigen::MatrixXd& offsets, const Eigen::VectorXd& values, double half_width) {
  const Eigen::Index n = offsets.cols();
  Eigen::MatrixXd design(offsets.rows(),
                         static_cast<Eigen::Index>(terms(static_cast<std::size_t>(n))));
  for (Eigen::Index i = 0; i < offsets.rows(); ++i) {
    design.row(i) = features(offsets.row(i).transpose() / half_width);
  }
  const Eigen::VectorXd b = design.colPivHouseholderQr().solve(values);
  Quadratic q;
  q.gradient = b.segment(1, n) / half_width;
  q.hessian.resize(n, n);
  Eigen::Index at = 1 + n;
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = i; j < n; ++j) {
      const double second = b[at++] / (half_width * half_width);
      q.hessian(i, j) = q.hessian(j, i) = i == j ? 2 * second : second;
    }
  }
  const auto freedom = std::max<Eigen::Index>(1, offsets.rows() - design.cols());
  q.roughness = std::sqrt((values - design * b).squaredNorm() / static_cast<double>(freedom));
  return q;
}

void add_genes(const Problem& problem, const Genome& point, const Design& design,
               const Eigen::MatrixXd& covariance, const DetermineSettings& settings,
               DetermineReport& report) {
  for (std::size_t k = 0; k < design.moving.size(); ++k) {
    const Gene& gene = problem.genes[design.moving[k]];
    const double g = point[design.moving[k]];
    GeneDetermined of;
    of.gene = gene;
    of.value = decode_gene(problem.table(), gene, g);
    const auto i = static_cast<Eigen::Index>(k);
    of.deviation = std::sqrt(covariance(i, i));
    const double low = std::clamp(g - kNormal_95 * of.deviation, 0.0, 1.0);
    const double high = std::clamp(g + kNormal_95 * of.deviation, 0.0, 1.0);
    of.interval_95 = {decode_gene(problem.table(), gene, low),
                      decode_gene(problem.table(), gene, high)};
    of.determined = 2 * kNormal_95 * of.deviation < settings.share;
    of.at_bound = g < kAtBound_share || g > 1 - kAtBound_share;
    report.genes.push_back(of);
  }
}

}  // namespace

Result<DetermineReport> determine(const Problem& problem, const Genome& point,
                                  const LikelihoodOf& likelihood,
                                  const DetermineSettings& settings) {
  const Design design = draw_design(problem, point, settings);
  if (design.moving.empty()) {
    return Error{"none of the genes is a number with room to move; there is nothing to determine"};
  }
  const auto scores = likelihood(design.points);
  if (!scores) return scores.error();
  const double trials = static_cast<double>(problem.log.trials.size());
  std::vector<Eigen::Index> usable;
  for (std::size_t i = 0; i < scores->size(); ++i) {
    if (std::isfinite((*scores)[i])) usable.push_back(static_cast<Eigen::Index>(i));
  }
  DetermineReport report;
  report.evaluations = scores->size();
  report.failures = scores->size() - usable.size();
  if (usable.size() < terms(design.moving.size())) {
    return Error{"only " + std::to_string(usable.size()) + " of " + std::to_string(scores->size()) +
                 " points about the model end well; the quadratic "
                 "needs " +
                 std::to_string(terms(design.moving.size()))};
  }
  Eigen::MatrixXd offsets(static_cast<Eigen::Index>(usable.size()), design.offsets.cols());
  Eigen::VectorXd values(offsets.rows());
  for (Eigen::Index i = 0; i < offsets.rows(); ++i) {
    const Eigen::Index from = usable[static_cast<std::size_t>(i)];
    offsets.row(i) = design.offsets.row(from);
    values[i] = trials * (*scores)[static_cast<std::size_t>(from)];
  }
  const Quadratic quadratic = fit(offsets, values, settings.half_width);
  report.roughness = quadratic.roughness;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(-quadratic.hessian);
  report.curvatures = axes.eigenvalues();
  report.directions = axes.eigenvectors();
  const Eigen::VectorXd stiff = report.curvatures.cwiseMax(kFlat_nats);
  const Eigen::MatrixXd covariance =
      axes.eigenvectors() * stiff.cwiseInverse().asDiagonal() * axes.eigenvectors().transpose();
  // Where the quadratic has its top, seen from the centre.
  const Eigen::VectorXd top = covariance * quadratic.gradient;
  report.outside =
      (top.array().abs() > 3 * covariance.diagonal().array().sqrt() + settings.half_width).any();
  add_genes(problem, point, design, covariance, settings, report);
  for (Eigen::Index a = 0; a < covariance.rows(); ++a) {
    for (Eigen::Index b = a + 1; b < covariance.rows(); ++b) {
      const double r = covariance(a, b) / std::sqrt(covariance(a, a) * covariance(b, b));
      if (std::abs(r) < kCorrelated) continue;
      report.compensations.push_back({static_cast<std::size_t>(a), static_cast<std::size_t>(b), r});
    }
  }
  std::sort(report.compensations.begin(), report.compensations.end(),
            [](const Compensation& x, const Compensation& y) {
              return std::abs(x.correlation) > std::abs(y.correlation);
            });
  return report;
}

std::string determine_text(const DetermineReport& report, const ParameterTable& table) {
  std::string text = fmt::format("{:<26} {:>14}  {:<30}  {:>10}\n", "parameter", "value",
                                 "95 % interval", "of range");
  for (const GeneDetermined& g : report.genes) {
    text += fmt::format("{:<26} {:>14}  {:<30}  {:>9.0f}%  {}{}\n", table[g.gene.row].key,
                        fmt::format("{:.4g}", g.value),
                        fmt::format("{:.4g} to {:.4g}", g.interval_95.lower, g.interval_95.upper),
                        100 * std::min(1.0, 2 * kNormal_95 * g.deviation),
                        g.determined ? "determined" : "NOT DETERMINED",
                        g.at_bound ? ", at the end of its range" : "");
  }
  for (const Compensation& c : report.compensations) {
    text += fmt::format("{} and {} make up for one another (correlation {:.2f})\n",
                        table[report.genes[c.a].gene.row].key,
                        table[report.genes[c.b].gene.row].key, c.correlation);
  }
  if (report.outside) {
    text +=
        "the likelihood rises beyond the box: the model is not at its maximum, evolve further\n";
  }
  text += fmt::format(
      "{} evaluations, {} failed; the simulation scatters by {:.2g} nats about the "
      "quadratic\n",
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
