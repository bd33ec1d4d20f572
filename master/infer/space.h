// The coordinates in which a hypothesis is searched: smooth, scaled and without a seam.
//
// A strength with a direction is searched as its cosine and sine, what must be positive as its
// logarithm, and one unit of every coordinate is a size that a careless laboratory has.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "common/base/ranges.h"
#include "common/parameters/table.h"
#include "master/infer/predictor.h"

namespace gapfarm::infer {

struct Coordinate {
  // kAngle: goes round.  kColumn: no parameter, but a change of the predictions that is known to
  // first order (Observations::columns), with a prior of standard deviation 1.
  enum class Kind { kLinear, kAngle, kLogarithm, kPolar, kColumn };
  Kind kind = Kind::kLinear;
  std::size_t row = 0;            // of the parameter table; kPolar: of the strength; kColumn: which
  std::size_t direction_row = 0;  // kPolar
  double symmetry = 1;            // kPolar: how often the effect looks the same in a full turn
  bool of_ratio = false;          // kPolar: the strength is the logarithm of a ratio
  double size = 1;                // of the value, or of its logarithm
  std::optional<Interval> within = {};  // of the value; none: the row's bounds
  double prior_sd = INFINITY;           // in sizes, of a prior about `centre`
  double centre = 0;                    // in sizes

  Eigen::Index dimensions() const { return kind == Kind::kPolar ? 2 : 1; }
};

// No less than the least that has a logarithm.
double positive(const Parameter& row, double value);

// That many columns, from the first on.
std::vector<Coordinate> columns(Eigen::Index count);

class Space {
 public:
  // REQUIRES: the table outlives it.
  // `constants`: rows that differ from their nominal value and are not searched.
  Space(const ParameterTable& table, std::vector<Coordinate> coordinates, Overrides constants = {});

  Eigen::Index dimensions() const { return dimensions_; }
  // Rows that `values` lacks are at their nominal value.
  Eigen::VectorXd from(const Overrides& values) const;
  // Clamped to the table's bounds.
  Overrides values(const Eigen::VectorXd& u) const;
  const Eigen::VectorXd& lower() const { return lower_; }
  const Eigen::VectorXd& upper() const { return upper_; }
  // Precision of the prior about its centre, a dimension.
  const Eigen::VectorXd& prior() const { return prior_; }
  // What the prior of the first `count` dimensions costs there, nats.
  double price(const Eigen::VectorXd& u, Eigen::Index count) const {
    return 0.5 * prior_.head(count).dot((u - centre_).head(count).cwiseAbs2());
  }
  // Slope of that price, downhill.
  Eigen::VectorXd pull(const Eigen::VectorXd& u) const { return prior_.cwiseProduct(centre_ - u); }
  // The same with more coordinates behind.
  Space with(const std::vector<Coordinate>& more) const;
  // The same without these of its coordinates; `u` loses their dimensions.
  Space without(std::size_t first, std::size_t count, Eigen::VectorXd* u) const;
  std::size_t coordinates() const { return coordinates_.size(); }
  // These alone, of the same table.
  Space only(std::vector<Coordinate> coordinates) const {
    return Space(*table_, std::move(coordinates), constants_);
  }
  // The same with these rows held there.
  Space holding(const Overrides& constants) const;
  const std::vector<Coordinate>& all() const { return coordinates_; }

 private:
  const ParameterTable* table_;
  std::vector<Coordinate> coordinates_;
  Overrides constants_;
  Eigen::Index dimensions_ = 0;
  Eigen::VectorXd lower_, upper_, prior_, centre_;
};

}  // namespace gapfarm::infer
