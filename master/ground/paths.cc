#include "master/ground/paths.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "common/math/statistics.h"
#include "common/pose/pose.h"
#include "common/recordings/windows.h"
#include "master/infer/predictor.h"
#include "master/report/figures/figures.h"

namespace gapfarm {
namespace {

// Trials that all begin with their run and end further and further on.
Status put_stretches(const RunLog& runs, double every_s, Problem* to, DrivenPaths* paths) {
  ASSIGN_OR_RETURN(const auto whole, cut_windows(runs, {{0}, 0}));
  to->runs = whole.runs;
  to->log = {};
  for (const Trial& run : whole.log.trials) {
    const std::vector<PoseRow>& poses = runs.runs[*run.run].poses;
    DrivenPath path{run.session, {run.X_WS}, {run.X_WS}, {run.X_WS}, {*run.t_s}, *run.run};
    for (std::size_t k = 1; k < poses.size(); ++k) {
      if (poses[k].t_s < path.t_s.back() + every_s && k + 1 < poses.size()) continue;
      to->log.trials.push_back(window_between(runs, *run.run, 0, k, to->log.trials.size()));
      path.logged.push_back(poses[k].X_WM);
      path.t_s.push_back(poses[k].t_s);
    }
    paths->runs.push_back(std::move(path));
  }
  return {};
}

}  // namespace

Result<DrivenPaths> drive_paths(Farm& farm, const Problem& fitted, const ParameterValues& values,
                                const RunLog& runs, double every_s) {
  Problem asked = fitted;
  asked.fitness.kind = FitnessKind::kLogScore;
  DrivenPaths paths;
  RETURN_IF_ERROR(put_stretches(runs, every_s, &asked, &paths));
  Overrides fits;
  for (std::size_t row = 0; row < values.size(); ++row) fits[row] = values[row];
  ASSIGN_OR_RETURN(const auto ends, Predictor(farm, asked).ends({{{}, {}}, {fits, {}}}));
  std::size_t next = 0;
  for (DrivenPath& path : paths.runs) {
    for (std::size_t k = 1; k < path.logged.size(); ++k, ++next) {
      path.before.push_back(ends[0][next]);
      path.after.push_back(ends[1][next]);
    }
  }
  const auto off = [&](std::vector<Pose> DrivenPath::*driven) {
    return median(mapped(paths.runs, [&](const DrivenPath& path) {
      const Pose &a = (path.*driven).back(), &b = path.logged.back();
      return std::hypot(a.x - b.x, a.y - b.y);
    }));
  };
  if (paths.runs.empty()) return paths;
  paths.before_m = off(&DrivenPath::before);
  paths.after_m = off(&DrivenPath::after);
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
  const LoggedRun* run = find_by(log.runs, window.session, session_of);
  std::vector<PathSample> path;
  if (run == nullptr) return path;
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
  std::vector<LineChart> charts;
  for (std::size_t k = 0; k < std::min(most, paths.runs.size()); ++k) {
    const DrivenPath& run = paths.runs[k];
    LineChart& chart = charts.emplace_back();
    chart.title = "run " + run.run;
    chart.x_title = "x, m";
    chart.y_title = "y, m";
    chart.equal_axes = true;
    for (const auto& [name, poses] :
         {std::pair(fmt::format("fitted: ends {:.2f} m off (median)", paths.after_m), &run.after),
          {fmt::format("as its files say: {:.2f} m", paths.before_m), &run.before},
          {"logged", &run.logged}}) {
      chart.series.push_back({name, mapped(*poses, [](const Pose& X) {
                                return SvgPoint{X.x, X.y};
                              })});
    }
  }
  return line_charts(charts, 2);
}

}  // namespace gapfarm
