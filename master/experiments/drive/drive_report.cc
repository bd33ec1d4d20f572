#include "master/experiments/drive/drive_report.h"

#include <spdlog/fmt/fmt.h>

#include "common/math/statistics.h"
#include "master/report/figures/line_chart.h"
#include "master/report/page_frame.h"

namespace gapfarm {
namespace {

std::vector<SvgPoint> drawn(std::span<const PathPoint> path) {
  std::vector<SvgPoint> points;
  for (const PathPoint& p : path) points.push_back({p.x(), p.y()});
  return points;
}

LineChart floor_chart(const DriveReport& report) {
  LineChart chart;
  chart.title = "On the floor";
  chart.x_title = "x, m";
  chart.y_title = "y, m";
  chart.equal_axes = true;
  if (!report.real.empty()) {
    chart.series.push_back(
        {.name = "real path", .line = drawn(report.real), .lower = {}, .upper = {}});
  }
  for (const DriverReport& driver : report.drivers) {
    ChartSeries series{.name = driver.name, .line = {}, .lower = {}, .upper = {}};
    if (driver.band) {
      for (const BandPoint& p : driver.band->points())
        series.line.push_back({p.middle.x, p.middle.y});
    } else {
      series.line = drawn(floor_path(driver.runs.front(), 0.005));
    }
    chart.series.push_back(std::move(series));
  }
  if (!report.targets.empty()) {
    ChartSeries targets{.name = "way-points", .line = {}, .lower = {}, .upper = {}, .dots = true};
    for (const Eigen::Vector2d& t : report.targets) targets.line.push_back({t.x(), t.y()});
    chart.series.push_back(std::move(targets));
  }
  const DriverReport& first = report.drivers.front();
  ChartSeries ends{
      .name = "ends of " + first.name, .line = {}, .lower = {}, .upper = {}, .dots = true};
  for (const DrivenRun& run : first.runs) {
    ends.line.push_back({run.back().path.back().pose.x, run.back().path.back().pose.y});
  }
  chart.series.push_back(std::move(ends));
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
    if (!driver.band) continue;
    ChartSeries series{.name = driver.name, .line = {}, .lower = {}, .upper = {}};
    for (const BandPoint& p : driver.band->points()) {
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

std::string with_interval(double value, const Interval& interval) {
  return fmt::format("{:.3g} ({:.3g} to {:.3g})", value, interval.lower, interval.upper);
}

std::vector<std::string> real_cells(const std::optional<RealDistances>& real) {
  if (!real) return {"–", "–", "–"};
  return {with_interval(real->frechet, real->frechet_90),
          with_interval(real->hausdorff, real->hausdorff_90),
          with_interval(real->lettier, real->lettier_90)};
}

}  // namespace

RealDistances distances_to(std::span<const DrivenRun> runs, std::span<const PathPoint> real,
                           double spacing_m) {
  std::vector<double> lettier, hausdorff, frechet;
  for (const DrivenRun& run : runs) {
    const std::vector<PathPoint> path = floor_path(run, spacing_m);
    lettier.push_back(lettier_distance(path, real));
    hausdorff.push_back(hausdorff_distance(path, real));
    frechet.push_back(frechet_distance(path, real));
  }
  const auto range = [](const std::vector<double>& v) {
    return Interval{quantile(v, 0.05), quantile(v, 0.95)};
  };
  return {median(lettier), median(hausdorff), median(frechet),
          range(lettier),  range(hausdorff),  range(frechet)};
}

std::string drive_text(const DriveReport& report) {
  std::string text;
  for (const DriverReport& driver : report.drivers) {
    const EndEllipse& end = driver.end;
    text += fmt::format("{} ({} runs of {} legs)\n", driver.name, driver.runs.size(),
                        driver.runs.front().size());
    text += fmt::format("  ends at x {:.4f} m, y {:.4f} m, heading {:.4f} rad", end.mean.x,
                        end.mean.y, end.mean.theta);
    if (driver.band) {
      text += fmt::format(
          "; {:.0f} % ellipse: half axes {:.1f} mm and {:.1f} mm, long one at {:.2f} rad; heading "
          "s.d. {:.3f} rad",
          100 * report.coverage, 1e3 * end.major_m, 1e3 * end.minor_m, end.direction_rad,
          end.heading_deviation_rad);
    }
    text += "\n";
    if (driver.real) {
      text += fmt::format(
          "  from the real path, m, median (5 % to 95 %): Frechet {}, Hausdorff {}, Lettier {}\n",
          with_interval(driver.real->frechet, driver.real->frechet_90),
          with_interval(driver.real->hausdorff, driver.real->hausdorff_90),
          with_interval(driver.real->lettier, driver.real->lettier_90));
    }
  }
  if (report.real_to_targets) {
    text += fmt::format(
        "straight lines between the way-points\n  from the real path, m: Frechet "
        "{:.3g}, Hausdorff {:.3g}\n",
        report.real_to_targets->frechet, report.real_to_targets->hausdorff);
  }
  return text;
}

std::string band_csv(const DriveReport& report) {
  std::string text = "driver,leg,share,x,y,theta,x_low,x_high,y_low,y_high,theta_low,theta_high\n";
  for (const DriverReport& driver : report.drivers) {
    if (!driver.band) continue;
    for (const BandPoint& p : driver.band->points()) {
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
  std::vector<std::vector<std::string>> rows;
  for (const DriverReport& driver : report.drivers) {
    const EndEllipse& end = driver.end;
    rows.push_back({driver.name, std::to_string(driver.runs.size()),
                    fmt::format("{:.4f}", end.mean.x), fmt::format("{:.4f}", end.mean.y),
                    fmt::format("{:.4f}", end.mean.theta),
                    fmt::format("{:.1f} by {:.1f}", 1e3 * end.major_m, 1e3 * end.minor_m),
                    fmt::format("{:.3f}", end.heading_deviation_rad)});
    const auto cells = real_cells(driver.real);
    rows.back().insert(rows.back().end(), cells.begin(), cells.end());
  }
  page.table({"driver", "runs", "x, m", "y, m", "heading, rad",
              fmt::format("{:.0f} % ellipse, half axes, mm", 100 * report.coverage),
              "heading s.d., rad", "Frechet to the real path, m", "Hausdorff, m", "Lettier, m"},
             rows);
  page.heading("How runs spread");
  page.paragraph(
      "Each band holds whole paths: a path counts as inside only when every point of it is, in x, "
      "y "
      "and heading. Half of the runs give its shape, the other half its width.");
  for (int coordinate = 0; coordinate < 3; ++coordinate) {
    const LineChart chart = band_chart(report, coordinate);
    if (!chart.series.empty()) page.picture(line_chart(chart), chart.title);
  }
  return page.finish();
}

}  // namespace gapfarm
