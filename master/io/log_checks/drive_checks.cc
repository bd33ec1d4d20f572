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

constexpr double kPi = std::numbers::pi;
constexpr double kGoodConcentration = 0.75;
constexpr double kClearMargin = 0.4;
// Half a log of noise leaves 0.5; by chance one in six logs of so few drives has as much as this.
constexpr double kUnrelated = 0.3;
constexpr double kAsGood = 0.15;    // of two agreements
constexpr double kArc = 2;          // turn over way: beyond, what slips outweighs it
constexpr double kSameChord = 0.2;  // of an arc's way, beyond the nearest
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

// By which share of their way arcs end nearer to or farther from their start than ones of turns at
// `rate` would: the median.
double chord_misfit(const std::vector<DriveSample>& arcs, double rate, double speed_m_s) {
  return median(mapped(arcs, [&](const DriveSample& s) {
    const double half = rate * s.turn_s / 2, way_m = speed_m_s * std::abs(s.forward_s);
    return std::abs(s.distance_m() / way_m - std::abs(std::sin(half) / half));
  }));
}

// Which way headings change when the right side is commanded to run faster: +1 counter-clockwise,
// as it should be, -1 clockwise; 0 where the log does not say: turns by 200 degrees one way end as
// those by 160 the other do, unless the robot cannot turn so fast or arcs would end elsewhere.
int sense_of_turns(const std::vector<DriveSample>& samples, const DriveLimits& limits) {
  const auto turns =
      filtered(samples, [](const DriveSample& s) { return std::abs(s.turn_s) > 1e-9; });
  if (turns.size() < kFewestTurns) return 0;
  const auto sizes = mapped(turns, [](const DriveSample& s) { return std::abs(s.turn_s); });
  const auto straight =
      filtered(samples, [](const DriveSample& s) { return s.turn_share() <= kStraightShare; });
  const bool has_speed = straight.size() >= kFewestStraight;
  const double speed_m_s = has_speed ? full_speed_of(straight) : limits.fastest_m_s;
  const auto arcs = filtered(samples, [](const DriveSample& s) {
    return s.turn_share() > kStraightShare && s.turn_share() < kArc;
  });
  // Where nobody states the gauge, half of the turns are taken for less than a full one.
  const double fastest =
      limits.gauge_m > 0 ? kOtherGauge * speed_m_s / limits.gauge_m : 2 * kPi / median(sizes);
  const double step = 0.05 / *std::ranges::max_element(sizes);
  // It must explain most of what no turning at all leaves; where turns are small that is little.
  const double least = std::max(kGoodConcentration, 0.5 + 0.5 * agreement(turns, 0));
  struct Reading {
    double sign, agreement, chord;
  };
  std::vector<Reading> readings;
  for (double rate = step; rate < fastest; rate += step) {  // rad a second of duty
    for (const double sign : {1.0, -1.0}) {
      const auto value_at = [&](double r) { return agreement(turns, sign * r); };
      const double value = value_at(rate);
      if (value < least || value < value_at(rate - step) || value < value_at(rate + step)) continue;
      const bool curves = has_speed && arcs.size() >= kFewestTurns;
      readings.push_back({sign, value, curves ? chord_misfit(arcs, rate, speed_m_s) : 0});
    }
  }
  if (readings.empty()) return 0;
  const double nearest = std::ranges::min(readings, {}, &Reading::chord).chord;
  double left = -1, right = -1;
  for (const Reading& r : readings) {
    double& most = r.sign > 0 ? left : right;
    if (r.chord <= nearest + kSameChord) most = std::max(most, r.agreement);
  }
  if (std::abs(left - right) <= kAsGood) return 0;
  return left > right ? 1 : -1;
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
                " So either headings are counted clockwise or one axis is mirrored; its turns do "
                "not say which.",
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

std::optional<SanityFinding> check_axes(const std::vector<DriveSample>& samples,
                                        const DriveLimits& limits) {
  auto finding = finding_of(fit_travel(samples), sense_of_turns(samples, limits));
  if (!finding) return finding;
  finding->names_an_effect = true;
  if (finding->name == "axis_mirrored") finding->or_else = {"axes_swapped"};
  if (finding->name == "direction_reversed") finding->or_else = {"sides_swapped"};
  return finding;
}

}  // namespace gapfarm
