#include "master/ground/free_residual.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "master/diagnose/correction/fit.h"
#include "master/ground/fit/held_out.h"

namespace gapfarm {
namespace {

// Windows of a length that a correction is learned from: of more, evenly spread ones.  40 bumps of
// three values are as well known from these as from all.
constexpr std::size_t kMostLessons = 600;

struct Speeds {
  double left = 0, right = 0;  // of the sides on the way to an end, m/s
};

// Of the arc from a window's start to where its end is expected.
Speeds side_speeds(const Pose& way, double duration_s, double arm_m) {
  const double half = way.theta / 2;
  const double ahead = (std::cos(half) * way.x + std::sin(half) * way.y) *
                       (std::abs(half) < 1e-6 ? 1 : half / std::sin(half));
  return {(ahead - arm_m * way.theta) / duration_s, (ahead + arm_m * way.theta) / duration_s};
}

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
  const double arm_m = fitter.robot().controller.wheel_separation_m.value_or(0.3) / 2;
  Length length;
  std::vector<Speeds> speeds;
  double fastest = 1e-6;
  for (std::size_t i = 0; i < windows.trials.size(); ++i) {
    if (windows.horizon[i] != horizon) continue;
    const Trial& trial = windows.trials[i];
    const Eigen::Vector3d& r = raw[i];
    length.windows.push_back(i);
    length.residuals.push_back(r);
    length.data.ends.push_back(trial.X_WE * inverse(Pose{r[0], r[1], r[2]}));
    length.data.whiteners.push_back(fitter.whitener(fit, i));
    length.data.fold.push_back(static_cast<std::size_t>(folds[windows.block[i]]));
    speeds.push_back(
        side_speeds(between(trial.X_WS, length.data.ends.back()), *trial.duration_s, arm_m));
    fastest = std::max({fastest, std::abs(speeds.back().left), std::abs(speeds.back().right)});
  }
  for (std::size_t k = 0; k < length.windows.size(); ++k) {
    const std::size_t i = length.windows[k];
    const Trial& trial = windows.trials[i];
    LoggedMotion facts{kWindowCommand,           trial.X_WS,
                       speeds[k].left / fastest, speeds[k].right / fastest,
                       *trial.duration_s,        *trial.t_s};
    facts.moved = k == 0 || windows.run_of[length.windows[k - 1]] != windows.run_of[i];
    if (!facts.moved) {
      facts.last_left = sign(speeds[k - 1].left);
      facts.last_right = sign(speeds[k - 1].right);
    }
    length.data.facts.push_back(facts);
  }
  const std::size_t every = 1 + length.windows.size() / kMostLessons;
  for (std::size_t k = 0; k < length.windows.size(); ++k) {
    length.data.learn.push_back(k % every == 0);
  }
  length.data.free_commands = true;
  return length;
}

// What the covariates of a correction are to a robot that drives.
const char* thing_of(const std::string& covariate) {
  if (covariate == "x" || covariate == "y") return "place";
  if (covariate == "heading") return "heading";
  if (covariate == "time") return "time";
  if (covariate.ends_with("_reversed") || covariate == "moved") return "changes of direction";
  return "speeds";
}

}  // namespace

std::optional<FreeResidual> fit_free_residual(const WindowFitter& fitter,
                                              const WindowFit& held_out) {
  std::vector<Eigen::Vector3d> left = fitter.raw_residuals(held_out);
  std::set<std::string> things;
  for (int h = 0; h < fitter.windows().lengths; ++h) {
    const Length length = windows_of_length(fitter, held_out, h);
    const ResidualFit fit =
        fit_residual(length.data, length.residuals, [&](std::size_t) { return length.residuals; });
    for (const ResidualTerm& term : fit.field) {
      for (const std::size_t c : term.covariates) {
        things.insert(thing_of(residual_covariates()[c].name));
      }
    }
    for (std::size_t k = 0; k < length.windows.size(); ++k) {
      left[length.windows[k]] -= fit.unseen[k];
    }
  }
  if (things.empty()) return {};
  return FreeResidual{judge_held_out(fitter, held_out, left), joined(things),
                      things.contains("place") || things.contains("heading")};
}

}  // namespace gapfarm
