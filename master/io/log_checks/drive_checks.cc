#include "master/io/log_checks/drive_checks.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "common/base/constants.h"
#include "common/math/statistics.h"
#include "master/io/log_checks/axes.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {
namespace {

constexpr double kStill = 0.1;  // of what the slowest robot would do
constexpr double kStillTurn_rad = 0.02;
constexpr double kTolerance = 1.1;   // of the bounds
constexpr double kUnslipped = 1.05;  // of the fastest turn

double concentration(const std::vector<DriveSample>& samples, double factor) {
  std::complex<double> sum = 0;
  for (const DriveSample& s : samples) {
    const double travel = s.travel_rad() + (s.forward_s < 0 ? std::numbers::pi : 0);
    sum += std::polar(1.0, travel - factor * s.mid_heading_rad());
  }
  return std::abs(sum) / static_cast<double>(samples.size());
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
  if (unit != nullptr && far) {
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

bool check_heading_unit(const std::vector<DriveSample>& samples,
                        std::vector<SanityFinding>* findings) {
  constexpr double kSmall_rad = 0.1;
  constexpr double kGood = 0.75, kBad = 0.6;
  std::vector<DriveSample> straight = straight_samples(samples);
  if (straight.size() < kFewestStraight) return false;
  std::vector<double> sizes;
  for (const DriveSample& s : straight) sizes.push_back(std::abs(s.X_WS.theta));
  if (quantile(sizes, 0.95) > kSmall_rad) return false;
  const double as_logged = concentration(straight, 1);
  const double scaled = concentration(straight, 1 / kDegree);
  if (as_logged > kBad || scaled < kGood) return false;
  findings->push_back(
      {"unit_error",
       "Headings stay within " + few_digits(quantile(sizes, 0.95)) +
           " rad while the drives go all ways; times 180/pi they follow the drives "
           "(concentration " +
           few_digits(scaled) + ", as logged " + few_digits(as_logged) + ").",
       "Multiply theta0 and theta1 by 180/pi: they were turned into radians twice."});
  return true;
}

void check_turning(const std::vector<DriveSample>& samples, const DriveLimits& limits,
                   std::vector<SanityFinding>* findings) {
  const double speed = full_speed_of(samples);
  if (straight_samples(samples).size() < kFewestStraight || limits.gauge_m <= 0) return;
  // Slow turns, so that none has gone round.
  std::vector<double> rates;
  for (const DriveSample& s : samples) {
    if (std::abs(s.turn_s) > 1e-9 && std::abs(s.turn_s) * speed / limits.gauge_m < 2) {
      rates.push_back(s.turned_rad() / s.turn_s);
    }
  }
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
       "the "
       "distance between the sides (track_gauge). Another kind of robot needs another scenario."});
}

}  // namespace gapfarm
