#include "common/residual/strays.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gapfarm {
namespace {

// Equal parts of the amounts, each a way of its own: arcs bend within what a side may lose or a
// heading may be off.
int parts_of(StrayKind kind) {
  switch (kind) {
    case StrayKind::kSide:
      return 5;
    case StrayKind::kLate:
      return 2;
    case StrayKind::kTurned:
      return 10;
    case StrayKind::kShifted:
      return 2;
  }
  return 1;
}

bool has_two_cases(StrayKind kind) {
  return kind == StrayKind::kSide || kind == StrayKind::kShifted;
}

// What the motion changes by for a unit change of each side's gain.
Twist of_sides(const StrayDrives& strays, const LoggedMotion& facts, double left, double right) {
  const double to_left = strays.speed_m_s * facts.left * facts.duration_s * left;
  const double to_right = strays.speed_m_s * facts.right * facts.duration_s * right;
  return {(to_left + to_right) / 2, 0, (to_right - to_left) / strays.gauge_m};
}

// The end of the same motion, changed by that.
Pose with_sides(const StrayDrives& strays, const LoggedMotion& facts, const Pose& X_WE, double left,
                double right) {
  if (left == 0 && right == 0) return X_WE;
  const Twist way = log(between(facts.X_WS, X_WE));
  return facts.X_WS * exp(way + of_sides(strays, facts, left, right));
}

Pose read_before(const LoggedMotion& facts, const Pose& X_WE, double age_s) {
  if (age_s == 0 || facts.duration_s <= 0) return X_WE;
  const Twist way = log(between(facts.X_WS, X_WE));
  return facts.X_WS * exp(Twist(std::max(0.0, 1 - age_s / facts.duration_s) * way));
}

}  // namespace

const std::vector<std::string>& stray_kind_words() {
  static const std::vector<std::string> words = {"side", "late", "turned", "shifted"};
  return words;
}

std::array<std::pair<const char*, double*>, 7> stray_values(StrayDrives& strays) {
  return {{{"share", &strays.share},
           {"least", &strays.least},
           {"most", &strays.most},
           {"rest", &strays.rest},
           {"direction", &strays.direction_rad},
           {"speed", &strays.speed_m_s},
           {"gauge", &strays.gauge_m}}};
}

bool may_stray(const StrayDrives& strays, const LoggedMotion& facts) {
  return strays.kind != StrayKind::kTurned || facts.moved;
}

Pose rest_end(const StrayDrives& strays, const LoggedMotion& facts, const Pose& X_WE) {
  if (strays.kind == StrayKind::kLate) return read_before(facts, X_WE, strays.rest);
  if (strays.kind == StrayKind::kSide) {
    return with_sides(strays, facts, X_WE, strays.rest, strays.rest);
  }
  return X_WE;
}

Pose stray_end(const StrayDrives& strays, const LoggedMotion& facts, const Pose& X_WE,
               double amount, bool first) {
  switch (strays.kind) {
    case StrayKind::kSide:
      return with_sides(strays, facts, X_WE, first ? amount : strays.rest,
                        first ? strays.rest : amount);
    case StrayKind::kLate:
      return read_before(facts, X_WE, amount);
    case StrayKind::kTurned:
      return facts.X_WS * (Pose{0, 0, amount} * between(facts.X_WS, X_WE));
    case StrayKind::kShifted: {
      const double along = first ? amount : -amount;
      return {X_WE.x + along * std::cos(strays.direction_rad),
              X_WE.y + along * std::sin(strays.direction_rad), X_WE.theta};
    }
  }
  return X_WE;
}

std::vector<StrayWay> stray_ways(const StrayDrives& strays, const LoggedMotion& facts,
                                 const Pose& X_WE) {
  if (!may_stray(strays, facts)) return {{1, X_WE, Eigen::Vector3d::Zero()}};
  const int parts = parts_of(strays.kind);
  const double part = (strays.most - strays.least) / parts;
  const int cases = has_two_cases(strays.kind) ? 2 : 1;
  std::vector<StrayWay> ways = {
      {1 - strays.share, rest_end(strays, facts, X_WE), Eigen::Vector3d::Zero()}};
  for (int c = 0; c < cases; ++c) {
    // Between the ends of a part's edges lies a chord; ends are uniform along it.
    Pose from = stray_end(strays, facts, X_WE, strays.least, c == 0);
    for (int k = 0; k < parts; ++k) {
      const double middle = strays.least + (k + 0.5) * part;
      const Pose X_WK = stray_end(strays, facts, X_WE, middle, c == 0);
      const Pose to = stray_end(strays, facts, X_WE, middle + part / 2, c == 0);
      const Eigen::Vector3d chord = local_difference(X_WK, to) - local_difference(X_WK, from);
      ways.push_back({strays.share / (parts * cases), X_WK, chord / std::sqrt(12.0)});
      from = to;
    }
  }
  return ways;
}

Status check_strays(const StrayDrives& strays) {
  struct Ranged {
    const char* key;
    double value, lower, upper;
  };
  const bool sided = strays.kind == StrayKind::kSide;
  const bool timed = strays.kind == StrayKind::kLate;
  const double least = sided ? -1 : strays.kind == StrayKind::kTurned ? -std::numbers::pi : 0;
  const double most = timed ? 60 : sided ? 1 : std::numbers::pi;
  const bool rests = sided || timed;
  const Ranged ranged[] = {
      {"share", strays.share, 1e-6, 1 - 1e-6},
      {"least", strays.least, timed ? -most : least, most},
      {"most", strays.most, timed ? -most : least, most},
      {"rest", strays.rest, rests ? -most : 0, rests ? most : 0},
      {"direction", strays.direction_rad, -2 * std::numbers::pi, 2 * std::numbers::pi},
      {"speed", strays.speed_m_s, sided ? 1e-6 : 0, 1e3},
      {"gauge", strays.gauge_m, sided ? 1e-6 : 0, 1e3}};
  for (const Ranged& r : ranged) {
    if (r.value >= r.lower && r.value <= r.upper) continue;
    return Error{"residual.strays." + std::string(r.key) + " is " + std::to_string(r.value) +
                 "; of kind \"" + stray_kind_words()[static_cast<std::size_t>(strays.kind)] +
                 "\" it is " + std::to_string(r.lower) + " to " + std::to_string(r.upper)};
  }
  if (strays.least > strays.most) {
    return Error{"residual.strays.least is " + std::to_string(strays.least) +
                 ", which is above most, " + std::to_string(strays.most) + "; exchange them"};
  }
  return {};
}

}  // namespace gapfarm
