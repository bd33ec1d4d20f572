#include "master/ground/fit/scans.h"

#include <cmath>

#include "common/base/ranges.h"

namespace gapfarm {
namespace {

// Where to begin with another floor: changes of a grip's logarithm, and logarithms of its shape.
constexpr double kGripChanges[] = {0, -0.3, -0.7, -1.1, -1.6, -2.2, 0.5};
constexpr double kGripShapes[] = {0.7, 1.8};
constexpr double kNear_s = 1, kMiddle_s = 3, kFar_s = 10;  // either way of the file's delay

}  // namespace

Eigen::VectorXd best_held(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                          const Eigen::VectorXd& values, const std::vector<Eigen::VectorXd>& others,
                          std::optional<double> most) {
  Eigen::VectorXd best = values;
  if (!most) most = fitter.hold(rows, values).objective;
  for (const Eigen::VectorXd& other : others) {
    const double objective = fitter.hold(rows, other).objective;
    if (objective <= *most) continue;
    most = objective;
    best = other;
  }
  return best;
}

Eigen::VectorXd scan_delay(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                           const Eigen::VectorXd& values) {
  std::vector<Eigen::VectorXd> others;
  for (double size = 0.1; size <= kFar_s; size += size < kNear_s     ? 0.1
                                                  : size < kMiddle_s ? 0.25
                                                                     : 0.5) {
    for (const double shift : {size, -size}) {
      others.emplace_back(values)[row_index(rows, "delay")] += shift;
    }
  }
  return best_held(fitter, rows, values, others);
}

Eigen::VectorXd scan_grip(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                          const Eigen::VectorXd& values) {
  const Eigen::Index grip = row_index(rows, "grip"), shape = row_index(rows, "grip_shape");
  std::vector<Eigen::VectorXd> others;
  for (const double change : kGripChanges) {
    for (const double sharp : kGripShapes) {
      Eigen::VectorXd& moved = others.emplace_back(values);
      moved[grip] += change;
      moved[shape] = sharp;
    }
  }
  return best_held(fitter, rows, values, others);
}

Eigen::VectorXd scan_size(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                          const Eigen::VectorXd& values) {
  const KinematicRow& of = rows.back().row;
  std::vector<Eigen::VectorXd> others;
  for (double size = plausible_error(of); size > of.tolerance; size /= 2) {
    others.emplace_back(values)[values.size() - 1] = of.nominal + size;
  }
  return best_held(fitter, rows, values, others);
}

std::vector<Eigen::Vector2d> wheel_places(const WindowFitter& fitter, const WindowFit* far_from) {
  const Pose X_MR = inverse(fitter.robot().X_RM);
  const WindowSet& windows = fitter.windows();
  const auto misses = [&](std::size_t i) {
    const Eigen::Vector3d& scales = far_from->scales[static_cast<std::size_t>(windows.horizon[i])];
    return far_from->residuals[i].cwiseQuotient(scales).norm();
  };
  std::vector<Eigen::Vector2d> places;
  for (std::size_t i = 0; i < windows.trials.size(); ++i) {
    if (far_from != nullptr && misses(i) < kOutlierDeviations) continue;
    for (const RobotWheel& wheel : fitter.robot().wheels) {
      if (!wheel.driven) continue;
      const Pose at =
          windows.trials[i].X_WS * X_MR * Pose{wheel.x_m.value_or(0), wheel.y_m.value_or(0), 0};
      places.emplace_back(Eigen::Vector2d(at.x, at.y) - fitter.origin_m());
    }
  }
  return places;
}

double scatter_of(const std::vector<Eigen::Vector2d>& places) {
  const auto n = static_cast<double>(places.size());
  Eigen::Vector2d sum(0, 0);
  for (const Eigen::Vector2d& place : places) sum += place;
  const double squares =
      sum_of(places, [](const Eigen::Vector2d& place) { return place.squaredNorm(); });
  return std::sqrt(squares / n - (sum / n).squaredNorm());
}

}  // namespace gapfarm
