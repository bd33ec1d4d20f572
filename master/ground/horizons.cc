#include "master/ground/horizons.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "common/base/ranges.h"
#include "common/math/statistics.h"
#include "common/random/stream.h"
#include "common/score/fitness.h"
#include "common/trials/text/csv.h"
#include "master/ground/fit/kinematic_baseline.h"
#include "master/ground/fit/window_set.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr double kSpeedSpan_s = 0.5;  // of poses before a window, for constant velocity
// Windows in which the robot hardly went anywhere have no error a metre.
constexpr double kLeastPathShare = 0.1;  // of the median way

// Length of the marker's measured way in a window.
double travel_of(const LoggedRun& run, const Trial& trial) {
  const std::vector<PoseRow>& poses = run.poses;
  double sum = 0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    if (poses[i - 1].t_s < *trial.t_s || poses[i].t_s > *trial.t_s + *trial.duration_s) continue;
    const Pose& a = poses[i - 1].X_WM;
    const Pose& b = poses[i].X_WM;
    sum += std::hypot(b.x - a.x, b.y - a.y);
  }
  return sum;
}

Pose constant_end(const LoggedRun& run, const Trial& trial) {
  const std::vector<PoseRow>& poses = run.poses;
  const auto here = std::ranges::lower_bound(poses, *trial.t_s, {}, &PoseRow::t_s);
  auto before = here;
  while (before != poses.begin() && (before - 1)->t_s >= *trial.t_s - kSpeedSpan_s) --before;
  if (before == here) return trial.X_WS;
  const double factor = *trial.duration_s / (here->t_s - before->t_s);
  return trial.X_WS * exp(Twist(factor * log(between(before->X_WM, here->X_WM))));
}

WindowError error_of(const Pose& end, const Trial& trial) {
  const Eigen::Vector3d d = local_difference(end, trial.X_WE);
  return {d.head<2>().norm(), std::abs(d[2])};
}

WindowErrors medians_of(std::span<const WindowRow> windows, WindowError WindowRow::*which,
                        double travel_m) {
  // 0 where no window went anywhere.
  const auto middle = [&](double WindowError::*of, bool a_metre) {
    std::vector<double> errors;
    for (const WindowRow& row : windows) {
      if (a_metre && !(row.travel_m > kLeastPathShare * travel_m)) continue;
      errors.push_back(row.*which.*of / (a_metre ? row.travel_m : 1));
    }
    return errors.empty() ? 0 : median(errors);
  };
  return {middle(&WindowError::position_m, false), middle(&WindowError::heading_rad, false),
          middle(&WindowError::position_m, true), middle(&WindowError::heading_rad, true)};
}

DrawnRatio drawn_ratio_of(std::span<const WindowRow> windows, double WindowError::*of,
                          std::span<const std::size_t> run) {
  const auto each = [&](WindowError WindowRow::*which) {
    return mapped(windows, [&](const WindowRow& row) { return row.*which.*of; });
  };
  return drawn_ratio(each(&WindowRow::simulation), each(&WindowRow::kinematics), run, 1);
}

// `run` of each window.
HorizonRow row_of(std::span<const WindowRow> windows, std::span<const std::size_t> run) {
  HorizonRow row;
  row.horizon_s = windows.front().horizon_s;
  row.windows = windows.size();
  row.travel_m = median(mapped(windows, &WindowRow::travel_m));
  row.simulation = medians_of(windows, &WindowRow::simulation, row.travel_m);
  row.kinematics = medians_of(windows, &WindowRow::kinematics, row.travel_m);
  row.constant_velocity = medians_of(windows, &WindowRow::constant_velocity, row.travel_m);
  row.position = drawn_ratio_of(windows, &WindowError::position_m, run);
  row.heading = drawn_ratio_of(windows, &WindowError::heading_rad, run);
  return row;
}

std::string cells(const WindowErrors& e) {
  return fmt::format(" {:8.1f} {:8.1f} {:7.1f} {:7.1f} |", 1e3 * e.position_m, 1e3 * e.heading_rad,
                     1e3 * e.position_m_m, 1e3 * e.heading_rad_m);
}

std::string ratio_cell(const DrawnRatio& drawn) {
  if (!drawn.interval) return fmt::format("{:.2f} [few windows]", drawn.ratio);
  return fmt::format("{:.2f} [{:.2f}, {:.2f}]", drawn.ratio, (*drawn.interval)[0],
                     (*drawn.interval)[1]);
}

const char* baseline_of(const Horizons& horizons) {
  return horizons.kinematics.names.empty() ? "constant velocity" : "kinematics";
}

// Medians of the simulation that are significantly off the baseline's.
struct Apart {
  int below = 0, above = 0, untold = 0;
};

Apart significantly_apart(const Horizons& horizons) {
  Apart apart;
  for (const HorizonRow& row : horizons.rows) {
    for (const DrawnRatio& drawn : {row.position, row.heading}) {
      apart.untold += !drawn.interval;
      apart.below += drawn.interval && (*drawn.interval)[1] < 1;
      apart.above += drawn.interval && (*drawn.interval)[0] > 1;
    }
  }
  return apart;
}

std::string apart_text(const Horizons& horizons) {
  const auto [below, above, untold] = significantly_apart(horizons);
  return fmt::format(
      "of {} medians {} significantly below those of {}, {} significantly above (90 % intervals of "
      "their ratio, by drawing runs again){}\n",
      2 * horizons.rows.size(), below, baseline_of(horizons), above,
      untold > 0 ? fmt::format("; {} of too few windows", untold) : "");
}

constexpr unsigned kRatioDraws = 1000;
constexpr std::size_t kLeastDrawn = 5;  // fewer do not span 90 % of where a median may be
constexpr double kNoError = 1e-12;

double ratio_of(std::span<const double> own, std::span<const double> baseline) {
  return std::max(median(own), kNoError) / std::max(median(baseline), kNoError);
}

// Windows that are drawn together, by their places.
std::vector<std::vector<std::size_t>> groups_of(std::span<const std::size_t> run) {
  std::map<std::size_t, std::vector<std::size_t>> runs;
  for (std::size_t i = 0; i < run.size(); ++i) runs[run[i]].push_back(i);
  std::vector<std::vector<std::size_t>> groups;
  for (const auto& [name, windows] : runs) {
    std::size_t pieces = 1;
    if (runs.size() < kEnoughToScatter) {
      pieces = (kEnoughToScatter * windows.size() + run.size() - 1) / run.size();
      pieces = std::min(pieces, windows.size());
    }
    const std::size_t first = groups.size();
    groups.resize(first + pieces);
    for (std::size_t k = 0; k < windows.size(); ++k) {
      groups[first + k * pieces / windows.size()].push_back(windows[k]);
    }
  }
  return groups;
}

// Of each trial, nothing where its run's simulation did not end well: each run is a task, so that
// one that falls over takes no other with it.  Error: none ended well.
Result<std::vector<std::optional<v1::Predicted>>> predict_runs(Farm& farm, const Problem& asked,
                                                               std::size_t* unfinished) {
  std::vector<v1::Task> tasks(asked.runs.size());
  for (std::size_t i = 0; i < asked.log.trials.size(); ++i) {
    tasks[*asked.log.trials[i].run].mutable_predict()->add_trials(static_cast<std::uint32_t>(i));
  }
  std::erase_if(tasks, [](const v1::Task& task) { return !task.has_predict(); });
  ASSIGN_OR_RETURN(const auto results, farm.run(farm.add_problem(to_proto(asked)), tasks));
  std::vector<std::optional<v1::Predicted>> predicted(asked.log.trials.size());
  for (const v1::TaskResult& result : results) {
    *unfinished += result.outcome() != v1::OK;
    for (const v1::Predicted& p : result.predict().predictions()) predicted[p.trial()] = p;
  }
  if (*unfinished < results.size()) return predicted;
  return ended_well(results.front()).error();
}

}  // namespace

Result<Horizons> measure_horizons(Farm& farm, const Problem& fitted, const ParameterValues& values,
                                  const RunLog& runs, const WindowSettings& windows) {
  Problem asked = fitted;
  asked.values = values;
  asked.fitness.kind = FitnessKind::kLogScore;
  asked.log = {};
  const bool restarts = fitted.ground && is_throttled(fitted.ground->robot());
  ASSIGN_OR_RETURN(auto set, pose_windows(runs, windows, restarts, false));
  asked.runs = std::move(set.runs);
  asked.log.trials = std::move(set.trials);
  Horizons horizons;
  ASSIGN_OR_RETURN(const auto predicted, predict_runs(farm, asked, &horizons.unfinished_runs));
  std::vector<Pose> kinematic;
  if (fitted.ground) {
    ASSIGN_OR_RETURN(horizons.kinematics, fit_kinematics(fitted));
    kinematic = kinematic_ends(asked, horizons.kinematics);
  }
  for (int h = 0; h < set.lengths; ++h) {
    const auto [from, end] = std::ranges::equal_range(set.horizon, h);
    const auto first = static_cast<std::size_t>(from - set.horizon.begin());
    const auto count = static_cast<std::size_t>(end - from);
    double log_score = 0;
    for (std::size_t i = first; i < first + count; ++i) {
      const std::optional<v1::Predicted>& simulated = predicted[i];
      const Trial& trial = asked.log.trials[i];
      const LoggedRun& run = runs.runs[set.run_of[i]];
      const WindowError constant = error_of(constant_end(run, trial), trial);
      horizons.windows.push_back({set.lengths_s[h], run.session, run.run, *trial.t_s,
                                  *trial.duration_s, travel_of(run, trial),
                                  simulated ? error_of(from_proto(simulated->end()), trial)
                                            : WindowError{INFINITY, INFINITY},
                                  kinematic.empty() ? constant : error_of(kinematic[i], trial),
                                  constant});
      log_score += simulated ? simulated->log_score() / static_cast<double>(count) : -INFINITY;
    }
    horizons.rows.push_back(row_of(std::span(horizons.windows).subspan(first, count),
                                   std::span(set.run_of).subspan(first, count)));
    horizons.rows.back().log_score = log_score;
  }
  return horizons;
}

std::string format_horizons(const Horizons& horizons) {
  const bool kinematics = !horizons.kinematics.names.empty();
  std::string heads = fmt::format("{:^34}|", "simulation");
  if (kinematics) heads += fmt::format("{:^34}|", "fitted kinematics");
  std::string text = "Medians over windows: mm, mrad, and of each a metre of way\n";
  text += fmt::format("{:>7} {:>7} {:>6} |{}{:^34}| {:>9} |{:^44}\n", "horizon", "windows", "way m",
                      heads, "constant velocity", "nats",
                      fmt::format("simulation over {}", baseline_of(horizons)));
  text += fmt::format("{:>7} {:>7} {:>6} |", "s", "", "");
  for (int i = 0; i < (kinematics ? 3 : 2); ++i) {
    text += fmt::format(" {:>8} {:>8} {:>7} {:>7} |", "mm", "mrad", "mm/m", "mrad/m");
  }
  text += fmt::format(" {:>9} | {:>20}  {:>20}\n", "", "mm", "mrad");
  for (const HorizonRow& row : horizons.rows) {
    const std::string name = row.horizon_s > 0 ? fmt::format("{:g}", row.horizon_s) : "whole";
    text += fmt::format("{:>7} {:>7} {:>6.2f} |", name, row.windows, row.travel_m) +
            cells(row.simulation) + (kinematics ? cells(row.kinematics) : "") +
            cells(row.constant_velocity) +
            fmt::format(" {:>9.3f} | {:>20}  {:>20}\n", row.log_score, ratio_cell(row.position),
                        ratio_cell(row.heading));
  }
  text += apart_text(horizons);
  if (const std::size_t n = horizons.unfinished_runs; n > 0) {
    text += fmt::format(
        "{} run{} could not be simulated to the end (the robot fell over or left bounds); windows "
        "count as infinitely far off there\n",
        n, n == 1 ? "" : "s");
  }
  if (!kinematics) return text;
  text += "kinematics:";
  for (std::size_t i = 0; i < horizons.kinematics.names.size(); ++i) {
    text += fmt::format(" {} {:.4g}", horizons.kinematics.names[i], horizons.kinematics.values[i]);
  }
  return text + "\n";
}

Json horizons_json(const Horizons& horizons) {
  const auto errors = [](const WindowErrors& e) {
    return Json{{"position_m", e.position_m},
                {"heading_rad", e.heading_rad},
                {"position_m_m", e.position_m_m},
                {"heading_rad_m", e.heading_rad_m}};
  };
  const auto interval = [](const DrawnRatio& drawn) {
    return drawn.interval ? Json(*drawn.interval) : Json();
  };
  const Apart apart = significantly_apart(horizons);
  Json json = {{"rows", Json::array()},
               {"unfinished_runs", horizons.unfinished_runs},
               {"significantly_below", apart.below},
               {"significantly_above", apart.above}};
  for (std::size_t i = 0; i < horizons.kinematics.names.size(); ++i) {
    json["fitted_kinematics"][horizons.kinematics.names[i]] = horizons.kinematics.values[i];
  }
  for (const HorizonRow& row : horizons.rows) {
    Json& one = json["rows"].emplace_back(Json{{"horizon_s", row.horizon_s},
                                               {"windows", row.windows},
                                               {"travel_m", row.travel_m},
                                               {"log_score", row.log_score},
                                               {"simulation", errors(row.simulation)},
                                               {"constant_velocity", errors(row.constant_velocity)},
                                               {"position_ratio", row.position.ratio},
                                               {"position_ratio_90", interval(row.position)},
                                               {"heading_ratio", row.heading.ratio},
                                               {"heading_ratio_90", interval(row.heading)}});
    if (!horizons.kinematics.names.empty()) one["kinematics"] = errors(row.kinematics);
  }
  return json;
}

std::string windows_csv(const Horizons& horizons) {
  std::string text =
      "horizon,session,run,t,duration,way,position,heading,kinematics_position,kinematics_heading,"
      "constant_position,constant_heading\n";
  for (const WindowRow& w : horizons.windows) {
    text += fmt::format("{:g},{},{},{:.4f},{:.4f},{:.4f}", w.horizon_s, csv_field(w.session),
                        csv_field(w.run), w.start_s, w.duration_s, w.travel_m);
    for (const WindowError& e : {w.simulation, w.kinematics, w.constant_velocity}) {
      text += fmt::format(",{:.6f},{:.6f}", e.position_m, e.heading_rad);
    }
    text += "\n";
  }
  return text;
}

DrawnRatio drawn_ratio(std::span<const double> own, std::span<const double> baseline,
                       std::span<const std::size_t> run, std::uint64_t seed) {
  DrawnRatio drawn;
  drawn.ratio = ratio_of(own, baseline);
  const auto groups = groups_of(run);
  if (groups.size() < kLeastDrawn) return drawn;
  Stream stream({seed, Purpose::kStatistics, 0, 0, 0});
  const auto ratio = [&](std::span<const std::size_t> windows) {
    const auto of = [&](std::span<const double> errors) {
      return mapped(windows, [&](std::size_t i) { return errors[i]; });
    };
    return ratio_of(of(own), of(baseline));
  };
  const auto [lo, hi] = bootstrap_interval(groups, ratio, 0.9, kRatioDraws, stream, /*spared=*/1);
  drawn.interval = {lo, hi};
  return drawn;
}

}  // namespace gapfarm
