// How a table's columns of two sides are to be read, by the motions beside them: to first order a
// motion is linear in what the wheels turned by, wherever the tracked point is.
#include <Eigen/Dense>
#include <array>
#include <cmath>

#include "common/base/text.h"
#include "common/pose/pose.h"
#include "master/io/logs/column_map.h"

namespace gapfarm {
namespace {

constexpr std::size_t kFewestMotions = 20;
constexpr int kRounds = 10;            // of least absolute deviations
constexpr double kExplainsMore = 0.5;  // of what another reading leaves
constexpr double kExplained = 0.6;     // of the motions
constexpr double kBetter = 0.95;       // of the best reading so far

// In SI, or nothing.
std::vector<double> si_column(const LogTable& table, const TableMap& map, const char* role,
                              bool poses) {
  const MappedColumn* c = map.find(role);
  const auto at = c == nullptr || c->wraps > 0 ? std::nullopt : table.find(c->column);
  if (!at) return {};
  const auto line = si_line(table, map, *c, poses);
  std::vector<double> values;
  for (std::size_t r = 0; line && r < table.rows(); ++r) {
    values.push_back(line->slope * table.at(r, *at) + line->offset);
  }
  return values;
}

// Sum of what is left of `moved` by its best shares of `turned`, least absolute deviations.
double left_of(const Eigen::MatrixX2d& turned, const Eigen::VectorXd& moved) {
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(moved.size()), rest = moved;
  const double least = 1e-6 * moved.cwiseAbs().mean() + 1e-12;
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::Matrix<double, 2, Eigen::Dynamic> W = turned.transpose() * weights.asDiagonal();
    const Eigen::Vector2d shares = (W * turned).completeOrthogonalDecomposition().solve(W * moved);
    rest = moved - turned * shares;
    weights = rest.cwiseAbs().cwiseMax(least).cwiseInverse();
  }
  return rest.cwiseAbs().sum();
}

// Share of the motions that wheels leave, of places and of headings; NaN: it cannot be said.
double left_by_wheels(const LogTable& table, const TableMap& poses, const TableMap& wheels,
                      const WheelReading& as) {
  std::array<std::vector<double>, 6> all;
  const char* const roles[] = {"t", "x", "y", "theta", "left", "right"};
  for (std::size_t k = 0; k < all.size(); ++k) {
    all[k] = si_column(table, k < 4 ? poses : wheels, roles[k], k < 4);
    if (all[k].empty()) return NAN;
  }
  const auto& [t, x, y, theta, left, right] = all;
  std::vector<Eigen::Matrix<double, 5, 1>> rows;  // turned, moved
  for (std::size_t r = 1; r < table.rows(); ++r) {
    const double dt = poses.intervals ? t[r] : t[r] - t[r - 1];
    const Pose X{x[r], y[r], theta[r]};
    const Pose step = as.increments ? X : between({x[r - 1], y[r - 1], theta[r - 1]}, X);
    const double times = as.rate || as.increment ? 1 : dt;
    Eigen::Matrix<double, 5, 1> row;
    row << times * (left[r] - (as.rate ? left[r - 1] : 0)),
        times * (right[r] - (as.rate ? right[r - 1] : 0)), step.x, step.y, step.theta;
    if (dt > 0 && row.allFinite()) rows.push_back(row);
  }
  if (rows.size() < kFewestMotions) return NAN;
  Eigen::MatrixXd M(rows.size(), 5);
  for (std::size_t r = 0; r < rows.size(); ++r) M.row(r) = rows[r].transpose();
  const auto share = [&](std::initializer_list<int> components) {
    double left_over = 0, moved = 1e-12;
    for (const int c : components) {
      left_over += left_of(M.leftCols<2>(), M.col(c));
      moved += M.col(c).cwiseAbs().sum();
    }
    return left_over / moved;
  };
  return (share({2, 3}) + share({4})) / 2;
}

std::string text_of(const WheelReading& as, bool with_poses) {
  return std::string(as.rate        ? "rate = true (they count)"
                     : as.increment ? "increment = true (what each turned by since the row before)"
                                    : "neither rate nor increment (they are speeds)") +
         (!with_poses     ? ""
          : as.increments ? " and increments = true of [poses]"
                          : " and poses in the world");
}

}  // namespace

WheelReading best_reading(const LogTable& table, const TableMap& poses, const TableMap& wheels) {
  const MappedColumn* left = wheels.find("left");
  WheelReading mapped{poses.increments};
  if (left == nullptr || wheels.find("right") == nullptr) return mapped;
  mapped.rate = left->rate;
  mapped.increment = left->increment;
  mapped.left = left_by_wheels(table, poses, wheels, mapped);
  WheelReading best = mapped;
  for (const bool increments : {true, false}) {
    for (const auto& [rate, increment] : {std::pair{false, true}, {false, false}, {true, false}}) {
      WheelReading other{increments, rate, increment};
      other.left = left_by_wheels(table, poses, wheels, other);
      // Of rows that last equally long speeds and changes are one.
      if (other.left < kBetter * best.left) best = other;
    }
  }
  return best.left < kExplained && best.left < kExplainsMore * mapped.left ? best : mapped;
}

Status check_reading(const LogTable& table, const LogMap& map) {
  const MappedColumn *left = map.commands.find("left"), *right = map.commands.find("right");
  if (left == nullptr || right == nullptr) return {};
  const WheelReading mapped{map.poses.increments, left->rate, left->increment};
  const WheelReading best = best_reading(table, map.poses, map.commands);
  const bool others = best.increments != mapped.increments;
  if (!others && best.rate == mapped.rate && best.increment == mapped.increment) return {};
  return Error{table.source + ":1: found columns " + quoted_word(left->column) + " and " +
               quoted_word(right->column) + " mapped with " + text_of(mapped, others) +
               ", by which they do not explain how the robot moved, expected " +
               text_of(best, others) + ", by which they do; write that into the map (--map)"};
}

}  // namespace gapfarm
