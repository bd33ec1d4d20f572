// What the readings alone tell: their grid, their noise, and whether some came late.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "common/trials/trial.h"
#include "master/diagnose/residuals.h"

namespace gapfarm {

// Step (m) of the grid that logged positions lie on; 0 when they lie on none.  Steps below 0.2 mm
// are the digits of the file, not a property of the camera.
double quantisation_step(std::span<const Trial> trials);

// Noise of one reading, from two readings of one pose.  Zero (heading and position) when there are
// fewer than 20 gaps, or when the log shares one reading between trials and shows none.
PoseNoise reading_noise(std::span<const ReadingGap> gaps, double quantum_m);

// A share of the end poses read some time before the motion's end, against none.
struct LatencyFit {
  double gain = 0;  // nats over all gaps
  double latency_s = 0;
  double share = 0;
  std::vector<double> weights;  // of each trial: probability that its end pose was late
};

// `end_velocity`: of every trial, just before the motors stop, in the end's axes (m/s, m/s, rad/s).
LatencyFit fit_latency(std::span<const ReadingGap> gaps,
                       std::span<const Eigen::Vector3d> end_velocity, const PoseNoise& noise,
                       std::size_t trials);

}  // namespace gapfarm
