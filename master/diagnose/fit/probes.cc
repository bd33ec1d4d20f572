#include "master/diagnose/fit/probes.h"

namespace gapfarm {

std::vector<Probe> lens_probes(const Eigen::Vector2d& middle) {
  constexpr double k1 = 0.02, away = 0.1;
  const auto lens = [&](double dx, double dy) {
    return std::map<std::string, double>{{"camera_distortion.k1", k1},
                                         {"camera_distortion.x", middle.x() + dx},
                                         {"camera_distortion.y", middle.y() + dy}};
  };
  return {{"camera_distortion", lens(0, 0), {}, k1},
          {"camera_distortion", lens(away, 0), lens(-away, 0), 2 * away * k1},
          {"camera_distortion", lens(0, away), lens(0, -away), 2 * away * k1}};
}

namespace {

// Whether the two sides lie about the base alike: one parameter, moved up and down.
bool mirrors(const Probe& probe) { return probe.plus.size() == 1 && probe.minus.size() == 1; }

}  // namespace

Overrides base_with(const Predictor& predictor, const Study& study,
                    const std::map<std::string, double>& values) {
  Overrides overrides = study.base;
  for (const auto& [key, value] : values) overrides[predictor.problem().table().row(key)] = value;
  return overrides;
}

Result<std::vector<std::vector<Eigen::Vector3d>>> probe_all(Predictor& predictor,
                                                            const Study& study,
                                                            const std::vector<Probe>& probes) {
  std::vector<PredictionRequest> requests;
  for (const Probe& probe : probes) {
    requests.push_back({base_with(predictor, study, probe.plus), {}});
    if (!probe.minus.empty()) requests.push_back({base_with(predictor, study, probe.minus), {}});
  }
  const auto ends = predictor.attempt(requests);
  if (!ends) return ends.error();
  std::vector<std::vector<Eigen::Vector3d>> all;
  std::size_t next = 0;
  for (const Probe& probe : probes) {
    const auto& plus = (*ends)[next++];
    std::vector<Eigen::Vector3d>& d = all.emplace_back();
    if (probe.minus.empty()) {
      if (plus) d = differences(study, *plus, probe.scale);
      continue;
    }
    const auto& minus = (*ends)[next++];
    const bool both = plus && minus, mirrored = mirrors(probe);
    if (plus && (both || mirrored)) d = differences(study, *plus, probe.scale / (both ? 1 : 2));
    if (!minus || (!both && !mirrored)) continue;
    const std::vector<Eigen::Vector3d> below =
        differences(study, *minus, probe.scale / (both ? 1 : 2));
    if (d.empty()) d.assign(study.size(), Eigen::Vector3d::Zero());
    for (std::size_t i = 0; i < d.size(); ++i) d[i] -= below[i];
  }
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (all[k].empty()) predictor.exclude(probes[k].effect);
  }
  return all;
}

Eigen::MatrixXd stack(const std::vector<Eigen::VectorXd>& columns) {
  Eigen::MatrixXd all(columns.front().size(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k)
    all.col(static_cast<Eigen::Index>(k)) = columns[k];
  return all;
}

}  // namespace gapfarm
