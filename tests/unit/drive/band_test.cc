#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "common/random/stream.h"
#include "master/experiments/drive/drive.h"

namespace gapfarm::band_test {

// A wavy line whose amplitude, drift and heading are drawn.
DrivenRun drawn_run(std::uint64_t seed, double heading = 0) {
  Stream stream({.run_seed = seed});
  const double a = 0.1 * stream.normal(), b = 0.05 * stream.normal(), c = 0.2 * stream.normal();
  DrivenRun run(2);
  for (int leg = 0; leg < 2; ++leg) {
    for (int i = 0; i <= 10; ++i) {
      const double t = 0.1 * i + leg;
      run[static_cast<std::size_t>(leg)].path.push_back(
          {0.1 * i, {t + a * t, b * std::sin(3 * t) + c * t * t, wrap_angle(heading + c * t)}});
    }
  }
  return run;
}

std::vector<DrivenRun> drawn_runs(std::uint64_t first, int count, double heading = 0) {
  std::vector<DrivenRun> runs;
  for (int i = 0; i < count; ++i) {
    runs.push_back(drawn_run(first + static_cast<std::uint64_t>(i), heading));
  }
  return runs;
}

TEST(PathBand, HoldsTheShareOfWholePathsThatItReports) {
  for (const double coverage : {0.5, 0.9}) {
    double inside = 0;
    for (std::uint64_t k = 0; k < 10; ++k) {
      const auto band = path_band(drawn_runs(10000 * (k + 1), 200), coverage);
      for (const DrivenRun& run : drawn_runs(77 + 1000000 * (k + 1), 200)) {
        inside += excursion(band, run) <= 1 ? 1 : 0;
      }
    }
    EXPECT_NEAR(inside / 2000, coverage, 0.03);
  }
}

TEST(PathBand, HeadingsMayLieAcrossTheWrap) {
  const auto runs = drawn_runs(1, 100, std::numbers::pi);
  const auto band = path_band(runs, 0.9);
  for (const BandPoint& point : band) EXPECT_LT(point.above[2] + point.below[2], 3);
  EXPECT_GT(std::abs(band.front().middle.theta), 3);
}

TEST(Grid, FollowsEachLegsOwnTime) {
  DrivenRun run(1);
  run[0].path = {{0, {0, 0, 0}}, {0.5, {1, 0, 0}}, {2, {1, 3, 0}}};
  const auto grid = on_grid(run, 4);
  ASSERT_EQ(grid.size(), 5U);
  EXPECT_NEAR(grid[1].pose.x, 1, 1e-12) << "at 0.5 s";
  EXPECT_NEAR(grid[3].pose.y, 2, 1e-12) << "at 1.5 s";
  EXPECT_NEAR(grid[4].pose.y, 3, 1e-12);
}

TEST(EndEllipse, HoldsItsShareOfANormalCloud) {
  std::vector<DrivenRun> runs;
  Stream stream({.run_seed = 5});
  for (int i = 0; i < 4000; ++i) {
    const double u = 0.3 * stream.normal(), v = 0.1 * stream.normal();
    // Turned by 0.5 rad.
    const Pose end{1 + u * std::cos(0.5) - v * std::sin(0.5), u * std::sin(0.5) + v * std::cos(0.5),
                   0.2 * stream.normal()};
    runs.push_back({Leg{{}, {{0, {}}, {1, end}}}});
  }
  const EndEllipse ellipse = end_ellipse(runs, 0.9);
  EXPECT_NEAR(ellipse.major_m, 0.3 * std::sqrt(4.605), 0.02);
  EXPECT_NEAR(ellipse.minor_m, 0.1 * std::sqrt(4.605), 0.01);
  EXPECT_NEAR(std::abs(std::remainder(ellipse.direction_rad - 0.5, std::numbers::pi)), 0, 0.03);
  EXPECT_NEAR(ellipse.heading_deviation_rad, 0.2, 0.01);
  int inside = 0;
  for (const DrivenRun& run : runs) {
    const Pose& end = run.back().path.back().pose;
    const Eigen::Vector2d d(end.x - ellipse.mean.x, end.y - ellipse.mean.y);
    inside += d.dot(ellipse.covariance.inverse() * d) <= -2 * std::log(0.1) ? 1 : 0;
  }
  EXPECT_NEAR(inside / 4000.0, 0.9, 0.015);
}

TEST(FloorPath, KeepsPointsApartAndTheEnd) {
  std::vector<PathSample> path;
  for (int i = 0; i <= 100; ++i) path.push_back({0.01 * i, {0.001 * i, 0, 0}});
  EXPECT_EQ(floor_path(path, 0.0199).size(), 6U) << "the end is one of them";
  const auto points = floor_path(path, 0.0299);
  EXPECT_EQ(points.size(), 5U) << "the end comes on top";
  EXPECT_NEAR(points.back().x(), 0.1, 1e-12);
}

}  // namespace gapfarm::band_test
