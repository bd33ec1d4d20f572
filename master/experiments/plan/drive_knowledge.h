// What a drive of a ground robot teaches of its values.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/recordings/windows.h"
#include "common/robot/robot.h"
#include "common/score/kinematic.h"
#include "master/ground/hypotheses.h"

namespace gapfarm::plan {

// Of a drive and its poses, as the scenario's parameters have it.
struct DriveNoise {
  double travel = 0;  // m / sqrt(m) of way
  double turn = 0;    // rad / sqrt(m) of way
  double position_m = 0;
  double heading_rad = 0;
};

// What is known of the marker's pose (in its own axes) and of all rows: a Kalman filter's
// covariance, about the robot as its file has it.  No estimator without a bias is surer (Cramer and
// Rao), and least squares come close where errors are Gaussian.
class Knowledge {
 public:
  // As little as plausible_error() knows of the rows.
  Knowledge(const GroundRobot& robot, const std::vector<KinematicRow>& rows,
            const DriveNoise& noise);

  // A pose that nothing is known of, measured.
  void put_down();
  // A step whose `slopes` by the rows are these (3 by rows, in the axes of its end), and a reading.
  void learn(const Pose& step, const Eigen::MatrixXd& slopes);
  // Of 90 % intervals, one a row.
  Eigen::VectorXd widths() const;
  // The rows' variances as shares of what they were before anything was driven.
  Eigen::VectorXd remaining() const;
  // What steps would tell of the rows, in units of their priors, if the pose were known before the
  // first and after the last: more than within any drive.  A root R of that information, R'R.
  Eigen::MatrixXd most_of(const std::vector<Pose>& steps,
                          const std::vector<Eigen::MatrixXd>& slopes) const;

 private:
  Eigen::Vector3d reading() const;

  DriveNoise noise_;
  double reach_m_;         // of the wheels
  Eigen::VectorXd prior_;  // standard deviations of the rows
  Eigen::MatrixXd P_;
};

// The marker's steps between times, and how they change with the rows.  What slows down by its size
// (lags, drags) stands at least its tolerance above 0: a lag of 0 looks like a delay, and a drag of
// 0 like none.  REQUIRES: times that ascend, at least two.
class Steps {
 public:
  // Both outlive it.
  Steps(const GroundRobot& robot, const std::vector<KinematicRow>& rows);

  std::vector<Pose> between(const CommandedRun& run, const std::vector<double>& times_s) const;
  // Of all steps `at`, 3 by rows, in the axes of their ends.
  std::vector<Eigen::MatrixXd> slopes(const CommandedRun& run, const std::vector<double>& times_s,
                                      const std::vector<Pose>& at) const;

 private:
  std::vector<Pose> steps(const CommandedRun& run, const std::vector<double>& times_s,
                          const Kinematics& kinematics) const;

  const GroundRobot& robot_;
  const std::vector<KinematicRow>& rows_;
  Kinematics nominal_;
};

}  // namespace gapfarm::plan
