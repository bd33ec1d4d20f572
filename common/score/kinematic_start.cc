#include "common/score/kinematic_start.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "common/math/algebra.h"

namespace gapfarm {
namespace {

// Creep at which wheels that differ by some percent share that as springs would, and the robot
// still follows within milliseconds.
constexpr double kEvenly = 0.3;

// By four-point Coulomb theory a skid-steer turns as wheels do that stand
// 1 + (friction_ratio wheelbase / wheel_separation)^2 as far apart: the wheelbase of which that is
// what was fitted, wherever the axles are.
std::optional<double> rolling_wheelbase(const GroundRobot& robot, const Kinematics& fitted) {
  const Eigen::Index at = fitted.index("separation");
  if (robot.drive != DriveKind::kSkid || at < 0) return std::nullopt;
  const double ratio = fitted.values[at];
  double separation = 0;
  for (const RobotWheel& w : robot.wheels) separation = std::max(separation, 2 * std::abs(*w.y_m));
  const ControllerKinematics& k = robot.controller;
  const double rolls =
      ratio * k.wheel_separation_m.value_or(separation) * k.wheel_separation_multiplier;
  return separation * std::sqrt(std::max(rolls / separation - 1, 1e-3)) / robot.friction_ratio;
}

// Wheels that say more than three motions can follow never agree quite.  Rigid ones leave it open
// between which of them the robot moves, and it stays wherever it was; where slip grows with force
// it moves as least squares of their speeds, which is what kinematics make of them.
bool wheels_disagree(const GroundRobot& robot) {
  if (!is_holonomic(robot)) return false;
  return std::ranges::count_if(robot.wheels, [](const RobotWheel& w) { return w.driven; }) > 3;
}

bool is_noise(const std::string& key) { return key.find("_noise_") != std::string::npos; }

constexpr double kScan_s = 1;  // of the delay, either way
constexpr double kScanStep_s = 0.05;
constexpr double kHuber = 2;     // robust standard deviations
constexpr int kRounds = 3;       // of weights
constexpr int kIterations = 12;  // of least squares a round
constexpr double kShort = 4;     // times the shortest window

// What is fitted to.
struct Windows {
  const Problem& problem;
  std::vector<Trial> trials;
};

// Residuals of every window in the predicted end's axes.
std::vector<Eigen::Vector3d> residuals(const Windows& windows, const Kinematics& at) {
  const std::vector<Pose> ends =
      kinematic_ends(windows.problem.ground->robot(), windows.problem.runs, windows.trials, at);
  std::vector<Eigen::Vector3d> r;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    r.push_back(local_difference(ends[i], windows.trials[i].X_WE));
  }
  return r;
}

double robust_scale(const std::vector<Eigen::Vector3d>& r, int from, int to) {
  std::vector<double> sizes;
  for (const Eigen::Vector3d& d : r) {
    for (int c = from; c < to; ++c) sizes.push_back(std::abs(d[c]));
  }
  const auto middle = sizes.begin() + static_cast<long>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return std::max(1.4826 * *middle, 1e-6);
}

Eigen::VectorXd weighted(const std::vector<Eigen::Vector3d>& r, const Eigen::VectorXd& weights) {
  Eigen::VectorXd all(weights.size());
  for (std::size_t i = 0; i < r.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(3 * i);
    all.segment<3>(row) = weights.segment<3>(row).cwiseProduct(r[i]);
  }
  return all;
}

// 1 / s.d. of each residual, less beyond kHuber of them.
Eigen::VectorXd weights_of(const std::vector<Eigen::Vector3d>& r) {
  const double m = robust_scale(r, 0, 2);
  const double rad = robust_scale(r, 2, 3);
  Eigen::VectorXd weights(static_cast<Eigen::Index>(3 * r.size()));
  for (std::size_t i = 0; i < r.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const double scale = c < 2 ? m : rad;
      const double size = std::abs(r[i][c]) / scale;
      weights[static_cast<Eigen::Index>(3 * i) + c] =
          std::sqrt(std::min(1.0, kHuber / std::max(size, 1e-9))) / scale;
    }
  }
  return weights;
}

// Below what no value may fall.
Eigen::VectorXd least_values(const Kinematics& of) {
  Eigen::VectorXd least = Eigen::VectorXd::Constant(of.values.size(), -INFINITY);
  for (std::size_t i = 0; i < of.names.size(); ++i) {
    if (is_magnitude(of.names[i])) least[static_cast<Eigen::Index>(i)] = 0;
  }
  return least;
}

void descend(const Windows& windows, const Eigen::VectorXd& weights, Kinematics* at) {
  const auto cost_at = [&](const Kinematics& k) {
    return weighted(residuals(windows, k), weights);
  };
  Eigen::VectorXd r = cost_at(*at);
  double damping = 1e-3;
  const Eigen::Index n = at->values.size();
  const Eigen::VectorXd least = least_values(*at);
  const Eigen::VectorXd most = Eigen::VectorXd::Constant(n, INFINITY);
  for (int it = 0; it < kIterations; ++it) {
    Eigen::MatrixXd J(r.size(), n);
    for (Eigen::Index i = 0; i < n; ++i) {
      Kinematics moved = *at;
      const double step = 1e-4 * std::max(1.0, std::abs(at->values[i]));
      moved.values[i] += step;
      J.col(i) = (cost_at(moved) - r) / step;
    }
    const Eigen::MatrixXd H = J.transpose() * J;
    const Eigen::VectorXd g = J.transpose() * r;
    bool better = false;
    for (int attempt = 0; attempt < 6 && !better; ++attempt) {
      Eigen::MatrixXd damped = H;
      damped.diagonal() += damping * H.diagonal() + Eigen::VectorXd::Constant(n, 1e-9);
      Kinematics moved = *at;
      moved.values = at->values + bounded_minimum(damped, -g, least - at->values, most);
      const Eigen::VectorXd next = cost_at(moved);
      better = next.squaredNorm() < r.squaredNorm();
      if (better) {
        const double gained = 1 - next.squaredNorm() / r.squaredNorm();
        *at = moved;
        r = next;
        damping = std::max(damping / 5, 1e-9);
        if (gained < 1e-5) return;
      } else {
        damping *= 10;
      }
    }
    if (!better) return;
  }
}

// Over long windows a robot turns so far with a file's wrong values that headings are wrong by
// whole turns: what the short ones say is where the fit to all begins.
Windows short_windows(const Problem& problem) {
  double shortest_s = INFINITY;
  for (const Trial& t : problem.log.trials) {
    shortest_s = std::min(shortest_s, t.duration_s.value_or(0));
  }
  Windows some{problem, {}};
  for (const Trial& t : problem.log.trials) {
    if (t.duration_s.value_or(0) <= kShort * shortest_s) some.trials.push_back(t);
  }
  return some;
}

void find_delay(const Windows& windows, Kinematics* at) {
  const Eigen::Index delay = at->index("delay");
  const double own = at->values[delay];
  double least = 0;
  for (double shift = -kScan_s; shift <= kScan_s + 1e-9; shift += kScanStep_s) {
    Kinematics moved = *at;
    moved.values[delay] = own + shift;
    const double scale = robust_scale(residuals(windows, moved), 0, 3);
    if (least == 0 || scale < least) {
      least = scale;
      at->values[delay] = own + shift;
    }
  }
}

}  // namespace

ParameterValues kinematic_start(const Problem& problem) {
  if (!problem.ground || problem.log.trials.empty()) return problem.values;
  const auto fitted = fit_kinematics(problem);
  return fitted ? kinematic_start(problem, *fitted) : problem.values;
}

ParameterValues kinematic_start(const Problem& problem, const Kinematics& fitted) {
  ParameterValues values = problem.values;
  if (!fitted.values.allFinite()) return values;
  const GroundRobot robot = robot_with(problem.ground->robot(), fitted);
  if (!check_robot(robot)) return values;
  const GroundTable there(robot), here(problem.ground->robot());
  const auto wheelbase = rolling_wheelbase(problem.ground->robot(), fitted);
  for (const Gene& gene : problem.genes) {
    const Parameter& row = problem.table()[gene.row];
    const auto now = there.table().find(row.key), before = here.table().find(row.key);
    if (row.key == "wheelbase" && wheelbase) {
      values[gene.row] = std::clamp(*wheelbase, gene.lower, gene.upper);
      continue;
    }
    // Noise is in the robot's proportion.
    if (!now || !before || is_noise(row.key)) continue;
    const double wanted = there.table()[*now].nominal;
    // What kinematics have no word for stays as the config has it.
    if (wanted == here.table()[*before].nominal) continue;
    values[gene.row] = std::clamp(wanted, gene.lower, gene.upper);
  }
  return values;
}

ParameterValues without_slip(const Problem& problem, ParameterValues values) {
  static const std::map<std::string, double, std::less<>> kFirm = {
      {"friction", 1e3},  {"creep", 0},       {"creep_speed", 0},
      {"roller_drag", 0}, {"caster_drag", 0}, {"cross_load", 0}};
  const bool disagree = wheels_disagree(problem.ground->robot());
  for (const Gene& gene : problem.genes) {
    const std::string& key = problem.table()[gene.row].key;
    const auto firm = kFirm.find(key);
    if (firm == kFirm.end()) continue;
    const double wanted = disagree && key == kGroundCreep ? kEvenly : firm->second;
    values[gene.row] = std::clamp(wanted, gene.lower, gene.upper);
  }
  return values;
}

std::vector<bool> identified_by_kinematics(const Problem& problem) {
  Kinematics moved = nominal_kinematics(problem.ground->robot());
  for (double& value : moved.values) value += 1e-3 * (1 + std::abs(value));
  const GroundTable there(robot_with(problem.ground->robot(), moved));
  const GroundTable here(problem.ground->robot());
  std::vector<bool> identified;
  for (const Gene& gene : problem.genes) {
    const std::string& key = problem.table()[gene.row].key;
    const auto now = there.table().find(key), before = here.table().find(key);
    const bool rolls = key == "wheelbase" && problem.ground->robot().drive == DriveKind::kSkid;
    identified.push_back(rolls || (now && before && !is_noise(key) &&
                                   there.table()[*now].nominal != here.table()[*before].nominal));
  }
  return identified;
}

Result<Kinematics> fit_kinematics(const Problem& problem) {
  if (problem.log.trials.empty() || !problem.ground) {
    return Error{"kinematics need windows of logged runs, but there are none"};
  }
  Kinematics best = nominal_kinematics(problem.ground->robot());
  const Windows some = short_windows(problem);
  find_delay(some, &best);
  descend(some, weights_of(residuals(some, best)), &best);
  const Windows all{problem, problem.log.trials};
  for (int round = 0; round < kRounds; ++round) {
    descend(all, weights_of(residuals(all, best)), &best);
  }
  return best;
}

}  // namespace gapfarm
