// Functions that searches are compared on: noiseless, shifted and rotated at random, as BBOB's
// (Hansen et al., INRIA RR-6829, 2009).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <span>

#include "common/math/algebra.h"
#include "common/random/stream.h"
#include "tests/unit/evolve/toy_problems.h"

namespace gapfarm {

struct SearchFunction {
  std::string name;
  std::size_t genes = 0;
  double lower = -5, upper = 5;  // of every gene
  double least = 0;
  std::function<double(const std::vector<double>&)> value = {};
};

struct SearchShape {
  const char* name;
  double (*value)(const Eigen::VectorXd& z);  // least, 0, at z = 0; z is about as long as x
};

// Where i lies among the coordinates, in [0, 1].
inline double share(Eigen::Index i, const Eigen::VectorXd& z) {
  return static_cast<double>(i) / static_cast<double>(z.size() - 1);
}

inline std::span<const SearchShape> search_shapes() {
  using V = Eigen::VectorXd;
  static constexpr double kTurn = 2 * std::numbers::pi;
  static const SearchShape shapes[] = {
      {"sphere", [](const V& z) { return z.squaredNorm(); }},
      {"ellipsoid",
       [](const V& z) {
         double sum = 0;
         for (Eigen::Index i = 0; i < z.size(); ++i)
           sum += std::pow(1e6, share(i, z)) * z[i] * z[i];
         return sum;
       }},
      {"bent cigar", [](const V& z) { return 1e6 * z.squaredNorm() + (1 - 1e6) * z[0] * z[0]; }},
      {"Schwefel 1.2",
       [](const V& z) {
         double sum = 0, partial = 0;
         for (const double step : z) {
           partial += step;
           sum += partial * partial;
         }
         return sum;
       }},
      {"different powers",
       [](const V& z) {
         double sum = 0;
         for (Eigen::Index i = 0; i < z.size(); ++i) {
           sum += std::pow(std::abs(z[i]), 2 + 4 * share(i, z));
         }
         return std::sqrt(sum);
       }},
      {"sharp ridge", [](const V& z) { return z[0] * z[0] + 100 * z.tail(z.size() - 1).norm(); }},
      {"Rosenbrock",
       [](const V& z) {
         const V y = (std::max(1.0, std::sqrt(static_cast<double>(z.size())) / 8) * z).array() + 1;
         double sum = 0;
         for (Eigen::Index i = 0; i + 1 < y.size(); ++i) {
           sum += 100 * std::pow(y[i + 1] - y[i] * y[i], 2) + std::pow(1 - y[i], 2);
         }
         return sum;
       }},
      {"Rastrigin",
       [](const V& z) { return z.squaredNorm() + 10 * (1 - (kTurn * z.array()).cos()).sum(); }},
      {"Ackley",
       [](const V& z) {
         const V y = 6.4 * z;
         return 20 + std::numbers::e -
                20 * std::exp(-0.2 * std::sqrt(y.squaredNorm() / static_cast<double>(y.size()))) -
                std::exp((kTurn * y.array()).cos().mean());
       }},
      {"Griewank",
       [](const V& z) {
         const V y = 120 * z;
         double product = 1;
         for (Eigen::Index i = 0; i < y.size(); ++i) {
           product *= std::cos(y[i] / std::sqrt(static_cast<double>(i + 1)));
         }
         return 1 + y.squaredNorm() / 4000 - product;
       }},
  };
  return shapes;
}

// Instance `seed` of a shape: its least is anywhere in [-4, 4], its axes are any or the genes.
inline SearchFunction instance(const SearchShape& shape, std::size_t genes, std::uint64_t seed,
                               bool rotated = true) {
  Stream stream({.run_seed = seed, .generation = genes});
  const auto n = static_cast<Eigen::Index>(genes);
  Eigen::MatrixXd normals(n, n);
  for (double& number : normals.reshaped()) number = stream.normal();
  Eigen::VectorXd at(n);
  for (double& number : at) number = stream.uniform(-4, 4);
  SearchFunction made{shape.name, genes};
  if (!rotated) normals.setIdentity();
  made.value = [rotation = orthonormal(normals), at,
                of = shape.value](const std::vector<double>& x) {
    const Eigen::Map<const Eigen::VectorXd> point(x.data(), static_cast<Eigen::Index>(x.size()));
    return of(rotation * (point - at));
  };
  return made;
}

// The median over 101 random points, less the least.
inline double initial_gap(const SearchFunction& function, std::uint64_t seed) {
  Stream stream({.run_seed = seed, .generation = 2});
  std::vector<double> values(101);
  for (double& value : values) {
    std::vector<double> x(function.genes);
    for (double& number : x) number = stream.uniform(function.lower, function.upper);
    value = function.value(x);
  }
  std::nth_element(values.begin(), values.begin() + 50, values.end());
  return values[50] - function.least;
}

inline Toy toy_of(const SearchFunction& function) {
  return {std::vector<Parameter>(function.genes,
                                 toy_row(ParameterKind::kReal, function.lower, function.upper)),
          function.value};
}

}  // namespace gapfarm
