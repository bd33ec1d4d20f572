#include <numbers>

#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {
namespace {

constexpr double kProbedTilt_rad = 0.05;

// Hardly over the floor: twice what the table allows.
double low_mass_m(const Study& study) { return 2 * (*study.table)[*study.drive.mass_height].lower; }

// A tilt also shifts the load, the more the higher the mass lies, which no flat floor shows.  A
// program's mass lies where it lies.
std::vector<Probe> tilt_probes(const Study& study) {
  std::vector<Probe> all;
  const auto add = [&](const std::map<std::string, double>& minus) {
    for (double direction : {0.0, std::numbers::pi / 2}) {
      Probe probe{"floor_tilt",
                  {{"floor_tilt.angle", kProbedTilt_rad}, {"floor_tilt.direction", direction}},
                  minus,
                  kProbedTilt_rad};
      probe.plus.insert(minus.begin(), minus.end());
      all.push_back(std::move(probe));
    }
  };
  if (!study.drive.mass_height) {
    add({});
    return all;
  }
  for (double height : {study.base.at(*study.drive.mass_height), low_mass_m(study)}) {
    add({{"mass_height", height}});
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
        if (is_straight(study, i) != sticks) d[i].setZero();
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

std::vector<Signature> tilt_signatures(const Study& study, ProbedSlopes slopes) {
  std::vector<Signature> all = {tilt_signature(study, slopes[0], slopes[1])};
  if (slopes.size() < 4) return all;
  all.push_back(tilt_signature(study, slopes[2], slopes[3]));
  all.back().fixed = {{"mass_height", low_mass_m(study)}};
  return all;
}

}  // namespace

extern const EffectDiagnosis kFloorTilt = {
    .effect = "floor_tilt",
    .searched = {{"angle", 0.03}},
    .probes = tilt_probes,
    .signatures = tilt_signatures,
    .by_contact = true,
    .family = &kSlopeFamily,
    .polar = Polar{"floor_tilt.angle", "floor_tilt.direction", 1, false},
    .model_error = 0.3,
    .direction_error_rad = 0.02,
    .phrases = {"The floor falls by %1 toward %2",
                {{"angle", 1000, " mrad"}, {"direction", kDegrees, " degrees"}},
                "Level the floor",
                "The floor slopes by %1 toward %2"},
};

}  // namespace gapfarm
