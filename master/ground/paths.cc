#include "master/ground/paths.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "common/math/statistics.h"
#include "common/pose/pose.h"
#include "common/recordings/windows.h"
#include "common/svg/svg.h"

namespace gapfarm {
namespace {

constexpr const char* kLogged = "#888888";
constexpr const char* kBefore = "#d55e00";
constexpr const char* kAfter = "#0072b2";
constexpr double kPanel = 300, kPad = 34, kLegend = 46;

// Trials that all begin with their run and end further and further on.
Status put_stretches(const RunLog& runs, double every_s, Problem* to, DrivenPaths* paths) {
  ASSIGN_OR_RETURN(const auto whole, cut_windows(runs, {{0}, 0}));
  to->runs = whole.runs;
  to->log = {};
  for (const Trial& run : whole.log.trials) {
    const LoggedRun& logged = runs.runs[*run.run];
    DrivenPath path{run.session, {run.X_WS}, {run.X_WS}, {run.X_WS}, {*run.t_s}, *run.run};
    double last_s = *run.t_s;
    for (const PoseRow& pose : logged.poses) {
      if (pose.t_s < last_s + every_s && &pose != &logged.poses.back()) continue;
      if (pose.t_s <= *run.t_s) continue;
      last_s = pose.t_s;
      Trial stretch = run;
      stretch.duration_s = pose.t_s - *run.t_s;
      stretch.X_WE = pose.X_WM;
      stretch.trial = static_cast<std::int64_t>(to->log.trials.size());
      to->log.trials.push_back(std::move(stretch));
      path.logged.push_back(pose.X_WM);
      path.t_s.push_back(pose.t_s);
    }
    paths->runs.push_back(std::move(path));
  }
  return {};
}

Result<std::vector<Pose>> simulated_ends(Farm& farm, const Problem& problem) {
  ASSIGN_OR_RETURN(const auto results, farm.run(farm.add_problem(to_proto(problem)),
                                                {prediction_task(Genome(), false)}));
  const v1::TaskResult& result = results.front();
  RETURN_IF_ERROR(ended_well(result));
  return mapped(result.predict().predictions(),
                [](const v1::Predicted& p) { return from_proto(p.end()); });
}

double end_distance(const std::vector<Pose>& a, const std::vector<Pose>& b) {
  return std::hypot(a.back().x - b.back().x, a.back().y - b.back().y);
}

// Metres to pixels of one panel.
struct Scale {
  SvgPoint corner;
  double least_x = 0, most_y = 0, per_m = 1;

  SvgPoint at(const Pose& X) const {
    return {corner.x + (X.x - least_x) * per_m, corner.y + (most_y - X.y) * per_m};
  }
};

Scale scale_of(const DrivenPath& path, SvgPoint corner) {
  Extent box;
  for (const auto* poses : {&path.logged, &path.before, &path.after}) {
    for (const Pose& X : *poses) box.add(X);
  }
  const double room = kPanel - 2 * kPad;
  const double per_m = room / std::max(box.longer_side(), 1e-3);
  const double beside = (room - (box.x1 - box.x0) * per_m) / 2;
  return {{corner.x + kPad + beside, corner.y + kPad}, box.x0, box.y1, per_m};
}

void draw_path(const std::vector<Pose>& poses, const Scale& scale, const char* colour, double width,
               Svg* svg) {
  std::vector<SvgPoint> points = mapped(poses, [&](const Pose& X) { return scale.at(X); });
  svg->polyline(points, {"none", colour, width, {}, 0.9});
  svg->circle(points.back(), 3.5, {colour, "none"});
}

void draw_panel(const DrivenPath& path, SvgPoint corner, Svg* svg) {
  const Scale scale = scale_of(path, corner);
  svg->rectangle({corner.x + 6, corner.y + 6}, kPanel - 12, kPanel - 12, {"none", "#dddddd"});
  svg->text({corner.x + 14, corner.y + 22}, "run " + path.run, {});
  draw_path(path.logged, scale, kLogged, 3, svg);
  draw_path(path.before, scale, kBefore, 1.5, svg);
  draw_path(path.after, scale, kAfter, 1.5, svg);
  svg->circle(scale.at(path.logged.front()), 4, {"#ffffff", "#222222", 1.5});
  const SvgPoint bar = {corner.x + 14, corner.y + kPanel - 14};
  svg->line(bar, {bar.x + scale.per_m * 0.5, bar.y}, {"none", "#222222", 1.5});
  svg->text({bar.x, bar.y - 5}, "0.5 m", {10});
}

}  // namespace

Result<DrivenPaths> drive_paths(Farm& farm, const Problem& fitted, const ParameterValues& values,
                                const RunLog& runs, double every_s) {
  Problem asked = fitted;
  asked.fitness.kind = FitnessKind::kLogScore;
  DrivenPaths paths;
  RETURN_IF_ERROR(put_stretches(runs, every_s, &asked, &paths));
  ASSIGN_OR_RETURN(const auto before, simulated_ends(farm, asked));
  asked.values = values;
  ASSIGN_OR_RETURN(const auto after, simulated_ends(farm, asked));
  std::size_t next = 0;
  std::vector<double> off_before, off_after;
  for (DrivenPath& path : paths.runs) {
    for (std::size_t k = 1; k < path.logged.size(); ++k, ++next) {
      path.before.push_back(before[next]);
      path.after.push_back(after[next]);
    }
    off_before.push_back(end_distance(path.before, path.logged));
    off_after.push_back(end_distance(path.after, path.logged));
  }
  if (off_after.empty()) return paths;
  paths.before_m = median(off_before);
  paths.after_m = median(off_after);
  return paths;
}

Result<std::vector<SimulatedWindow>> simulate_window(Farm& farm, const Problem& problem,
                                                     const Trial& window,
                                                     const std::vector<Genome>& genomes,
                                                     std::size_t samples) {
  Problem asked = problem;
  asked.fitness.kind = FitnessKind::kLogScore;
  asked.runs = {problem.runs[*window.run]};
  asked.log = {};
  const auto time = [&](std::size_t k) {
    return *window.duration_s * static_cast<double>(k) / static_cast<double>(samples);
  };
  for (std::size_t k = 1; k <= samples; ++k) {
    Trial stretch = window;
    stretch.run = 0;
    stretch.trial = static_cast<std::int64_t>(k);
    stretch.duration_s = time(k);
    asked.log.trials.push_back(std::move(stretch));
  }
  const auto tasks = mapped(genomes, [](const Genome& g) { return prediction_task(g, true); });
  ASSIGN_OR_RETURN(const auto results, farm.run(farm.add_problem(to_proto(asked)), tasks));
  std::vector<SimulatedWindow> windows;
  for (const v1::TaskResult& result : results) {
    SimulatedWindow& to = windows.emplace_back();
    if (result.outcome() != v1::OK) {
      to.failed = v1::Outcome_Name(result.outcome());
      continue;
    }
    to.path.push_back({0, window.X_WS});
    for (const v1::Predicted& p : result.predict().predictions()) {
      to.path.push_back({time(to.path.size()), from_proto(p.end())});
    }
  }
  return windows;
}

std::vector<PathSample> measured_window(const RunLog& log, const Trial& window) {
  const auto run = std::ranges::find_if(
      log.runs, [&](const LoggedRun& r) { return session_of(r) == window.session; });
  std::vector<PathSample> path;
  if (run == log.runs.end()) return path;
  const double end_s = *window.t_s + *window.duration_s;
  constexpr double kSame = 1e-6;  // of a time or a pose that was written and read again
  for (const PoseRow& pose : run->poses) {
    if (pose.t_s < *window.t_s - kSame || pose.t_s > end_s + kSame) continue;
    path.push_back({pose.t_s - *window.t_s, pose.X_WM});
  }
  const auto same = [](const Pose& a, const Pose& b) {
    return std::hypot(a.x - b.x, a.y - b.y) < kSame;
  };
  const bool of_it = path.size() > 1 && same(path.front().pose, window.X_WS) &&
                     same(path.back().pose, window.X_WE);
  return of_it ? path : std::vector<PathSample>();
}

std::string draw_paths(const DrivenPaths& paths, std::size_t most) {
  const std::size_t count = std::min(most, paths.runs.size());
  const std::size_t across = std::min<std::size_t>(3, std::max<std::size_t>(count, 1));
  const std::size_t down = (count + across - 1) / across;
  const double width = static_cast<double>(across) * kPanel;
  Svg svg(width, static_cast<double>(down) * kPanel + kLegend);
  for (std::size_t k = 0; k < count; ++k) {
    draw_panel(paths.runs[k],
               {static_cast<double>(k % across) * kPanel, static_cast<double>(k / across) * kPanel},
               &svg);
  }
  const double y = static_cast<double>(down) * kPanel + 18;
  const auto name = [&](double x, double row, const char* colour, const std::string& label) {
    svg.line({x, row - 4}, {x + 22, row - 4}, {"none", colour, 3});
    svg.text({x + 28, row}, label, {});
  };
  name(14, y, kLogged, "logged");
  name(110, y, kBefore,
       fmt::format("as its files say: ends {:.2f} m off (median)", paths.before_m));
  name(110, y + 18, kAfter, fmt::format("fitted: {:.2f} m", paths.after_m));
  return svg.finish();
}

}  // namespace gapfarm
