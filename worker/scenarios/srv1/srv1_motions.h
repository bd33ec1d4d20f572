// Motions shared by trials: one simulation a distinct condition, not one a trial.
//
// On a flat floor the motion does not depend on where it starts, so trials with the same duties and
// duration share theirs.  An effect that looks at the heading or at the time makes the motion a
// smooth function of it: that is simulated at nodes and interpolated.  One that looks at the place
// is simulated trial by trial, where the place can matter, and so is a motion that is not smooth,
// and a motion that fewer trials share than there would be nodes.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "worker/scenarios/scenario.h"
#include "worker/scenarios/srv1/srv1_robot.h"

namespace gapfarm {

// What trials of a group share.
struct ConditionGroup {
  DrivenCommand drive;
  int last_left = 0;  // 0 in groups that ignore the last direction
  int last_right = 0;
  double first_time_s = 0;  // of the session, over the group's trials
  double last_time_s = 0;
  std::size_t command = 0;      // of the problem
  std::size_t trials = 0;       // of the log, that share it
  std::size_t first_trial = 0;  // of the log
  double heading_rad = 0;       // of the reference situation
  // Whether trials are too few for their headings to be interpolated between so many; 0: by
  // default.
  bool few(std::size_t headings) const;
};

// The main motion's end, what it depends on, and what may happen instead.
class GroupMotion {
 public:
  // Mean end pose in the start frame for a trial that starts at this heading and time.
  Pose end(double heading_rad, double session_time_s) const;

  // From the main end to each alternative's; the first is the main one itself.
  struct Branch {
    double weight = 1;
    Pose X_EA;
  };
  const std::vector<Branch>& branches() const { return branches_; }
  const Eigen::Matrix3d& drive_cov() const { return drive_cov_; }  // in the end's axes
  const MotionFacts& facts() const { return facts_; }
  const Pose& reference() const { return reference_; }
  // Greatest difference between half the heading nodes' interpolant and the other half, in m and
  // rad taken alike; the error of the whole set is far less where the motion is smooth.
  double heading_error() const { return heading_error_; }
  // Whether it is not, or would take more nodes than there are trials: end() is then off by as much
  // as heading_error(), and a trial is better simulated by itself.
  bool better_alone() const;
  // Mean end over the drive noise of a trial whose motion without noise ends at X_SE.
  Pose spread_end(const Pose& X_SE) const;
  // Distance (m) of a place in the start frame from where the turning centre goes.  Effects of
  // place only; apart from samples 20 ms apart.
  double distance_from_path(const Eigen::Vector2d& place) const;

 private:
  friend class GroupSimulation;
  Pose reference_;
  Eigen::Vector3d drive_shift_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d drive_cov_ = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Vector3d> by_heading_;  // at heading_nodes(), relative to reference_
  std::vector<double> times_;
  std::vector<Eigen::Vector3d> by_time_;  // at times_, relative to reference_
  std::vector<Branch> branches_;
  MotionFacts facts_;
  double heading_error_ = 0;
  bool better_alone_ = false;
  std::vector<Eigen::Vector2d> driven_path_;  // with effects of place only
};

struct GroupResult {
  v1::Outcome outcome = v1::OK;
  GroupMotion motion;
};

// Simulates a group's motion as `options` ask.  `draws` empty: cubature; otherwise these gains'
// sample moments.
GroupResult simulate_group(Srv1Robot& robot, const ConditionGroup& group,
                           const PredictOptions& options, const std::vector<Gains>& draws);

// A situation that no patch of floor reaches.
Situation reference_situation(const ConditionGroup& group);

// Equally spaced headings 2 pi k / n, k = 0..n-1.  REQUIRES: n even.
std::vector<double> heading_nodes(std::size_t n);

// Trigonometric interpolation through values at heading_nodes(n): exact for harmonics below n/2.
// The values may hold every `stride`-th node only.
Eigen::Vector3d interpolate_heading(std::span<const Eigen::Vector3d> values, double heading_rad,
                                    std::size_t stride = 1);

// Chebyshev-Lobatto nodes on [lower, upper].  REQUIRES: n >= 2.
std::vector<double> chebyshev_nodes(double lower, double upper, std::size_t n);

// Polynomial through values at chebyshev_nodes (barycentric form, Berrut and Trefethen 2004).
Eigen::Vector3d interpolate_chebyshev(std::span<const double> nodes,
                                      std::span<const Eigen::Vector3d> values, double at);

}  // namespace gapfarm
