#include "common/trials/context.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <string>

#include "common/trials/pose_readings.h"

namespace gapfarm {
namespace {

constexpr MoveTolerance kLeast{0.02, 0.1};
constexpr MoveTolerance kGreatest{0.05, 0.35};
constexpr double kScales = 5;
constexpr double kStepsApart = 1.5;  // the square root of 2, and a margin

MoveTolerance gap(const Trial& before, const Trial& after) {
  const Pose& E = before.X_WE;
  const Pose& S = after.X_WS;
  return {std::hypot(S.x - E.x, S.y - E.y), std::abs(wrap_angle(S.theta - E.theta))};
}

// The trial before each trial in its session.
std::vector<std::optional<std::size_t>> predecessors(const TrialLog& log) {
  std::vector<std::optional<std::size_t>> before(log.trials.size());
  std::map<std::string, std::size_t> last;
  for (std::size_t i = 0; i < log.trials.size(); ++i) {
    const auto [at, first] = last.emplace(log.trials[i].session, i);
    if (first) continue;
    before[i] = at->second;
    at->second = i;
  }
  return before;
}

double quantile(std::vector<double>& values, double share) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// The two quantiles of a law with scale 1.
struct Law {
  double lower_quartile;
  double median;
};
constexpr Law kRayleigh{0.7585, 1.1774};
constexpr Law kFoldedNormal{0.3186, 0.6745};

double tolerance(std::vector<double> gaps, const Law& law, double least, double greatest) {
  if (gaps.empty()) return greatest;
  double limit = std::clamp(kScales * quantile(gaps, 0.25) / law.lower_quartile, least, greatest);
  for (int round = 0; round < 10; ++round) {
    std::vector<double> within;
    std::copy_if(gaps.begin(), gaps.end(), std::back_inserter(within),
                 [&](double value) { return value <= limit; });
    if (within.empty()) break;
    const double refined =
        std::clamp(kScales * quantile(within, 0.5) / law.median, least, greatest);
    if (refined == limit) break;
    limit = refined;
  }
  return limit;
}

int sign(double duty) { return duty > 0 ? 1 : duty < 0 ? -1 : 0; }

}  // namespace

MoveTolerance estimate_move_tolerance(const TrialLog& log) {
  // Rounded twice, one resting pose may lie a step apart along either axis.
  const PoseGrid grid = pose_grid(log.trials);
  const auto before = predecessors(log);
  std::vector<double> distances, headings;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (!before[i]) continue;
    const MoveTolerance found = gap(log.trials[*before[i]], log.trials[i]);
    distances.push_back(found.distance_m);
    headings.push_back(found.heading_rad);
  }
  const double apart_m =
      tolerance(std::move(distances), kRayleigh, kLeast.distance_m, kGreatest.distance_m);
  const double apart_rad =
      tolerance(std::move(headings), kFoldedNormal, kLeast.heading_rad, kGreatest.heading_rad);
  return {std::max(kStepsApart * grid.step_m, apart_m),
          std::max(kStepsApart * grid.heading_step_rad, apart_rad)};
}

std::vector<TrialContext> trial_contexts(const TrialLog& log,
                                         std::span<const DrivenCommand> commands,
                                         const std::optional<MoveTolerance>& known) {
  assert(commands.size() == log.trials.size());
  const MoveTolerance limit = known ? *known : estimate_move_tolerance(log);
  const auto before = predecessors(log);
  std::vector<TrialContext> contexts(log.trials.size());
  for (std::size_t i = 0; i < contexts.size(); ++i) {
    TrialContext& context = contexts[i];
    context.previous = before[i];
    context.session_time_s = log.trials[i].t_s.value_or(0);
    if (!before[i]) continue;
    const TrialContext& last = contexts[*before[i]];
    const DrivenCommand& driven = commands[*before[i]];
    if (!log.trials[i].t_s) {
      context.session_time_s = last.session_time_s + driven.duration_s + kAssumedPause_s;
    }
    const int left = sign(driven.left);
    const int right = sign(driven.right);
    context.last_left = left != 0 ? left : last.last_left;
    context.last_right = right != 0 ? right : last.last_right;
    const MoveTolerance found = gap(log.trials[*before[i]], log.trials[i]);
    context.moved = found.distance_m > limit.distance_m || found.heading_rad > limit.heading_rad;
    context.place_in_run = context.moved ? 0 : last.place_in_run + 1;
  }
  return contexts;
}

}  // namespace gapfarm
