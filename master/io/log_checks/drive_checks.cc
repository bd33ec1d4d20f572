#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "common/base/constants.h"
#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/math/statistics.h"
#include "common/score/motion_model.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {
namespace {

constexpr double kStill = 0.1;  // of what the slowest robot would do
constexpr double kStillTurn_rad = 0.02;
constexpr double kTolerance = 1.1;   // of the bounds
constexpr double kUnslipped = 1.05;  // of the fastest turn

constexpr double kStraight = 0.2;  // turn over way, of what counts as straight
constexpr double kGentle = 0.9;    // and of arcs that end before they have turned round

std::vector<DriveSample> with_turns_below(const std::vector<DriveSample>& samples, double most) {
  return filtered(samples, [&](const DriveSample& s) {
    return s.forward_s != 0 && std::abs(s.turn_s) <= most * std::abs(s.forward_s);
  });
}

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kFewestTurns = 8;
constexpr double kGoodConcentration = 0.75;
constexpr double kClearMargin = 0.4;
// Half a log of noise leaves 0.5; by chance one in six logs of so few drives has as much as this.
constexpr double kUnrelated = 0.3;
constexpr std::size_t kManyStraight = 20;
constexpr double kLeastShare = 0.3;  // of the typical distance: shorter ones have no direction
// Catalogued as heading_offset up to here; beyond, an axis is another one.
constexpr double kMostOffset_rad = 0.5;
constexpr double kNearAxis_rad = 0.4;

std::string degrees(double angle_rad) { return formatted("%.0f degrees", angle_rad * 180 / kPi); }

std::string share(double value) { return formatted("%.2f", value); }

bool near(double angle_rad, double axis_rad) {
  return std::abs(wrap_angle(angle_rad - axis_rad)) < kNearAxis_rad;
}

// Mean cosine of how far the turns are from `rate` times the command.
double agreement(const std::vector<DriveSample>& turns, double rate) {
  return mean(mapped(
      turns, [&](const DriveSample& s) { return std::cos(s.turned_rad() - rate * s.turn_s); }));
}

struct Rate {
  double rate = 0;
  double agreement = -1;
};

// The best rate of one sign, in rad a second at full duty on one side more than on the other.
Rate best_rate(const std::vector<DriveSample>& turns, double sign) {
  const auto sizes = mapped(turns, [](const DriveSample& s) { return std::abs(s.turn_s); });
  const double largest = *std::ranges::max_element(sizes);
  const double fastest = 2 * kPi / median(sizes);
  const double step = 0.05 / largest;
  Rate best;
  for (double rate = step; rate < fastest; rate += step) {
    const double value = agreement(turns, sign * rate);
    if (value > best.agreement) best = {rate, value};
  }
  return best;
}

// Which way headings change when the right side is commanded to run faster: +1 counter-clockwise,
// as it should be, -1 clockwise; 0 where the log does not say, so also where turns by 200 degrees
// one way cannot be distinguished from 160 the other.
int sense_of_turns(const std::vector<DriveSample>& samples) {
  const auto turns =
      filtered(samples, [](const DriveSample& s) { return std::abs(s.turn_s) > 1e-9; });
  if (turns.size() < kFewestTurns) return 0;
  const Rate ccw = best_rate(turns, 1), cw = best_rate(turns, -1);
  // It must explain most of what no turning at all leaves; where turns are small that is little.
  const double still = agreement(turns, 0);
  const auto explains = [still](const Rate& rate) {
    return rate.agreement >= kGoodConcentration && 1 - rate.agreement < 0.5 * (1 - still);
  };
  const bool left = explains(ccw), right = explains(cw);
  if (!left || !right) return left ? 1 : right ? -1 : 0;
  if (std::abs(ccw.agreement - cw.agreement) > 0.15) return ccw.agreement > cw.agreement ? 1 : -1;
  // A turn of one angle, or of that less a full one the other way: the shorter is meant where it is
  // much the shorter.
  if (ccw.rate < 0.6 * cw.rate) return 1;
  return cw.rate < 0.6 * ccw.rate ? -1 : 0;
}

// Mean direction of travel less `factor` times the heading; its length is their concentration.
std::complex<double> mean_travel(const std::vector<DriveSample>& samples, double factor) {
  std::complex<double> sum = 0;
  for (const DriveSample& s : samples) {
    const double travel = s.travel_rad() + (s.forward_s < 0 ? kPi : 0);
    sum += std::polar(1.0, travel - factor * s.mid_heading_rad());
  }
  return sum / static_cast<double>(samples.size());
}

// How the direction of travel follows the heading, over drives that go straight: travel = heading +
// offset where positions and headings have the same sense, travel = -heading + offset where one of
// them is mirrored.
struct TravelFit {
  double same = 0;      // concentration in [0, 1] of travel - heading
  double mirrored = 0;  // of travel + heading
  double offset_rad = 0;
  std::size_t drives = 0;

  bool is_clear() const {  // one of them is clearly the better one, and good
    return drives >= kFewestStraight && std::max(same, mirrored) > kGoodConcentration &&
           std::abs(same - mirrored) > kClearMargin;
  }
};

TravelFit fit_travel(const std::vector<DriveSample>& samples) {
  std::vector<DriveSample> straight = straight_samples(samples);
  if (straight.size() < kFewestStraight) return {};
  const double typical = median(mapped(straight, &DriveSample::distance_m));
  std::erase_if(straight,
                [&](const DriveSample& s) { return !(s.distance_m() > kLeastShare * typical); });
  if (straight.empty()) return {};
  const auto same = mean_travel(straight, 1), mirrored = mean_travel(straight, -1);
  const bool follows = std::abs(same) >= std::abs(mirrored);
  return {std::abs(same), std::abs(mirrored), std::arg(follows ? same : mirrored), straight.size()};
}

std::string evidence(const TravelFit& travel, int sense) {
  std::string text;
  if (travel.is_clear()) {
    const bool mirrored = travel.mirrored > travel.same;
    text = "Over " + std::to_string(travel.drives) +
           " straight drives the direction of travel follows the " +
           (mirrored ? "negative of the heading" : "heading") + " (concentration " +
           share(mirrored ? travel.mirrored : travel.same) + ", against " +
           share(mirrored ? travel.same : travel.mirrored) + " the other way)";
    if (std::abs(travel.offset_rad) > kNearAxis_rad) {
      text += ", turned by " + degrees(travel.offset_rad);
    }
  }
  if (sense != 0) {
    text += text.empty() ? "With" : ", and with";
    text += " the right side faster the heading ";
    text += sense > 0 ? "grows, as it should" : "falls, where it should grow";
  }
  return text + ".";
}

SanityFinding mirrored_finding(const TravelFit& travel, int sense, const std::string& seen) {
  if (sense < 0) {
    return {"heading_flipped", seen + " So headings are counted clockwise.",
            near(travel.offset_rad, 0)
                ? "Change the sign of theta0 and theta1, or find out who counts them clockwise."
                : "Replace theta0 and theta1 by " + degrees(travel.offset_rad) +
                      " less the logged heading: they look like compass headings."};
  }
  if (sense == 0) {
    return {"heading_flipped",
            seen +
                " So either headings are counted clockwise or one axis is mirrored; without turns "
                "the log does not say which.",
            "Change the sign of theta0 and theta1, or of y0 and y1."};
  }
  if (near(travel.offset_rad, kPi / 2) || near(travel.offset_rad, -kPi / 2)) {
    const bool negated = travel.offset_rad < 0;
    return {"axes_swapped", seen + " So x and y are swapped" + (negated ? " and negated." : "."),
            negated ? "Exchange x and y and change both signs." : "Exchange x0 and y0, x1 and y1."};
  }
  if (near(travel.offset_rad, kPi)) {
    return {"axis_mirrored", seen + " So positions are mirrored: x has the wrong sign.",
            "Change the sign of x0 and x1."};
  }
  return {"axis_mirrored", seen + " So positions are mirrored: y has the wrong sign.",
          "Change the sign of y0 and y1."};
}

std::optional<SanityFinding> turned_finding(const TravelFit& travel, int sense,
                                            const std::string& seen) {
  if (std::abs(travel.offset_rad) <= kMostOffset_rad) {
    if (sense >= 0) return std::nullopt;
    return SanityFinding{
        "sides_swapped",
        seen + " So left and right are exchanged; or else y and the headings are both mirrored.",
        "Exchange left and right (or the wheels' names), or change the signs of y and theta."};
  }
  if (near(travel.offset_rad, kPi)) {
    if (sense < 0) {
      return SanityFinding{"direction_reversed", seen + " So the motors run backward.",
                           "Change the signs of left and right."};
    }
    return SanityFinding{
        "heading_turned", seen + " So the robot's front is taken for its back.",
        "Add pi to theta0 and theta1, or exchange left and right and change their signs."};
  }
  return SanityFinding{"heading_turned",
                       seen + " So headings are counted from another axis than x.",
                       "Add " + degrees(travel.offset_rad) +
                           " to theta0 and theta1, or turn x and y back by as much."};
}

std::optional<SanityFinding> finding_of(const TravelFit& travel, int sense) {
  const std::string seen = evidence(travel, sense);
  if (travel.is_clear()) {
    if (travel.mirrored > travel.same) return mirrored_finding(travel, sense, seen);
    return turned_finding(travel, sense, seen);
  }
  if (sense >= 0) return std::nullopt;
  return SanityFinding{"sides_swapped",
                       seen +
                           " So left and right are exchanged, or headings count clockwise; without "
                           "straight drives the log does not say which.",
                       "Exchange left and right, or change the sign of theta."};
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
  const std::vector<double> sizes =
      mapped(straight, [](const DriveSample& s) { return std::abs(s.X_WS.theta); });
  if (quantile(sizes, 0.95) > kSmall_rad) return false;
  const double as_logged = std::abs(mean_travel(straight, 1));
  const double scaled = std::abs(mean_travel(straight, 1 / kDegree));
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

bool check_related(const std::vector<DriveSample>& samples, std::vector<SanityFinding>* findings) {
  const TravelFit travel = fit_travel(samples);
  if (travel.drives < kManyStraight || std::max(travel.same, travel.mirrored) > kUnrelated) {
    return false;
  }
  findings->push_back({"commands_unrelated",
                       "Over " + std::to_string(travel.drives) +
                           " straight drives the direction of travel follows neither the heading "
                           "(concentration " +
                           share(travel.same) + ") nor its negative (" + share(travel.mirrored) +
                           ").",
                       "Look whether each row has the command that was driven between its poses, "
                       "and the headings are the robot's."});
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
  const auto speeds = mapped(straight_samples(samples), [](const DriveSample& s) {
    return s.distance_m() / std::abs(s.forward_s);
  });
  return speeds.empty() ? 0 : median(speeds);
}

std::optional<SanityFinding> check_axes(const std::vector<DriveSample>& samples) {
  auto finding = finding_of(fit_travel(samples), sense_of_turns(samples));
  if (!finding) return finding;
  finding->names_an_effect = true;
  if (finding->name == "axis_mirrored") finding->or_else = {"axes_swapped"};
  if (finding->name == "direction_reversed") finding->or_else = {"sides_swapped"};
  return finding;
}

}  // namespace gapfarm
