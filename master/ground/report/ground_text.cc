#include "master/ground/report/ground_text.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "master/ground/tolerances.h"

namespace gapfarm {
namespace {

// The value to paste into the robot's file.
std::string in_file(const GroundRobot& robot, const KinematicRow& row, const Estimate& e) {
  const auto of_group = [&](const char* group) {
    for (const RobotWheel& w : robot.wheels) {
      const bool side = (w.side == WheelSide::kLeft) == (std::string(group) == "left");
      if (w.driven && side && w.side != WheelSide::kNone) return *w.radius_m;
    }
    return 0.0;
  };
  const auto ratio = [&](const char* word, double own, const char* unit) {
    return fmt::format("{} {:.5g} [{:.5g}, {:.5g}]{}; the file has {:.5g}", word,
                       own * (1 + e.value), own * (1 + e.lo), own * (1 + e.hi), unit, own);
  };
  const auto& k = robot.controller;
  const double base = row.nominal;
  if (row.name == "left" || row.name == "right") {
    const double own = of_group(row.name.c_str());
    return ratio(("wheels." + row.name + ".radius").c_str(), own, " m");
  }
  if (row.name == "separation" && k.wheel_separation_m) {
    const double own = k.wheel_separation_multiplier;
    if (own != 1 || robot.drive == DriveKind::kSkid || robot.drive == DriveKind::kTracked) {
      return ratio("wheel_separation_multiplier", own, "");
    }
    return ratio("wheel_separation", *k.wheel_separation_m, " m");
  }
  if (e.key == "ratio" || e.key == "rate") {
    return fmt::format("{:+.4g} [{:+.4g}, {:+.4g}] {}", e.value, e.lo, e.hi,
                       e.unit == "-" ? "of what the file has" : e.unit);
  }
  return fmt::format("{} {:.5g} [{:.5g}, {:.5g}] {}; the file has {:.5g}", row.name, base + e.value,
                     base + e.lo, base + e.hi, e.unit, base);
}

std::string capital(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(text[0]));
  return text;
}

// Shares of what the reference has, in per cent, with a word for their sign.
std::string share_text(double value, double lo, double hi) {
  const double sign = value < 0 ? -100 : 100;
  const double a = std::min(sign * lo, sign * hi), b = std::max(sign * lo, sign * hi);
  const int digits = std::abs(100 * value) < 10 ? 1 : 0;
  return fmt::format("{} by {:.{}f} % [{:.{}f}, {:.{}f}]", value < 0 ? "fell" : "rose",
                     sign * value, digits, a, digits, b, digits);
}

// The value of the robot's file, or of the floor, that a ratio is of; 0: none.
double own_value(const GroundRobot& robot, const KinematicRow& row) {
  if (row.name == "traction") return 1;
  if (row.name == "separation") {
    const ControllerKinematics& k = robot.controller;
    const bool skids = robot.drive == DriveKind::kSkid || robot.drive == DriveKind::kTracked;
    return skids ? k.wheel_separation_multiplier : k.wheel_separation_m.value_or(0);
  }
  for (const RobotWheel& w : robot.wheels) {
    const char* side = w.side == WheelSide::kLeft ? "left" : "right";
    if (w.driven && w.side != WheelSide::kNone && row.name == side) return *w.radius_m;
  }
  return 0;
}

// Of several values of one name: which of them.
const char* spoken(const KinematicRow& row) {
  if (row.name == "travel") return "their travel";
  if (row.name == "separation") return "their separation, as they roll,";
  if (row.name == "slip_angle") return "the rear's slip at the limit";
  return row.name == "grip" ? "" : row.key.c_str();
}

std::string change_text(const GroundRobot& robot, const KinematicRow& row, const Estimate& e) {
  const bool friction = row.key == "log";
  if (friction || row.key == "ratio") {
    // A ratio's change is one of the reference's own.
    const double of = friction ? 1 : row.nominal;
    std::string text = share_text(e.value / of, e.lo / of, e.hi / of);
    const double from =
        friction ? std::exp(row.nominal) / kGravity_m_s2 : own_value(robot, row) * row.nominal;
    if (from > 0) text += fmt::format(", from {:.4g} to {:.4g}", from, from * (1 + e.value / of));
    return text;
  }
  return fmt::format("changed by {:+.4g} [{:+.4g}, {:+.4g}] {}, from {:.4g} to {:.4g}", e.value,
                     e.lo, e.hi, e.unit, row.nominal, row.nominal + e.value);
}

}  // namespace

Estimate estimate_of(const KinematicRow& row, double value, double lo, double hi) {
  if (row.key == "log") {
    return {"ratio", std::expm1(value - row.nominal), std::expm1(lo - row.nominal),
            std::expm1(hi - row.nominal), row.unit};
  }
  return {row.key, value - row.nominal, lo - row.nominal, hi - row.nominal, row.unit};
}

std::string text_of_value(const GroundRobot& robot, const GroundHypothesis& h,
                          const NamedEffect& effect) {
  std::string text = h.thing + " is off: ";
  for (std::size_t k = 0; k < h.freed.size() && k < effect.parameters.size(); ++k) {
    text += (k > 0 ? "; " : "") + in_file(robot, h.freed[k], effect.parameters[k]);
  }
  return capital(text + ".");
}

std::string text_of_change(const GroundRobot& robot, const GroundHypothesis& h,
                           const NamedEffect& effect) {
  std::string text = h.thing + " ";
  for (std::size_t k = 0; k < h.freed.size() && k < effect.parameters.size(); ++k) {
    if (h.freed[k].name == "grip_shape") continue;  // a word for it is nobody's
    const bool several = h.freed.size() > 1;
    const std::string which = several ? spoken(h.freed[k]) : "";
    text += (k > 0 ? "; " : "") + which + (which.empty() ? "" : " ") +
            change_text(robot, h.freed[k], effect.parameters[k]);
  }
  return capital(text);
}

}  // namespace gapfarm
