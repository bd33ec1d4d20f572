#include "common/residual/outliers.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gapfarm {
namespace {

// Equal parts of the amounts, each a way of its own: arcs bend within what a side may lose or a
// heading may be off.
int parts_of(OutlierKind kind) {
  switch (kind) {
    case OutlierKind::kSide:
      return 5;
    case OutlierKind::kLate:
      return 2;
    case OutlierKind::kTurned:
      return 10;
    case OutlierKind::kShifted:
      return 2;
  }
  return 1;
}

bool has_two_cases(OutlierKind kind) {
  return kind == OutlierKind::kSide || kind == OutlierKind::kShifted;
}

// What the motion changes by for a unit change of each side's gain.
Twist of_sides(const OutlierDrives& outliers, const LoggedMotion& facts, double left,
               double right) {
  const double to_left = outliers.speed_m_s * facts.left * facts.duration_s * left;
  const double to_right = outliers.speed_m_s * facts.right * facts.duration_s * right;
  return {(to_left + to_right) / 2, 0, (to_right - to_left) / outliers.gauge_m};
}

// The end of the same motion, changed by that.
Pose with_sides(const OutlierDrives& outliers, const LoggedMotion& facts, const Pose& X_WE,
                double left, double right) {
  if (left == 0 && right == 0) return X_WE;
  const Twist motion = log(between(facts.X_WS, X_WE));
  return facts.X_WS * exp(motion + of_sides(outliers, facts, left, right));
}

Pose read_before(const LoggedMotion& facts, const Pose& X_WE, double age_s) {
  if (age_s == 0 || facts.duration_s <= 0) return X_WE;
  const Twist motion = log(between(facts.X_WS, X_WE));
  return facts.X_WS * exp(Twist(std::max(0.0, 1 - age_s / facts.duration_s) * motion));
}

}  // namespace

const std::vector<std::string>& outlier_kind_names() {
  static const std::vector<std::string> names = {"side", "late", "turned", "shifted"};
  return names;
}

std::array<std::pair<const char*, double*>, 7> outlier_values(OutlierDrives& outliers) {
  return {{{"share", &outliers.share},
           {"least", &outliers.least},
           {"most", &outliers.most},
           {"rest", &outliers.rest},
           {"direction", &outliers.direction_rad},
           {"speed", &outliers.speed_m_s},
           {"gauge", &outliers.gauge_m}}};
}

bool may_be_outlier(const OutlierDrives& outliers, const LoggedMotion& facts) {
  return outliers.kind != OutlierKind::kTurned || facts.moved;
}

Pose rest_end(const OutlierDrives& outliers, const LoggedMotion& facts, const Pose& X_WE) {
  if (outliers.kind == OutlierKind::kLate) return read_before(facts, X_WE, outliers.rest);
  if (outliers.kind == OutlierKind::kSide) {
    return with_sides(outliers, facts, X_WE, outliers.rest, outliers.rest);
  }
  return X_WE;
}

Pose outlier_end(const OutlierDrives& outliers, const LoggedMotion& facts, const Pose& X_WE,
                 double amount, bool first) {
  switch (outliers.kind) {
    case OutlierKind::kSide:
      return with_sides(outliers, facts, X_WE, first ? amount : outliers.rest,
                        first ? outliers.rest : amount);
    case OutlierKind::kLate:
      return read_before(facts, X_WE, amount);
    case OutlierKind::kTurned:
      return facts.X_WS * (Pose{0, 0, amount} * between(facts.X_WS, X_WE));
    case OutlierKind::kShifted: {
      const double along = first ? amount : -amount;
      return {X_WE.x + along * std::cos(outliers.direction_rad),
              X_WE.y + along * std::sin(outliers.direction_rad), X_WE.theta};
    }
  }
  return X_WE;
}

std::vector<OutlierMode> outlier_modes(const OutlierDrives& outliers, const LoggedMotion& facts,
                                       const Pose& X_WE) {
  if (!may_be_outlier(outliers, facts)) return {{1, X_WE, Eigen::Vector3d::Zero()}};
  const int parts = parts_of(outliers.kind);
  const double part = (outliers.most - outliers.least) / parts;
  const int cases = has_two_cases(outliers.kind) ? 2 : 1;
  std::vector<OutlierMode> modes = {
      {1 - outliers.share, rest_end(outliers, facts, X_WE), Eigen::Vector3d::Zero()}};
  for (int c = 0; c < cases; ++c) {
    // Between the ends of a part's edges lies a chord; ends are uniform along it.
    Pose from = outlier_end(outliers, facts, X_WE, outliers.least, c == 0);
    for (int k = 0; k < parts; ++k) {
      const double middle = outliers.least + (k + 0.5) * part;
      const Pose X_WK = outlier_end(outliers, facts, X_WE, middle, c == 0);
      const Pose to = outlier_end(outliers, facts, X_WE, middle + part / 2, c == 0);
      const Eigen::Vector3d chord = local_difference(X_WK, to) - local_difference(X_WK, from);
      modes.push_back({outliers.share / (parts * cases), X_WK, chord / std::sqrt(12.0)});
      from = to;
    }
  }
  return modes;
}

Status check_outliers(const OutlierDrives& outliers) {
  struct Ranged {
    const char* key;
    double value, lower, upper;
  };
  const bool sided = outliers.kind == OutlierKind::kSide;
  const bool timed = outliers.kind == OutlierKind::kLate;
  const double least = sided ? -1 : outliers.kind == OutlierKind::kTurned ? -std::numbers::pi : 0;
  const double most = timed ? 60 : sided ? 1 : std::numbers::pi;
  const bool rests = sided || timed;
  const Ranged ranged[] = {
      {"share", outliers.share, 1e-6, 1 - 1e-6},
      {"least", outliers.least, timed ? -most : least, most},
      {"most", outliers.most, timed ? -most : least, most},
      {"rest", outliers.rest, rests ? -most : 0, rests ? most : 0},
      {"direction", outliers.direction_rad, -2 * std::numbers::pi, 2 * std::numbers::pi},
      {"speed", outliers.speed_m_s, sided ? 1e-6 : 0, 1e3},
      {"gauge", outliers.gauge_m, sided ? 1e-6 : 0, 1e3}};
  for (const Ranged& r : ranged) {
    if (r.value >= r.lower && r.value <= r.upper) continue;
    return Error{"residual.strays." + std::string(r.key) + " is " + std::to_string(r.value) +
                 "; of kind \"" + outlier_kind_names()[static_cast<std::size_t>(outliers.kind)] +
                 "\" it is " + std::to_string(r.lower) + " to " + std::to_string(r.upper)};
  }
  if (outliers.least > outliers.most) {
    return Error{"residual.strays.least is " + std::to_string(outliers.least) +
                 ", which is above most, " + std::to_string(outliers.most) + "; exchange them"};
  }
  return {};
}

}  // namespace gapfarm
