#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/math/algebra.h"
#include "common/math/statistics.h"
#include "master/experiments/drive/drive.h"
#include "master/report/figures/figures.h"
#include "master/report/page_frame.h"

namespace gapfarm {
namespace {

std::vector<SvgPoint> drawn(std::span<const PathPoint> path) {
  return mapped(path, [](const PathPoint& p) { return SvgPoint{p.x(), p.y()}; });
}

LineChart floor_chart(const DriveReport& report) {
  LineChart chart;
  chart.title = "On the floor";
  chart.x_title = "x, m";
  chart.y_title = "y, m";
  chart.equal_axes = true;
  if (!report.real.empty()) {
    chart.series.push_back({.name = "real path", .line = drawn(report.real)});
  }
  for (const DriverReport& driver : report.drivers) {
    ChartSeries series{.name = driver.name};
    if (!driver.band.empty()) {
      for (const BandPoint& p : driver.band) series.line.push_back({p.middle.x, p.middle.y});
    } else {
      series.line = drawn(floor_path(driver.runs.front(), 0.005));
    }
    chart.series.push_back(std::move(series));
  }
  if (!report.targets.empty()) {
    ChartSeries targets{.name = "way-points"};
    targets.marks = mapped(report.targets, [](auto& t) {
      return Pose{t.x(), t.y(), std::nan("")};
    });
    chart.series.push_back(std::move(targets));
  }
  const DriverReport& first = report.drivers.front();
  chart.series.push_back(
      {.name = "ends of " + first.name, .marks = mapped(first.runs, [](const DrivenRun& run) {
                                          return run.back().path.back().pose;
                                        })});
  return chart;
}

LineChart band_chart(const DriveReport& report, int coordinate) {
  constexpr const char* kTitles[] = {"x, m", "y, m", "heading from the middle, rad"};
  LineChart chart;
  chart.title = fmt::format("Band that holds {:.0f} % of whole paths: {}", 100 * report.coverage,
                            kTitles[coordinate]);
  chart.x_title = "legs driven";
  chart.y_title = kTitles[coordinate];
  for (const DriverReport& driver : report.drivers) {
    if (driver.band.empty()) continue;
    ChartSeries series{.name = driver.name};
    for (const BandPoint& p : driver.band) {
      const double at = static_cast<double>(p.leg) + p.share;
      const double middle = coordinate == 0 ? p.middle.x : coordinate == 1 ? p.middle.y : 0;
      series.line.push_back({at, middle});
      series.lower.push_back({at, middle - p.below[coordinate]});
      series.upper.push_back({at, middle + p.above[coordinate]});
    }
    chart.series.push_back(std::move(series));
  }
  return chart;
}

std::string distance_text(const RunDistance& distance) {
  return fmt::format("{:.3g} ({:.3g} to {:.3g})", distance.median, distance.middle_90.lower,
                     distance.middle_90.upper);
}

// A band is never thinner: m and rad.
constexpr double kThinnest = 1e-6;
constexpr unsigned kPointsALeg = 20;

Pose pose_at(const std::vector<PathSample>& path, double t_s) {
  const auto after = std::ranges::lower_bound(path, t_s, {}, &PathSample::t_s);
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
  const auto poses = mapped(paths, [&](const auto& path) { return path[i].pose; });
  const Pose middle{median(mapped(poses, &Pose::x)), median(mapped(poses, &Pose::y)),
                    circular_centre(mapped(poses, &Pose::theta))};
  BandPoint point{paths[0][i].leg, paths[0][i].share, middle, {}, {}};
  for (int k = 0; k < 3; ++k) {
    const auto deviations = mapped(poses, [&](const Pose& X) { return off(middle, X)[k]; });
    point.below[k] = std::max(kThinnest, -quantile(deviations, 0.05));
    point.above[k] = std::max(kThinnest, quantile(deviations, 0.95));
  }
  return point;
}

}  // namespace

RealDistances distances_to(std::span<const DrivenRun> runs, std::span<const PathPoint> real,
                           double spacing_m) {
  const auto paths = mapped(runs, [&](const DrivenRun& run) { return floor_path(run, spacing_m); });
  RealDistances found;
  for (std::size_t k = 0; k < found.size(); ++k) {
    const auto far =
        mapped(paths, [&](const auto& path) { return kPathDistances[k].distance(path, real); });
    found[k] = {median(far), {quantile(far, 0.05), quantile(far, 0.95)}};
  }
  return found;
}

std::string drive_text(const DriveReport& report) {
  std::string text;
  for (const DriverReport& driver : report.drivers) {
    const EndEllipse& end = driver.end;
    text += fmt::format("{} ({} runs of {} legs)\n", driver.name, driver.runs.size(),
                        driver.runs.front().size());
    text += fmt::format("  ends at x {:.4f} m, y {:.4f} m, heading {:.4f} rad", end.mean.x,
                        end.mean.y, end.mean.theta);
    if (!driver.band.empty()) {
      text += fmt::format(
          "; {:.0f} % ellipse: half axes {:.1f} mm and {:.1f} mm, long one at {:.2f} rad; heading "
          "s.d. {:.3f} rad",
          100 * report.coverage, 1e3 * end.major_m, 1e3 * end.minor_m, end.direction_rad,
          end.heading_deviation_rad);
    }
    text += "\n";
    if (driver.real) {
      text += "  from the real path, m, median (5 % to 95 %)";
      for (std::size_t k = 0; k < driver.real->size(); ++k) {
        text += fmt::format("{} {} {}", k == 0 ? ":" : ",", kPathDistances[k].title,
                            distance_text((*driver.real)[k]));
      }
      text += "\n";
    }
  }
  if (report.real_to_targets) {
    text += "straight lines between the way-points\n  from the real path, m";
    // Lettier's means nothing of what nobody drove in time.
    for (std::size_t k = 0; k + 1 < report.real_to_targets->size(); ++k) {
      text += fmt::format("{} {} {:.3g}", k == 0 ? ":" : ",", kPathDistances[k].title,
                          (*report.real_to_targets)[k].median);
    }
    text += "\n";
  }
  return text;
}

std::string band_csv(const DriveReport& report) {
  std::string text = "driver,leg,share,x,y,theta,x_low,x_high,y_low,y_high,theta_low,theta_high\n";
  for (const DriverReport& driver : report.drivers) {
    for (const BandPoint& p : driver.band) {
      const Pose& m = p.middle;
      text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", driver.name, p.leg + 1, p.share,
                          m.x, m.y, m.theta, m.x - p.below[0], m.x + p.above[0], m.y - p.below[1],
                          m.y + p.above[1], m.theta - p.below[2], m.theta + p.above[2]);
    }
  }
  return text;
}

std::string ends_csv(const DriveReport& report) {
  std::string text = "driver,run,x,y,theta\n";
  for (const DriverReport& driver : report.drivers) {
    for (std::size_t r = 0; r < driver.runs.size(); ++r) {
      const Pose& end = driver.runs[r].back().path.back().pose;
      text += fmt::format("{},{},{},{},{}\n", driver.name, r + 1, end.x, end.y, end.theta);
    }
  }
  return text;
}

std::string drive_page(const DriveReport& report, const std::string& title) {
  PlainPage page(title);
  const LineChart floor = floor_chart(report);
  page.picture(line_chart(floor), floor.title);
  page.heading("Where the runs end");
  TextTable table{{"driver", "runs", "x, m", "y, m", "heading, rad",
                   fmt::format("{:.0f} % ellipse, half axes, mm", 100 * report.coverage),
                   "heading s.d., rad", "Frechet to the real path, m", "Hausdorff, m",
                   "Lettier, m"}};
  for (const DriverReport& driver : report.drivers) {
    const EndEllipse& end = driver.end;
    table.rows.push_back({driver.name, std::to_string(driver.runs.size()),
                          fmt::format("{:.4f}", end.mean.x), fmt::format("{:.4f}", end.mean.y),
                          fmt::format("{:.4f}", end.mean.theta),
                          fmt::format("{:.1f} by {:.1f}", 1e3 * end.major_m, 1e3 * end.minor_m),
                          fmt::format("{:.3f}", end.heading_deviation_rad)});
    for (std::size_t k = 0; k < kPathDistances.size(); ++k) {
      table.rows.back().push_back(driver.real ? distance_text((*driver.real)[k]) : "–");
    }
  }
  page.table(table);
  page.heading("How runs spread");
  page.paragraph(
      "Each band holds whole paths: a path counts as inside only when every point of it is, in x, "
      "y and heading. Half of the runs give its shape, the other half its width.");
  for (int coordinate = 0; coordinate < 3; ++coordinate) {
    const LineChart chart = band_chart(report, coordinate);
    if (!chart.series.empty()) page.picture(line_chart(chart), chart.title);
  }
  return page.finish();
}

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

std::vector<BandPoint> path_band(std::span<const DrivenRun> runs, double coverage) {
  assert(runs.size() >= 4);
  std::vector<std::vector<GridPoint>> shaping, judging;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    (r % 2 == 0 ? shaping : judging).push_back(on_grid(runs[r], kPointsALeg));
  }
  auto band = mapped(indices(shaping.front().size()), [&](auto i) { return shape_at(shaping, i); });
  auto excursions = mapped(judging, [&](const auto& path) { return excursion_of(band, path); });
  std::ranges::sort(excursions);
  const auto n = static_cast<double>(excursions.size());
  const double rank = std::clamp(std::ceil((n + 1) * coverage), 1.0, n);
  const double factor = excursions[static_cast<std::size_t>(rank) - 1];
  for (BandPoint& point : band) {
    point.below *= factor;
    point.above *= factor;
  }
  return band;
}

double excursion(const std::vector<BandPoint>& band, const DrivenRun& run) {
  return excursion_of(band, on_grid(run, kPointsALeg));
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
  const SymmetricAxes axes = axes_of_symmetric(ellipse.covariance);
  ellipse.minor_m = std::sqrt(q * std::max(0.0, axes.values[0]));
  ellipse.major_m = std::sqrt(q * std::max(0.0, axes.values[1]));
  ellipse.direction_rad = std::atan2(axes.vectors(1, 1), axes.vectors(0, 1));
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
  return floor_path(flattened(run, &Leg::path), spacing_m);
}

}  // namespace gapfarm
