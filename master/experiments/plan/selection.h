// Which of many experiments to make, so that unknowns can be distinguished from noise and from each
// other.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace gapfarm::plan {

// One experiment: whitened rows by unknowns, each unknown in units of its prior standard deviation.
using Rows = Eigen::MatrixXd;

// Indices of `wanted` of the candidates (all when there are fewer), best first: the greedy choice
// for Ds-optimality (Atkinson, Donev and Tobias 2007, section 10.3).  Each next one adds most to
//
//   log det(I + X'X) - log det(I + Z'Z)
//
// X: the chosen rows, Z: their last `nuisances` columns, which only have to be allowed for.  Of
// equals the first counts.  REQUIRES: all of one width of at least `nuisances`.
std::vector<std::size_t> select(const std::vector<Rows>& candidates, Eigen::Index nuisances,
                                std::size_t wanted);

// Squared length of the whitened `shift` beyond what unit-normal nuisances explain, the
// noncentrality of the likelihood ratio's chi-squared: s' (I + Z Z')^-1 s.
// REQUIRES: as many rows.
double information(const Eigen::VectorXd& shift, const Eigen::MatrixXd& nuisances);

// Cosine of two shifts in that metric, [-1, 1]; 0 when one is nothing.
double likeness(const Eigen::VectorXd& a, const Eigen::VectorXd& b,
                const Eigen::MatrixXd& nuisances);

}  // namespace gapfarm::plan
