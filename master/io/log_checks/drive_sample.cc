#include "master/io/log_checks/drive_sample.h"

#include <algorithm>
#include <cmath>

#include "common/math/statistics.h"
#include "common/score/motion_model.h"

namespace gapfarm {
namespace {

constexpr double kStraight = 0.2;  // turn over way, of what counts as straight
constexpr double kGentle = 0.9;    // and of arcs that end before they have turned round

std::vector<DriveSample> with_turns_below(const std::vector<DriveSample>& samples, double most) {
  std::vector<DriveSample> kept;
  for (const DriveSample& s : samples) {
    if (s.forward_s != 0 && std::abs(s.turn_s) <= most * std::abs(s.forward_s)) kept.push_back(s);
  }
  return kept;
}

}  // namespace

double DriveSample::distance_m() const { return std::hypot(X_WE.x - X_WS.x, X_WE.y - X_WS.y); }

double DriveSample::turned_rad() const { return wrap_angle(X_WE.theta - X_WS.theta); }

double DriveSample::mid_heading_rad() const { return X_WS.theta + turned_rad() / 2; }

double DriveSample::travel_rad() const { return std::atan2(X_WE.y - X_WS.y, X_WE.x - X_WS.x); }

std::vector<DriveSample> drive_samples(const Problem& problem) {
  std::vector<DriveSample> samples;
  for (std::size_t i = 0; i < problem.log.trials.size(); ++i) {
    const Trial& trial = problem.log.trials[i];
    const CommandSpec c = resolved_command(trial, problem.commands);
    DriveSample s;
    s.trial = i;
    s.forward_s = (c.left + c.right) / 2 * c.duration_s;
    s.turn_s = (c.right - c.left) * c.duration_s;
    s.most_s = std::max(std::abs(c.left), std::abs(c.right)) * c.duration_s;
    s.X_WS = trial.X_WS;
    s.X_WE = trial.X_WE;
    samples.push_back(s);
  }
  return samples;
}

std::vector<DriveSample> straight_samples(const std::vector<DriveSample>& samples) {
  std::vector<DriveSample> straight = with_turns_below(samples, kStraight);
  return straight.size() >= kFewestStraight ? straight : with_turns_below(samples, kGentle);
}

double full_speed_of(const std::vector<DriveSample>& samples) {
  std::vector<double> speeds;
  for (const DriveSample& s : straight_samples(samples)) {
    speeds.push_back(s.distance_m() / std::abs(s.forward_s));
  }
  return speeds.empty() ? 0 : median(speeds);
}

}  // namespace gapfarm
