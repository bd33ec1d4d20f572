#include "master/ground/free_residual.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "master/diagnose/correction/fit.h"
#include "master/ground/fit/held_out.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

// Of a robot whose file states none, m.
constexpr double kUsualSeparation_m = 0.3;

int sign(double value) { return (value > 0) - (value < 0); }

// The windows of one length, as single drives.
struct Length {
  std::vector<std::size_t> windows;  // ascending
  ResidualData data;
  Residuals residuals;
};

Length windows_of_length(const WindowFitter& fitter, const WindowFit& fit, int horizon) {
  const WindowSet& windows = fitter.windows();
  const std::vector<Eigen::Vector3d> raw = fitter.raw_residuals(fit);
  const std::vector<int> folds = held_out_folds(windows);
  const std::vector<WindowSpeeds> speeds = window_speeds(fitter, fit);
  Length length;
  double fastest = 1e-6;
  for (std::size_t i = 0; i < windows.trials.size(); ++i) {
    if (windows.horizon[i] != horizon) continue;
    const Trial& trial = windows.trials[i];
    length.windows.push_back(i);
    length.residuals.push_back(raw[i]);
    length.data.ends.push_back(expected_end(trial, raw[i]));
    length.data.whiteners.push_back(fitter.whitener(fit, i));
    length.data.fold.push_back(static_cast<std::size_t>(folds[windows.block[i]]));
    fastest = std::max({fastest, std::abs(speeds[i].left_m_s), std::abs(speeds[i].right_m_s)});
  }
  for (std::size_t k = 0; k < length.windows.size(); ++k) {
    const std::size_t i = length.windows[k];
    const Trial& trial = windows.trials[i];
    LoggedMotion facts;
    facts.command = kWindowCommand;
    facts.X_WS = trial.X_WS;
    facts.left = speeds[i].left_m_s / fastest;
    facts.right = speeds[i].right_m_s / fastest;
    facts.duration_s = *trial.duration_s;
    facts.session_time_s = *trial.t_s;
    facts.moved = k == 0 || windows.run_of[length.windows[k - 1]] != windows.run_of[i];
    if (!facts.moved) {
      const WindowSpeeds& last = speeds[length.windows[k - 1]];
      facts.last_left = sign(last.left_m_s);
      facts.last_right = sign(last.right_m_s);
    }
    length.data.facts.push_back(facts);
  }
  const std::size_t every = 1 + length.windows.size() / kMostLessons;
  length.data.learn =
      mapped(indices(length.windows.size()), [&](std::size_t k) { return k % every == 0; });
  length.data.free_commands = true;
  return length;
}

// What the covariates of a correction are to a robot that drives; one that is not here is nothing.
struct Label {
  std::string_view covariate;
  const char* thing;
  const char* spoken;  // as pictures have it
};
constexpr Label kLabels[] = {
    {"left", "speeds", "left side's speed"},
    {"right", "speeds", "right side's speed"},
    {"time", "time", "time"},
    {"heading", "heading", "start heading"},
    {"x", "place", "start x"},
    {"y", "place", "start y"},
    {"left_reversed", "changes of direction", "left side's speed"},
    {"right_reversed", "changes of direction", "right side's speed"},
    {"moved", "changes of direction", "time"},
};

}  // namespace

Pose expected_end(const Trial& trial, const Eigen::Vector3d& residual) {
  return trial.X_WE * inverse(Pose{residual[0], residual[1], residual[2]});
}

std::vector<WindowSpeeds> window_speeds(const WindowFitter& fitter, const WindowFit& fit) {
  const double arm_m =
      fitter.robot().controller.wheel_separation_m.value_or(kUsualSeparation_m) / 2;
  const std::vector<Eigen::Vector3d> raw = fitter.raw_residuals(fit);
  return mapped(indices(raw.size()), [&](std::size_t i) -> WindowSpeeds {
    const Trial& trial = fitter.windows().trials[i];
    const Pose way = between(trial.X_WS, expected_end(trial, raw[i]));
    const double half = way.theta / 2;
    const double chord = std::cos(half) * way.x + std::sin(half) * way.y;
    const double arc = std::abs(half) < 1e-6 ? chord : chord * half / std::sin(half);
    const double ahead = arc / *trial.duration_s, turn = way.theta / *trial.duration_s;
    return {ahead, turn, ahead - arm_m * turn, ahead + arm_m * turn};
  });
}

std::optional<FreeResidual> fit_free_residual(const WindowFitter& fitter,
                                              const WindowFit& held_out) {
  std::vector<Eigen::Vector3d> left = fitter.raw_residuals(held_out);
  FreeResidual free;
  std::set<std::string> things;
  for (int h = 0; h < fitter.windows().lengths; ++h) {
    const Length length = windows_of_length(fitter, held_out, h);
    const ResidualFit fit =
        fit_residual(length.data, length.residuals, [&](std::size_t) { return length.residuals; });
    for (const ResidualTerm& term : fit.field) {
      for (const std::size_t c : term.covariates) {
        const Label* label = find_by(kLabels, residual_covariates()[c].name, &Label::covariate);
        if (label == nullptr) continue;
        things.insert(label->thing);
        if (free.covariate.empty()) free.covariate = label->spoken;
      }
    }
    for (std::size_t k = 0; k < length.windows.size(); ++k) {
      left[length.windows[k]] -= fit.unseen[k];
    }
  }
  if (things.empty()) return {};
  free.depends_on = joined(things);
  free.of_world = things.contains("place") || things.contains("heading");
  free.held_out = judge_held_out(fitter, held_out, left);
  return free;
}

}  // namespace gapfarm
