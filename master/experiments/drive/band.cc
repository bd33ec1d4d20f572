#include "master/experiments/drive/band.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/math/statistics.h"

namespace gapfarm {
namespace {

// A band is never thinner: m and rad.
constexpr double kThinnest = 1e-6;

Pose pose_at(const std::vector<PathSample>& path, double t_s) {
  const auto after = std::lower_bound(path.begin(), path.end(), t_s,
                                      [](const PathSample& s, double t) { return s.t_s < t; });
  if (after == path.begin()) return path.front().pose;
  if (after == path.end()) return path.back().pose;
  const PathSample& a = *std::prev(after);
  const double share = (t_s - a.t_s) / (after->t_s - a.t_s);
  const auto mix = [&](double from, double to) { return from + share * (to - from); };
  return {mix(a.pose.x, after->pose.x), mix(a.pose.y, after->pose.y),
          wrap_angle(a.pose.theta + share * wrap_angle(after->pose.theta - a.pose.theta))};
}

Eigen::Vector3d off(const Pose& middle, const Pose& pose) {
  return {pose.x - middle.x, pose.y - middle.y, wrap_angle(pose.theta - middle.theta)};
}

// Greatest share of the band's half-widths that any point of the path is off the middle.
double excursion_of(const std::vector<BandPoint>& band, const std::vector<GridPoint>& path) {
  assert(band.size() == path.size());
  double greatest = 0;
  for (std::size_t i = 0; i < band.size(); ++i) {
    const Eigen::Vector3d d = off(band[i].middle, path[i].pose);
    for (int k = 0; k < 3; ++k) {
      greatest = std::max(greatest, d[k] < 0 ? -d[k] / band[i].below[k] : d[k] / band[i].above[k]);
    }
  }
  return greatest;
}

BandPoint shape_at(const std::vector<std::vector<GridPoint>>& paths, std::size_t i) {
  std::vector<double> x, y, heading;
  for (const auto& path : paths) {
    x.push_back(path[i].pose.x);
    y.push_back(path[i].pose.y);
    heading.push_back(path[i].pose.theta);
  }
  BandPoint point{
      paths[0][i].leg, paths[0][i].share, {median(x), median(y), circular_centre(heading)}, {}, {}};
  for (int k = 0; k < 3; ++k) {
    std::vector<double> deviations;
    for (const auto& path : paths) deviations.push_back(off(point.middle, path[i].pose)[k]);
    point.below[k] = std::max(kThinnest, -quantile(deviations, 0.05));
    point.above[k] = std::max(kThinnest, quantile(deviations, 0.95));
  }
  return point;
}

}  // namespace

std::vector<GridPoint> on_grid(const DrivenRun& run, unsigned points_a_leg) {
  std::vector<GridPoint> grid;
  for (std::size_t leg = 0; leg < run.size(); ++leg) {
    const std::vector<PathSample>& path = run[leg].path;
    assert(!path.empty());
    for (unsigned i = 0; i <= points_a_leg; ++i) {
      const double share = static_cast<double>(i) / points_a_leg;
      grid.push_back({leg, share, pose_at(path, share * path.back().t_s)});
    }
  }
  return grid;
}

PathBand PathBand::fit(std::span<const DrivenRun> runs, double coverage, unsigned points_a_leg) {
  assert(runs.size() >= 4);
  std::vector<std::vector<GridPoint>> shaping, judging;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    (r % 2 == 0 ? shaping : judging).push_back(on_grid(runs[r], points_a_leg));
  }
  PathBand band;
  band.points_a_leg_ = points_a_leg;
  for (std::size_t i = 0; i < shaping.front().size(); ++i) {
    band.points_.push_back(shape_at(shaping, i));
  }
  std::vector<double> excursions;
  for (const auto& path : judging) excursions.push_back(excursion_of(band.points_, path));
  std::sort(excursions.begin(), excursions.end());
  const auto n = static_cast<double>(excursions.size());
  const double rank = std::clamp(std::ceil((n + 1) * coverage), 1.0, n);
  const double factor = excursions[static_cast<std::size_t>(rank) - 1];
  for (BandPoint& point : band.points_) {
    point.below *= factor;
    point.above *= factor;
  }
  return band;
}

double PathBand::excursion(const DrivenRun& run) const {
  return excursion_of(points_, on_grid(run, points_a_leg_));
}

EndEllipse end_ellipse(std::span<const DrivenRun> runs, double coverage) {
  assert(runs.size() >= 2);
  std::vector<double> headings;
  Eigen::MatrixXd ends(2, static_cast<Eigen::Index>(runs.size()));
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const Pose& end = runs[r].back().path.back().pose;
    headings.push_back(end.theta);
    ends.col(static_cast<Eigen::Index>(r)) << end.x, end.y;
  }
  const MeanCovariance moments =
      weighted_mean_covariance(ends, std::vector<double>(runs.size(), 1.0));
  EndEllipse ellipse;
  ellipse.mean = {moments.mean[0], moments.mean[1], circular_mean(headings)};
  ellipse.covariance = moments.covariance;
  for (const double heading : headings) {
    const double d = wrap_angle(heading - ellipse.mean.theta);
    ellipse.heading_deviation_rad += d * d / static_cast<double>(runs.size() - 1);
  }
  ellipse.heading_deviation_rad = std::sqrt(ellipse.heading_deviation_rad);
  // Chi-square of two degrees of freedom: P(r^2 <= q) = 1 - exp(-q / 2).
  const double q = -2 * std::log(1 - coverage);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(ellipse.covariance);
  ellipse.minor_m = std::sqrt(q * std::max(0.0, axes.eigenvalues()[0]));
  ellipse.major_m = std::sqrt(q * std::max(0.0, axes.eigenvalues()[1]));
  ellipse.direction_rad = std::atan2(axes.eigenvectors()(1, 1), axes.eigenvectors()(0, 1));
  return ellipse;
}

std::vector<PathPoint> floor_path(std::span<const PathSample> path, double spacing_m) {
  std::vector<PathPoint> points;
  for (const PathSample& sample : path) {
    const PathPoint point(sample.pose.x, sample.pose.y, 0);
    if (points.empty() || (point - points.back()).norm() >= spacing_m) points.push_back(point);
  }
  if (path.empty()) return points;
  const PathPoint end(path.back().pose.x, path.back().pose.y, 0);
  if (points.back() != end) points.push_back(end);
  return points;
}

std::vector<PathPoint> floor_path(const DrivenRun& run, double spacing_m) {
  std::vector<PathSample> whole;
  for (const Leg& leg : run) whole.insert(whole.end(), leg.path.begin(), leg.path.end());
  return floor_path(whole, spacing_m);
}

}  // namespace gapfarm
