// Robots with an effect switched on, for the tests of what effects do.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/worker/problems.h"
#include "worker/scenarios/srv1/srv1_robot.h"

namespace gapfarm::tests {

using Changes = std::vector<std::pair<std::string, double>>;

// The nominal robot without noise, and with `changes` to its parameters.
inline ParameterValues noiseless(const Changes& changes = {}) {
  Problem problem;
  problem.values = srv1_table().nominal();
  value(problem, "drive_noise_common") = value(problem, "drive_noise_side") = 0;
  value(problem, "pose_noise_position") = value(problem, "pose_noise_heading") = 1e-5;
  for (const auto& [key, changed] : changes) value(problem, key) = changed;
  return problem.values;
}

inline ActiveEffects effects(const Changes& changes) { return {srv1_table(), noiseless(changes)}; }

inline Pose random_pose(Stream& stream) {
  return {stream.uniform(0, 2), stream.uniform(0, 2), stream.uniform(-3.1, 3.1)};
}

inline const std::vector<CommandSpec>& commands() {
  static const std::vector<CommandSpec> all = default_commands("srv1");
  return all;
}

inline DrivenCommand driven(const std::string& name, double duration_s = 1) {
  for (const CommandSpec& c : commands()) {
    if (c.name == name) return {c.left, c.right, duration_s};
  }
  return {};
}

inline Pose end_of(const Changes& changes, const DrivenCommand& drive,
                   const Situation& situation = {}) {
  return Srv1Robot(noiseless(changes)).run(drive, situation, {}).X_SE;
}

inline double full_speed() { return srv1_table()[row_of(Srv1::kFullSpeed)].nominal; }

// The nominal robot turning while its treads differ by 2 s: rate and sliding speeds of its four
// contacts by Coulomb friction (tests/unit/sim/treads_test.cc has the derivation).
struct CoulombTurn {
  explicit CoulombTurn(double s) {
    const ParameterValues v = srv1_table().nominal();
    half_gauge_m = v[row_of(Srv1::kTrackGauge)] / 2;
    half_length_m = v[row_of(Srv1::kContactLength)] / 2;
    rate_rad_s = s * half_gauge_m / (half_gauge_m * half_gauge_m + half_length_m * half_length_m);
    along_m_s = s - rate_rad_s * half_gauge_m;
    across_m_s = rate_rad_s * half_length_m;
  }
  double half_gauge_m, half_length_m, rate_rad_s;
  double along_m_s, across_m_s;  // a contact slides along and across its tread
  double sliding_2() const { return along_m_s * along_m_s + across_m_s * across_m_s; }
};

}  // namespace gapfarm::tests
