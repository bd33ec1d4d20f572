#include "master/io/log_checks/axes.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>

#include "common/math/statistics.h"

namespace gapfarm {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kFewestTurns = 8;
constexpr double kGoodConcentration = 0.75;
constexpr double kClearMargin = 0.4;
constexpr double kLeastShare = 0.3;  // of the typical distance: shorter ones have no direction
// Catalogued as heading_offset up to here; beyond, an axis is another one.
constexpr double kMostOffset_rad = 0.5;
constexpr double kNearAxis_rad = 0.4;

std::string degrees(double angle_rad) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f", angle_rad * 180 / kPi);
  return std::string(text) + " degrees";
}

std::string share(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

bool near(double angle_rad, double axis_rad) {
  return std::abs(wrap_angle(angle_rad - axis_rad)) < kNearAxis_rad;
}

// Mean cosine of how far the turns are from `rate` times the command.
double agreement(const std::vector<DriveSample>& turns, double rate) {
  double sum = 0;
  for (const DriveSample& s : turns) sum += std::cos(s.turned_rad() - rate * s.turn_s);
  return sum / static_cast<double>(turns.size());
}

struct Rate {
  double rate = 0;
  double agreement = -1;
};

// The best rate of one sign, in rad a second at full duty on one side more than on the other.
Rate best_rate(const std::vector<DriveSample>& turns, double sign) {
  std::vector<double> sizes;
  for (const DriveSample& s : turns) sizes.push_back(std::abs(s.turn_s));
  const double largest = *std::max_element(sizes.begin(), sizes.end());
  const double fastest = 2 * kPi / median(sizes);
  const double step = 0.05 / largest;
  Rate best;
  for (double rate = step; rate < fastest; rate += step) {
    const double value = agreement(turns, sign * rate);
    if (value > best.agreement) best = {rate, value};
  }
  return best;
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
                " So either headings are counted clockwise or one axis is mirrored; without "
                "turns the log does not say which.",
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
    return SanityFinding{"heading_turned", seen + " So the robot's front is taken for its back.",
                         "Add pi to theta0 and theta1, or exchange left and right and change their "
                         "signs."};
  }
  return SanityFinding{"heading_turned",
                       seen + " So headings are counted from another axis than x.",
                       "Add " + degrees(travel.offset_rad) +
                           " to theta0 and theta1, or turn x and y back by as much."};
}

}  // namespace

bool TravelFit::is_clear() const {
  return drives >= kFewestStraight && std::max(same, mirrored) > kGoodConcentration &&
         std::abs(same - mirrored) > kClearMargin;
}

TravelFit fit_travel(const std::vector<DriveSample>& samples) {
  const std::vector<DriveSample> straight = straight_samples(samples);
  TravelFit fit;
  if (straight.size() < kFewestStraight) return fit;
  std::vector<double> distances;
  for (const DriveSample& s : straight) distances.push_back(s.distance_m());
  const double typical = median(distances);
  std::complex<double> same = 0, mirrored = 0;
  for (const DriveSample& s : straight) {
    if (!(s.distance_m() > kLeastShare * typical)) continue;
    const double travel = s.travel_rad() + (s.forward_s < 0 ? kPi : 0);
    same += std::polar(1.0, travel - s.mid_heading_rad());
    mirrored += std::polar(1.0, travel + s.mid_heading_rad());
    ++fit.drives;
  }
  if (fit.drives == 0) return fit;
  fit.same = std::abs(same) / static_cast<double>(fit.drives);
  fit.mirrored = std::abs(mirrored) / static_cast<double>(fit.drives);
  fit.offset_rad = std::arg(fit.same >= fit.mirrored ? same : mirrored);
  return fit;
}

int sense_of_turns(const std::vector<DriveSample>& samples) {
  std::vector<DriveSample> turns;
  for (const DriveSample& s : samples) {
    if (std::abs(s.turn_s) > 1e-9) turns.push_back(s);
  }
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

namespace {

std::optional<SanityFinding> finding_of(const TravelFit& travel, int sense) {
  const std::string seen = evidence(travel, sense);
  if (travel.is_clear()) {
    if (travel.mirrored > travel.same) return mirrored_finding(travel, sense, seen);
    return turned_finding(travel, sense, seen);
  }
  if (sense >= 0) return std::nullopt;
  return SanityFinding{"sides_swapped",
                       seen +
                           " So left and right are exchanged, or headings count clockwise; "
                           "without straight drives the log does not say which.",
                       "Exchange left and right, or change the sign of theta."};
}

}  // namespace

std::optional<SanityFinding> check_axes(const std::vector<DriveSample>& samples) {
  auto finding = finding_of(fit_travel(samples), sense_of_turns(samples));
  if (!finding) return finding;
  finding->names_an_effect = true;
  if (finding->name == "axis_mirrored") finding->or_else = {"axes_swapped"};
  if (finding->name == "direction_reversed") finding->or_else = {"sides_swapped"};
  return finding;
}

}  // namespace gapfarm
