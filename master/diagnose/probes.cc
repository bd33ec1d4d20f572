#include "master/diagnose/probes.h"

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
  const auto ends = predictor.ends(requests);
  if (!ends) return ends.error();
  std::vector<std::vector<Eigen::Vector3d>> all;
  std::size_t next = 0;
  for (const Probe& probe : probes) {
    std::vector<Eigen::Vector3d> d = differences(study, (*ends)[next++], probe.scale);
    if (!probe.minus.empty()) {
      const std::vector<Eigen::Vector3d> minus = differences(study, (*ends)[next++], probe.scale);
      for (std::size_t i = 0; i < d.size(); ++i) d[i] -= minus[i];
    }
    all.push_back(std::move(d));
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
