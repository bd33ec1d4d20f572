#include "master/diagnose/signatures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "master/diagnose/probes.h"
#include "master/diagnose/seam.h"
#include "master/diagnose/subject.h"

namespace gapfarm {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kLowMass_m = 0.002;  // hardly over the floor

// A tilt also shifts the load, the more the higher the mass lies, which no flat floor shows.  A
// program's mass lies where it lies.
std::vector<Probe> tilt_probes(const std::optional<double>& own_height_m) {
  std::vector<Probe> all;
  const auto add = [&](std::map<std::string, double> minus) {
    for (double direction : {0.0, kPi / 2}) {
      Probe probe{"floor_tilt",
                  {{"floor_tilt.angle", 0.05}, {"floor_tilt.direction", direction}},
                  minus,
                  0.05};
      probe.plus.insert(minus.begin(), minus.end());
      all.push_back(std::move(probe));
    }
  };
  if (!own_height_m) {
    add({});
    return all;
  }
  for (double height : {*own_height_m, kLowMass_m}) add({{"mass_height", height}});
  return all;
}

std::vector<Probe> probes(const Eigen::Vector2d& middle,
                          const std::optional<double>& own_height_m) {
  std::vector<Probe> all;
  const auto slope = [&](const std::string& effect, const std::string& key, double step,
                         bool central, double neutral = 0) {
    const std::string row = effect + "." + key;
    if (central) {
      all.push_back({effect, {{row, neutral + step}}, {{row, neutral - step}}, 2 * step});
    } else {
      all.push_back({effect, {{row, neutral + step}}, {}, step});
    }
  };
  slope("motor_asymmetry", "ratio", 0.02, true);
  slope("motor_deadband", "duty", 0.005, false);
  slope("motor_lag", "tau", 0.1, false);
  slope("timing_offset", "offset", 0.02, true);
  slope("battery_sag", "rate", 0.002, true);
  slope("backlash", "travel", 0.004, false);
  slope("rolling_resistance", "coefficient", 0.05, false);
  slope("com_offset", "x", 0.003, true);
  slope("com_offset", "y", 0.003, true);
  slope("camera_aspect", "ratio", 0.02, true, 1);
  slope("heading_offset", "angle", 0.02, true);
  slope("marker_offset", "x", 0.005, true);
  slope("marker_offset", "y", 0.005, true);
  for (Probe& probe : tilt_probes(own_height_m)) all.push_back(std::move(probe));
  for (double direction : {0.0, 2 * kPi / 3, -2 * kPi / 3}) {
    all.push_back({"floor_nap",
                   {{"floor_nap.strength", 0.15}, {"floor_nap.direction", direction}},
                   {},
                   0.15});
  }
  for (Probe& probe : lens_probes(middle)) all.push_back(std::move(probe));
  return all;
}

// Whether a drive sticks: Coulomb treads then give way to no small force, real ones creep in
// proportion to it.
bool straight(const Study& study, std::size_t i) {
  return study.cells[study.trials[i].cell].kind == MotionKind::kStraight;
}

// Straight drives slowed by (1 - cos(travel - nap)) / 2 of their path.
std::vector<Eigen::Vector3d> nap_creep(const Study& study, double direction) {
  std::vector<Eigen::Vector3d> d(study.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < d.size(); ++i) {
    if (!straight(study, i)) continue;
    const ResidualTrial& t = study.trials[i];
    const Cell& cell = study.cells[t.cell];
    const double travel = t.X_WP.theta + (cell.mirror < 0 ? kPi : 0);
    const double against = (1 - std::cos(travel - direction)) / 2;
    d[i].x() = -cell.mirror * against * cell.path * study.speed_m_s;
  }
  return d;
}

std::vector<Signature> nap_signatures(const Study& study,
                                      const std::array<std::vector<Eigen::Vector3d>, 3>& probe) {
  // Linear in the strength and in (1, cos, sin) of the direction: three directions give all.
  std::array<Eigen::VectorXd, 3> turning;
  for (int k = 0; k < 3; ++k) {
    std::vector<Eigen::Vector3d> d(study.size(), Eigen::Vector3d::Zero());
    for (std::size_t i = 0; i < d.size(); ++i) {
      if (straight(study, i)) continue;
      const Eigen::Vector3d a = probe[0][i], b = probe[1][i], c = probe[2][i];
      if (k == 0) d[i] = (a + b + c) / 3;
      if (k == 1) d[i] = (2 * a - b - c) / 3;
      if (k == 2) d[i] = (b - c) / std::sqrt(3.0);
    }
    turning[static_cast<std::size_t>(k)] = study.whiten(d);
  }
  std::vector<Signature> all;
  for (int k = 0; k < 24; ++k) {
    const double direction = wrap_angle(k * kPi / 12);
    Signature s;
    s.effect = "floor_nap";
    s.columns =
        stack({turning[0] + std::cos(direction) * turning[1] + std::sin(direction) * turning[2],
               study.whiten(nap_creep(study, direction))});
    s.parameters = {"floor_nap.strength"};
    s.fixed = {{"floor_nap.direction", direction}};
    s.penalty = 2;
    all.push_back(std::move(s));
  }
  return all;
}

// Towards world x and y; straight and turning drives have a strength each, since how far a tread
// that sticks gives way is another thing than how one that slides is pushed.
Signature tilt_signature(const Study& study, const std::vector<Eigen::Vector3d>& x,
                         const std::vector<Eigen::Vector3d>& y) {
  std::vector<Eigen::VectorXd> columns;
  for (bool sticks : {false, true}) {
    for (const auto* slope : {&x, &y}) {
      std::vector<Eigen::Vector3d> d = *slope;
      for (std::size_t i = 0; i < d.size(); ++i) {
        if (straight(study, i) != sticks) d[i].setZero();
      }
      columns.push_back(study.whiten(d));
    }
  }
  Signature s;
  s.effect = "floor_tilt";
  s.columns = stack(columns);
  s.penalty = 2;
  return s;
}

// Of these, one level and one duration show nothing that another full speed would not do.
bool changes_only_reach(const std::string& effect) {
  return effect == "motor_deadband" || effect == "motor_lag" || effect == "timing_offset" ||
         effect == "rolling_resistance";
}

bool has_effect(const Study& study, const std::string& name) {
  const std::span<const Effect> known = study.table->effects();
  return std::any_of(known.begin(), known.end(), [&](const Effect& e) { return e.name == name; });
}

bool one_condition(const Study& study) {
  const auto same = [&](const Cell& c) {
    return c.kind == study.cells.front().kind && c.level == study.cells.front().level &&
           c.command.duration_s == study.cells.front().command.duration_s;
  };
  return std::all_of(study.cells.begin(), study.cells.end(), same);
}

// What drag costs a straight drive depends on how the treads give way: as the simulated ones do, or
// the same on every run, whatever its length.  So straight and turning drives have a strength each.
std::vector<Signature> rolling_signatures(const Study& study,
                                          const std::vector<Eigen::Vector3d>& slope) {
  std::vector<Eigen::Vector3d> along = slope, turning = slope, per_run = slope;
  for (std::size_t i = 0; i < study.size(); ++i) {
    (straight(study, i) ? turning : along)[i].setZero();
    per_run[i].setZero();
    if (straight(study, i)) per_run[i].x() = study.cells[study.trials[i].cell].mirror;
  }
  std::vector<Signature> all;
  for (const auto* other : {&along, &per_run}) {
    Signature s;
    s.effect = "rolling_resistance";
    s.columns = stack({study.whiten(turning), study.whiten(*other)});
    s.parameters = {"rolling_resistance.coefficient"};
    s.penalty = 1;
    all.push_back(std::move(s));
  }
  return all;
}

}  // namespace

bool depends_on_contact(const std::string& effect) {
  return effect == "floor_tilt" || effect == "floor_nap" || effect == "rolling_resistance";
}

Eigen::MatrixXd split_by_kind(const Study& study, const Eigen::MatrixXd& columns) {
  std::vector<Eigen::VectorXd> parts;
  for (Eigen::Index k = 0; k < columns.cols(); ++k) {
    for (MotionKind kind : {MotionKind::kStraight, MotionKind::kTurn, MotionKind::kWide}) {
      Eigen::VectorXd part = columns.col(k);
      for (std::size_t i = 0; i < study.size(); ++i) {
        if (study.cells[study.trials[i].cell].kind != kind)
          part.segment<3>(static_cast<Eigen::Index>(3 * i)).setZero();
      }
      if (part.squaredNorm() > 0) parts.push_back(std::move(part));
    }
  }
  return stack(parts);
}

Eigen::Vector2d middle_of(const Study& study) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const ResidualTrial& t : study.trials) {
    middle += Eigen::Vector2d(t.X_WS.x, t.X_WS.y) / static_cast<double>(study.size());
  }
  return middle;
}

Result<std::vector<Signature>> signatures(Predictor& predictor, const Study& study,
                                          const std::vector<std::string>& left_out) {
  const Eigen::Vector2d middle = middle_of(study);
  std::optional<double> own_height_m;
  if (study.drive.mass_height) own_height_m = study.base.at(*study.drive.mass_height);
  std::vector<Probe> all = probes(middle, own_height_m);
  std::erase_if(all, [&](const Probe& probe) { return !has_effect(study, probe.effect); });
  auto probed = probe_all(predictor, study, all);
  if (!probed) return probed.error();

  std::map<std::string, std::vector<std::vector<Eigen::Vector3d>>> slopes;
  std::vector<std::string> order;
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (slopes[all[k].effect].empty()) order.push_back(all[k].effect);
    slopes[all[k].effect].push_back(std::move((*probed)[k]));
  }

  std::vector<Signature> found;
  for (const std::string& effect : order) {
    const auto& own = slopes[effect];
    if (std::any_of(own.begin(), own.end(), [](const auto& d) { return d.empty(); })) continue;
    if (effect == "floor_nap") {
      const std::vector<Signature> naps = nap_signatures(study, {own[0], own[1], own[2]});
      found.insert(found.end(), naps.begin(), naps.end());
      continue;
    }
    if (effect == "floor_tilt") {
      found.push_back(tilt_signature(study, own[0], own[1]));
      if (own.size() < 4) continue;
      found.push_back(tilt_signature(study, own[2], own[3]));
      found.back().fixed = {{"mass_height", kLowMass_m}};
      continue;
    }
    Signature s;
    s.effect = effect;
    std::vector<Eigen::VectorXd> columns;
    for (const auto& d : own) columns.push_back(study.whiten(d));
    if (effect == "rolling_resistance") {
      const std::vector<Signature> rolling = rolling_signatures(study, own[0]);
      found.insert(found.end(), rolling.begin(), rolling.end());
      continue;
    }
    s.columns = stack(columns);
    s.penalty = 0.5 * static_cast<double>(own.size());
    for (const Probe& probe : all) {
      if (probe.effect == effect && probe.plus.size() == 1)
        s.parameters.push_back(probe.plus.begin()->first);
    }
    found.push_back(std::move(s));
  }
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<double> places;
    for (const ResidualTrial& t : study.trials) places.push_back(axis == 0 ? t.X_WS.x : t.X_WS.y);
    std::sort(places.begin(), places.end());
    const double lower = places[places.size() * 8 / 100], upper = places[places.size() * 92 / 100];
    for (int k = 0; upper > lower && k < 29; ++k) {
      found.push_back(seam_signature(study, axis, lower + (upper - lower) * k / 28));
    }
  }
  const bool only_reach = one_condition(study);
  std::erase_if(found, [&](const Signature& s) {
    return (only_reach && changes_only_reach(s.effect)) ||
           std::find(left_out.begin(), left_out.end(), s.effect) != left_out.end();
  });
  return found;
}

Result<std::vector<Signature>> patch_signatures(Predictor& predictor, const Study& study,
                                                const std::vector<std::array<double, 4>>& places) {
  std::vector<PredictionRequest> requests;
  std::vector<std::map<std::string, double>> values;
  for (const auto& [x, y, radius, ratio] : places) {
    PredictionRequest request;
    for (std::size_t i = 0; i < study.size(); ++i) {
      if (study.subject->in_reach(study.trials[i], {x, y, radius, ratio}))
        request.trials.push_back(static_cast<std::uint32_t>(i));
    }
    values.push_back({{"friction_patch.ratio", ratio},
                      {"friction_patch.x", x},
                      {"friction_patch.y", y},
                      {"friction_patch.radius", radius}});
    request.at = base_with(predictor, study, values.back());
    if (request.trials.empty()) request.trials.push_back(0);
    requests.push_back(std::move(request));
  }
  const auto ends = predictor.attempt(requests);
  if (!ends) return ends.error();
  std::vector<Signature> all;
  for (std::size_t k = 0; k < requests.size(); ++k) {
    if (!(*ends)[k]) predictor.leave_out("some places of friction_patch");
    std::vector<Eigen::Vector3d> d(study.size(), Eigen::Vector3d::Zero());
    for (std::size_t j = 0; (*ends)[k] && j < requests[k].trials.size(); ++j) {
      const std::size_t i = requests[k].trials[j];
      d[i] = local_difference(study.trials[i].X_WP, (*(*ends)[k])[j]);
    }
    Signature s;
    s.effect = "friction_patch";
    s.columns = stack({study.whiten(d)});
    s.fixed = values[k];
    s.penalty = 6;
    all.push_back(std::move(s));
  }
  return all;
}

}  // namespace gapfarm
