// Small changes of predictions.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "master/diagnose/study.h"
#include "master/infer/predictor.h"

namespace gapfarm {

// Change of every trial's end a unit of the parameter.
using Slope = std::vector<Eigen::Vector3d>;

// All trials at that point with the subject's slope_rate_hz, where that is coarser: steps of twice
// the length move the robot a little differently, but alike from point to point.
std::optional<PredictionRequest> coarser(const Predictor& predictor, const Study& study,
                                         const Overrides& at);

// One finite difference: parameters at `plus`, less those at `minus` (empty: neutral).
struct Probe {
  std::string effect;
  std::map<std::string, double> plus, minus;
  double scale = 1;
};

// A share of a base parameter's value to either side.
Probe share_probe(const Study& study, std::size_t row, double share);

// Of camera_distortion: its strength about the middle of the trials, and where its centre lies, to
// first order along x and y.
std::vector<Probe> lens_probes(const Eigen::Vector2d& middle);

// The tuned base with some table keys' values put in.
Overrides base_with(const Predictor& predictor, const Study& study,
                    const std::map<std::string, double>& values);

// Differences of the ends over each probe's scale, in the axes of the base's ends: one batch of
// farm work.  Where one of two sides cannot be simulated, the other one counts twice; a probe
// without any is empty, and its effect, where it has a name, excluded.
Result<std::vector<std::vector<Eigen::Vector3d>>> probe_all(Predictor& predictor,
                                                            const Study& study,
                                                            const std::vector<Probe>& probes);

// Columns side by side.  REQUIRES: at least one, all of one length.
Eigen::MatrixXd stack(const std::vector<Eigen::VectorXd>& columns);

}  // namespace gapfarm
