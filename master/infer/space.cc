#include "master/infer/space.h"

#include <algorithm>
#include <cmath>

#include "master/infer/settings.h"

namespace gapfarm::infer {
namespace {

using Kind = Coordinate::Kind;

// Of a value that is searched as it is, or as its logarithm.
double scaled(const Coordinate& c, const Parameter& row, double value) {
  const bool log = c.kind == Kind::kLogarithm;
  return (log ? std::log(positive(row, value)) : value) / c.size;
}

}  // namespace

double positive(const Parameter& row, double value) {
  return std::max(value, row.lower > 0 ? row.lower : kLeastShareOfRange * row.upper);
}

std::vector<Coordinate> columns(Eigen::Index count) {
  std::vector<Coordinate> all(static_cast<std::size_t>(count));
  for (std::size_t k = 0; k < all.size(); ++k) {
    all[k].kind = Kind::kColumn;
    all[k].row = k;
    all[k].prior_sd = 1;
  }
  return all;
}

Space::Space(const ParameterTable& table, std::vector<Coordinate> coordinates, Overrides constants)
    : table_(&table), coordinates_(std::move(coordinates)), constants_(std::move(constants)) {
  for (const Coordinate& c : coordinates_) dimensions_ += c.dimensions();
  lower_ = Eigen::VectorXd::Constant(dimensions_, -INFINITY);
  upper_ = -lower_;
  prior_ = centre_ = Eigen::VectorXd::Zero(dimensions_);
  Eigen::Index k = 0;
  for (const Coordinate& c : coordinates_) {
    prior_.segment(k, c.dimensions()).setConstant(1 / std::pow(c.prior_sd, 2));
    centre_.segment(k, c.dimensions()).setConstant(c.centre);
    if (c.kind == Kind::kAngle || c.kind == Kind::kColumn) {
      k += c.dimensions();  // no bounds
      continue;
    }
    const Parameter& row = table[c.row];
    const Interval within = c.within.value_or(Interval{row.lower, row.upper});
    if (c.kind == Kind::kPolar) {
      const double most = c.of_ratio ? std::log(row.upper) : row.upper;
      lower_.segment<2>(k).setConstant(-most / c.size);
      upper_.segment<2>(k).setConstant(most / c.size);
    } else {
      lower_[k] = scaled(c, row, within.lower);
      upper_[k] = scaled(c, row, within.upper);
    }
    k += c.dimensions();
  }
}

Eigen::VectorXd Space::from(const Overrides& values) const {
  const auto value = [&](std::size_t row) {
    const auto at = values.find(row);
    return at == values.end() ? (*table_)[row].nominal : at->second;
  };
  Eigen::VectorXd u(dimensions_);
  Eigen::Index k = 0;
  for (const Coordinate& c : coordinates_) {
    if (c.kind == Kind::kColumn) {
      u[k] = 0;
    } else if (c.kind == Kind::kPolar) {
      const double strength = c.of_ratio ? std::log(value(c.row)) : value(c.row);
      const double angle = c.symmetry * value(c.direction_row);
      u[k] = strength * std::cos(angle) / c.size;
      u[k + 1] = strength * std::sin(angle) / c.size;
    } else {
      u[k] = scaled(c, (*table_)[c.row], value(c.row));
    }
    k += c.dimensions();
  }
  return u.cwiseMax(lower_).cwiseMin(upper_);
}

Overrides Space::values(const Eigen::VectorXd& u) const {
  Overrides values = constants_;
  const auto put = [&](std::size_t row, double value) {
    values[row] = std::clamp(value, (*table_)[row].lower, (*table_)[row].upper);
  };
  Eigen::Index k = 0;
  for (const Coordinate& c : coordinates_) {
    const bool polar = c.kind == Kind::kPolar;
    const double at = c.size * (polar ? std::hypot(u[k], u[k + 1]) : u[k]);
    const bool log = c.kind == Kind::kLogarithm || (polar && c.of_ratio);
    if (c.kind != Kind::kColumn) {
      put(c.row, log ? std::exp(at) : c.kind == Kind::kAngle ? wrap_angle(at) : at);
    }
    if (polar) put(c.direction_row, std::atan2(u[k + 1], u[k]) / c.symmetry);
    k += c.dimensions();
  }
  return values;
}

Space Space::holding(const Overrides& constants) const {
  Overrides all = constants;
  all.insert(constants_.begin(), constants_.end());
  for (const Coordinate& c : coordinates_) {
    if (c.kind == Kind::kColumn) continue;
    all.erase(c.row);
    if (c.kind == Kind::kPolar) all.erase(c.direction_row);
  }
  return Space(*table_, coordinates_, std::move(all));
}

Space Space::with(const std::vector<Coordinate>& more) const {
  std::vector<Coordinate> all = coordinates_;
  all.insert(all.end(), more.begin(), more.end());
  return Space(*table_, std::move(all), constants_);
}

Space Space::without(std::size_t first, std::size_t count, Eigen::VectorXd* u) const {
  std::vector<Coordinate> rest;
  Eigen::VectorXd kept(u->size());
  Eigen::Index from = 0, to = 0;
  for (std::size_t k = 0; k < coordinates_.size(); ++k) {
    const Eigen::Index dimensions = coordinates_[k].dimensions();
    if (k < first || k >= first + count) {
      rest.push_back(coordinates_[k]);
      kept.segment(to, dimensions) = u->segment(from, dimensions);
      to += dimensions;
    }
    from += dimensions;
  }
  *u = kept.head(to);
  return Space(*table_, std::move(rest), constants_);
}

}  // namespace gapfarm::infer
