#include <array>
#include <cmath>
#include <numbers>

#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {
namespace {

constexpr double kProbedNap = 0.15;

std::vector<Probe> nap_probes(const Study&) {
  std::vector<Probe> all;
  for (double direction : {0.0, 2 * std::numbers::pi / 3, -2 * std::numbers::pi / 3}) {
    all.push_back({"floor_nap",
                   {{"floor_nap.strength", kProbedNap}, {"floor_nap.direction", direction}},
                   {},
                   kProbedNap});
  }
  return all;
}

// Straight drives slowed by (1 - cos(travel - nap)) / 2 of their path.
std::vector<Eigen::Vector3d> nap_creep(const Study& study, double direction) {
  std::vector<Eigen::Vector3d> d(study.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < d.size(); ++i) {
    if (!is_straight(study, i)) continue;
    const ResidualTrial& t = study.trials[i];
    const Cell& cell = study.cells[t.cell];
    const double travel = t.X_WP.theta + (cell.mirror < 0 ? std::numbers::pi : 0);
    const double against = (1 - std::cos(travel - direction)) / 2;
    d[i].x() = -cell.mirror * against * cell.path * study.speed_m_s;
  }
  return d;
}

// Linear in the strength and in (1, cos, sin) of the direction: three directions give all.
std::vector<Signature> nap_signatures(const Study& study, ProbedSlopes probe) {
  std::array<Eigen::VectorXd, 3> turning;
  for (int k = 0; k < 3; ++k) {
    std::vector<Eigen::Vector3d> d(study.size(), Eigen::Vector3d::Zero());
    for (std::size_t i = 0; i < d.size(); ++i) {
      if (is_straight(study, i)) continue;
      const Eigen::Vector3d a = probe[0][i], b = probe[1][i], c = probe[2][i];
      if (k == 0) d[i] = (a + b + c) / 3;
      if (k == 1) d[i] = (2 * a - b - c) / 3;
      if (k == 2) d[i] = (b - c) / std::sqrt(3.0);
    }
    turning[static_cast<std::size_t>(k)] = study.whiten(d);
  }
  std::vector<Signature> all;
  for (int k = 0; k < 24; ++k) {
    const double direction = wrap_angle(k * std::numbers::pi / 12);
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

}  // namespace

extern const EffectDiagnosis kFloorNap = {
    .effect = "floor_nap",
    .searched = {{"strength", 0.1}, {"direction", 0.2}},
    .probes = nap_probes,
    .signatures = nap_signatures,
    .by_contact = true,
    .family = &kSlopeFamily,
    .model_error = 0.2,
    .direction_error_rad = 0.02,
    .phrases = {"The floor has a nap that drags with %1 of the weight against %2",
                {{"strength", 100, " %"}, {"direction", 180 / std::numbers::pi, " degrees"}},
                "Drive on a floor without pile",
                "The floor has a nap that drags with %1 of the weight"},
};

}  // namespace gapfarm
