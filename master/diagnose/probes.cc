#include "master/diagnose/probes.h"

namespace gapfarm {

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
