// How fast and how far drives go: nothing moved, another unit, a robot that cannot be.
#include <cmath>

#include "common/base/ranges.h"
#include "common/math/statistics.h"
#include "common/score/motion_model.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {
namespace {

constexpr double kStill = 0.1;  // of what the slowest robot would do
constexpr double kStillTurn_rad = 0.02;
constexpr double kTolerance = 1.1;   // of the bounds
constexpr double kUnslipped = 1.05;  // of the fastest turn
constexpr double kGentle = 0.9;      // turn over way of arcs that end before they have turned round

// How fast drives turn, in rad a second of a difference of one full duty; beyond half a turn more.
double least_turn_rate(const std::vector<DriveSample>& samples) {
  const auto turns =
      filtered(samples, [](const DriveSample& s) { return s.turn_share() > kStraightShare; });
  if (turns.size() < kFewestTurns) return 0;
  return median(mapped(
      turns, [](const DriveSample& s) { return std::abs(s.turned_rad()) / std::abs(s.turn_s); }));
}

}  // namespace

bool check_motion(const std::vector<DriveSample>& samples, const DriveLimits& limits,
                  std::vector<SanityFinding>* findings) {
  std::vector<double> driven_lengths, turns;
  for (const DriveSample& s : samples) {
    if (s.most_s <= 0) continue;
    driven_lengths.push_back(s.distance_m() / s.most_s);
    turns.push_back(std::abs(s.turned_rad()));
  }
  if (driven_lengths.empty()) {
    findings->push_back({"no_motion", "Every command has duty 0 or lasts 0 s: nothing was driven.",
                         "Log drives; what noise standing still has is in the gaps between them."});
    return true;
  }
  const double driven = median(driven_lengths), turned = median(turns);
  if (driven > kStill * limits.slowest_m_s || turned > kStillTurn_rad) return false;
  findings->push_back({"no_motion",
                       "The robot does not move: half of the " +
                           std::to_string(driven_lengths.size()) + " commands end within " +
                           few_digits(1000 * driven) + " mm a second of full duty and " +
                           few_digits(1000 * turned) + " mrad of where they began.",
                       "Look whether the motors were on and the poses are the robot's."});
  return true;
}

bool check_speed(const std::vector<DriveSample>& samples, const DriveLimits& limits,
                 std::vector<SanityFinding>* findings) {
  const double speed = full_speed_of(samples);
  if (straight_samples(samples).size() < kFewestStraight || speed <= 0) return false;
  if (speed < kTolerance * limits.fastest_m_s && speed > limits.slowest_m_s / kTolerance) {
    return false;
  }
  const std::string seen = "Drives cover " + few_digits(speed) +
                           " m a second of full duty; the robots that can be simulated reach " +
                           few_digits(limits.slowest_m_s) + " to " +
                           few_digits(limits.fastest_m_s) + " m/s.";
  const LengthUnit* unit =
      likely_unit(speed, limits.slowest_m_s, limits.fastest_m_s, limits.expected_m_s);
  // A robot a little beyond the bounds is likelier than feet.
  const bool far = speed > 2.5 * limits.fastest_m_s || speed < limits.slowest_m_s / 2.5;
  const double rate = least_turn_rate(samples);
  const double most = kOtherGauge * limits.fastest_m_s / limits.gauge_m;
  if (limits.gauge_m > 0 && speed > limits.fastest_m_s && rate > most) {
    findings->push_back({"robot_out_of_bounds",
                         seen + " And they turn by " + few_digits(rate) +
                             " rad a second of a difference of one full duty between the sides, of "
                             "which no more than " +
                             few_digits(most) + " can be, in whichever unit lengths are.",
                         "Durations or duties are too small: write s, and duties of -1 to 1."});
  } else if (unit != nullptr && far) {
    findings->push_back({"unit_error",
                         seen + " These look like " + unit->name + ": " +
                             few_digits(speed * unit->metres) + " m/s.",
                         "Multiply x0, y0, x1 and y1 by " + few_digits(unit->metres) + "."});
  } else {
    findings->push_back({"robot_out_of_bounds", seen,
                         "Check duties and durations: empty ones are the config's. A robot of "
                         "another size needs a file of its own, [robot] file = \"robot.toml\"."});
  }
  return true;
}

void check_turning(const std::vector<DriveSample>& samples, const DriveLimits& limits,
                   std::vector<SanityFinding>* findings) {
  const double speed = full_speed_of(samples);
  if (straight_samples(samples).size() < kFewestStraight || limits.gauge_m <= 0) return;
  // Slow turns, so that none has gone round.
  const auto turns_slowly = [&](const DriveSample& s) {
    return std::abs(s.turn_s) > 1e-9 && std::abs(s.turn_s) * speed / limits.gauge_m < 2;
  };
  const auto rates = filtered(samples, turns_slowly,
                              [](const DriveSample& s) { return s.turned_rad() / s.turn_s; });
  if (rates.size() < kFewestStraight) return;
  const double rate = median(rates), fastest = speed / limits.gauge_m;
  if (rate < kUnslipped * fastest) return;
  findings->push_back(
      {"robot_out_of_bounds",
       "Turns reach " + few_digits(rate) +
           " rad a second for a difference of one full duty between the sides; at the " +
           few_digits(speed) + " m/s of its straight drives and " +
           few_digits(1000 * limits.gauge_m) + " mm between the sides no more than " +
           few_digits(fastest) + " can be, without any slip.",
       "Check duties and durations, which are the config's where the log leaves them empty, and "
       "the distance between the sides (track_gauge). Another kind of robot needs another "
       "scenario."});
}

double DriveSample::distance_m() const { return std::hypot(X_WE.x - X_WS.x, X_WE.y - X_WS.y); }

double DriveSample::turn_share() const { return std::abs(turn_s) / std::abs(forward_s); }

double DriveSample::turned_rad() const { return wrap_angle(X_WE.theta - X_WS.theta); }

double DriveSample::mid_heading_rad() const { return X_WS.theta + turned_rad() / 2; }

double DriveSample::travel_rad() const { return std::atan2(X_WE.y - X_WS.y, X_WE.x - X_WS.x); }

std::vector<DriveSample> drive_samples(const Problem& problem) {
  std::vector<DriveSample> samples;
  for (std::size_t i = 0; i < problem.log.trials.size(); ++i) {
    const Trial& trial = problem.log.trials[i];
    const CommandSpec c = resolved_command(trial, problem.commands);
    const double most = std::max(std::abs(c.left), std::abs(c.right));
    samples.push_back({i, (c.left + c.right) / 2 * c.duration_s, (c.right - c.left) * c.duration_s,
                       most * c.duration_s, trial.X_WS, trial.X_WE});
  }
  return samples;
}

std::vector<DriveSample> straight_samples(const std::vector<DriveSample>& samples) {
  const auto within = [&](double most) {
    return filtered(samples, [most](const DriveSample& s) { return s.turn_share() <= most; });
  };
  std::vector<DriveSample> straight = within(kStraightShare);
  return straight.size() >= kFewestStraight ? straight : within(kGentle);
}

double full_speed_of(const std::vector<DriveSample>& samples) {
  const auto speeds = mapped(straight_samples(samples), [](const DriveSample& s) {
    return s.distance_m() / std::abs(s.forward_s);
  });
  return speeds.empty() ? 0 : median(speeds);
}

}  // namespace gapfarm
