// What a drive of a ground robot teaches of its values.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/ranges.h"
#include "common/base/result.h"
#include "common/recordings/run.h"
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

// What a ground robot should drive so that its log shows the values of its kinematics, and how well
// a drive shows them.

struct Wanted {
  std::string name;  // of a value, a KinematicRow
  double width = 0;  // of its 90 % interval that is enough, in the row's unit; 0: none is
};

struct DriveSettings {
  double seconds = 60;
  double length_m = 4, width_m = 4;  // floor for the marker, along and across the first heading
  std::vector<Interval> limits;      // of each channel's command
  std::vector<Wanted> wanted;        // empty: all
  unsigned pool = 150;               // pairs of moves to choose each from
  bool random = false;
  std::uint64_t seed = 1;
};

// How wide 90 % intervals are after so many seconds, one a row, all estimated together.
struct WidthsAt {
  double t_s = 0;
  Eigen::VectorXd widths;
};

struct DrivePlan {
  std::vector<KinematicRow> rows;
  RunLog drive;                  // commands, and as poses where the moves should end (waypoints)
  std::vector<WidthsAt> widths;  // by every move
  // How narrow the wanted could be at best after as many seconds, on the geometric mean, as a share
  // of this plan's: made of any moves of those that were drawn, and if the pose were known exactly
  // between them (best_over_drive()).  1 of random moves, for which it is not asked.
  double best_share = 1;
};

// Chooses moves two at a time: each channel at an end of its limits, half of it or 0, held for half
// a second to four.  Those are taken which, a second, shrink the wanted widths most (the sum of
// their logarithms) and keep the marker on the floor, which it begins in the middle of, also where
// it stops after them.  Where none does, or none that does more than stand, the robot is carried
// back to the middle: another run.  Ends at rest, and as soon as all that is wanted is as narrow as
// asked for.  Pure.  Error: a floor on which no move has room.
// REQUIRES: what is wanted is among kinematic_rows(robot).
Result<DrivePlan> plan_drive(const GroundRobot& robot, const DriveNoise& noise,
                             const DriveSettings& settings);

// The same of runs that were driven, one after another, by their commands and the times of their
// poses: after every `every_s` of driving, and all.
std::vector<WidthsAt> widths_of(const GroundRobot& robot, const DriveNoise& noise,
                                const RunLog& log, double every_s);

// When widths that shrink as those of a plan are, for the geometric mean of the wanted, as narrow
// as `asked`; nothing: never.
std::optional<double> seconds_until(const DrivePlan& plan, const std::vector<Wanted>& wanted,
                                    const Eigen::VectorXd& asked);

}  // namespace gapfarm::plan
