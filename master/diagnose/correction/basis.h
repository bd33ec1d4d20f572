// One term's regression: Gaussian processes on inducing points, all that is needed to fit it to any
// of a log's folds.
//
// The shifts at the centres c have the prior covariance a^2 k(c, c), k being the term's bumps; what
// a shift is elsewhere follows from these (subset of regressors; Quinonero-Candela and Rasmussen
// 2005).  An edge is a row of bumps from there to where the log's readings end, all of one height.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "common/base/ranges.h"
#include "common/residual/field.h"
#include "master/diagnose/correction/fit.h"

namespace gapfarm {

struct ResidualShape {
  ResidualFrame frame = ResidualFrame::kRobot;
  bool by_drive = true;
  bool by_command = true;  // shifts of its own for each command
  bool edge = false;       // nothing, and one shift for all beyond an edge, wherever that lies
  std::vector<std::size_t> covariates;
  // Length scales to choose from: of what has a range in the log a share of it; of headings and of
  // what is or is not so, as they are.
  std::vector<std::vector<double>> lengths;  // one a covariate each
};

// Where commands repeat every command has its own shifts; where they do not, duties are covariates.
std::vector<ResidualShape> residual_shapes(bool free_commands);

class ResidualBasis {
 public:
  // Centres lie among the trials that are `seen`; an edge where it explains most of their
  // `residuals`.  `lengths`: some of the shape's.
  ResidualBasis(const ResidualData& data, const Residuals& residuals, const std::vector<bool>& seen,
                const ResidualShape& shape, const std::vector<double>& lengths);

  bool useful() const { return useful_; }

  // A term fitted to the residuals of the trials with learn[i], prior standard deviation of the
  // shifts `amplitude` times the noise's.
  ResidualTerm fit(const Residuals& residuals, const std::vector<bool>& learn,
                   double amplitude) const;
  // The same, of which only the shifts (one a trial, in the predicted ends' axes) are wanted; those
  // for several amplitudes cost little more than for one.
  std::vector<Residuals> shifts(const Residuals& residuals, const std::vector<bool>& learn,
                                const std::vector<double>& amplitudes,
                                const std::vector<bool>& wanted) const;
  Residuals shifts_of(const ResidualTerm& term) const;

 private:
  struct Place {
    std::size_t trial = 0;
    Pose X_WR;
  };
  struct Lesson {
    std::vector<std::size_t> trials;
    Residuals whitened;
    Eigen::MatrixXd matrix;
    bool outliers = false;  // some pull no harder than the farthest
  };
  std::vector<Place> places(const std::vector<bool>& seen) const;
  void place_lengths(const std::vector<Place>& among, const std::vector<double>& shares);
  void place_centres(const std::vector<Place>& among);
  void place_edge(const std::vector<Place>& among, const Residuals& residuals,
                  const std::vector<bool>& seen);
  void set_units();
  void set_features();
  double value(std::size_t covariate, const Place& place) const;
  Interval range_of(std::size_t covariate, const std::vector<Place>& among) const;
  Lesson lesson_of(std::size_t group, const Residuals& residuals,
                   const std::vector<bool>& learn) const;
  Eigen::VectorXd pull_of(const Lesson& lesson, const Eigen::MatrixXd& weights) const;
  Eigen::MatrixXd solve(const Lesson& lesson, double amplitude) const;
  Eigen::Vector3d shift(std::size_t trial, const Eigen::MatrixXd& weights) const;
  Eigen::Index components() const { return term_.frame == ResidualFrame::kReadings ? 2 : 3; }

  const ResidualData& data_;
  bool useful_ = true;
  ResidualTerm term_;                               // without weights
  std::vector<std::string> groups_;                 // commands, or one of all
  std::vector<std::vector<std::size_t>> of_group_;  // trials
  std::vector<Eigen::VectorXd> features_;           // of every trial
  std::vector<Eigen::Matrix3d> axes_;               // whitened, of every trial
  std::vector<Eigen::Matrix3d> turned_;             // residual_axes() of every trial
  Eigen::MatrixXd kernel_;                          // k(c, c)
  bool tied_ = false;                               // all centres have one and the same shift
  Eigen::Vector3d unit_;                            // noise of each component, by drive
};

}  // namespace gapfarm
