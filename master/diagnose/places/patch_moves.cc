#include "master/diagnose/places/patch_moves.h"

#include <algorithm>
#include <cmath>

#include "common/math/algebra.h"

namespace gapfarm {
namespace {

constexpr double kNear = 2;        // steps over which a mark counts as linear
constexpr double kFewestNear = 6;  // for four slopes
constexpr double kRidge = 0.1;     // of what the discs' places have in squares
constexpr double kFarthest = 2;    // steps, of each of the four

Eigen::Vector4d in_steps(const Patch& to, const Patch& from, const PatchStep& step) {
  return {(to[0] - from[0]) / step.length_m, (to[1] - from[1]) / step.length_m,
          (to[2] - from[2]) / step.length_m, std::log(to[3] / from[3]) / step.log_ratio};
}

}  // namespace

std::optional<Patch> linear_best(const MarkedDisc& from, const std::vector<MarkedDisc>& near,
                                 const Eigen::VectorXd& left, const PatchStep& step) {
  double count = 0;
  Eigen::Matrix4d places = Eigen::Matrix4d::Zero();
  Eigen::MatrixXd marks = Eigen::MatrixXd::Zero(left.size(), 4);
  for (const MarkedDisc& disc : near) {
    const Eigen::Vector4d u = in_steps(disc.patch, from.patch, step);
    const double weight = std::exp(-u.squaredNorm() / (2 * kNear * kNear));
    count += weight;
    places += weight * u * u.transpose();
    marks += weight * (disc.mark - from.mark) * u.transpose();
  }
  if (count < kFewestNear) return std::nullopt;
  places.diagonal().array() += kRidge * places.trace() / 4;
  const Eigen::MatrixXd slopes = marks * inverse_of_symmetric(places);
  Eigen::MatrixXd normal = slopes.transpose() * slopes;
  normal.diagonal().array() += 1 / (kFarthest * kFarthest);  // the noise's unit is 1
  const Eigen::VectorXd move = solve_symmetric(normal, slopes.transpose() * (left - from.mark));
  Eigen::Vector4d bounded;
  for (Eigen::Index k = 0; k < 4; ++k) bounded[k] = std::clamp(move[k], -kFarthest, kFarthest);
  return Patch{from.patch[0] + bounded[0] * step.length_m,
               from.patch[1] + bounded[1] * step.length_m,
               from.patch[2] + bounded[2] * step.length_m,
               from.patch[3] * std::exp(bounded[3] * step.log_ratio)};
}

}  // namespace gapfarm
