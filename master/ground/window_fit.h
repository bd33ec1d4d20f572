// Fits of the kinematic model to windows of runs: maximum of a heavy-tailed likelihood with the
// tolerances of a well-kept robot file as prior.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/robot/robot.h"
#include "common/runs/windows.h"
#include "master/ground/hypotheses.h"

namespace gapfarm {

// Windows of several horizons; their residuals share scales by horizon and component.
struct WindowSet {
  std::vector<CommandedRun> runs;
  std::vector<Trial> trials;
  std::vector<int> horizon;  // of each trial
  std::vector<int> block;    // of each trial: what is left out or resampled together
  int horizons = 0;
  int blocks = 0;
};

// Blocks are runs, or stretches of them where there are fewer than ten.  Windows of robots with a
// throttle begin afresh (common/runs/afresh.h).  Errors: no window fits.
Result<WindowSet> window_set(const GroundRobot& robot, const RunLog& log,
                             const WindowSettings& settings);

struct FitRow {
  KinematicRow row;
  bool free = false;  // no prior
};

struct WindowFit {
  std::vector<FitRow> rows;
  Eigen::VectorXd values;
  std::vector<Eigen::Vector3d> scales;     // of each horizon: m, m, rad
  std::vector<Eigen::Vector3d> residuals;  // of each window, in the predicted end's axes, shaped
  std::vector<double> nats;                // log density of each window
  double objective = 0;                    // nats of the windows of its blocks, and the prior
};

class WindowFitter {
 public:
  // Both outlive the fitter.
  WindowFitter(const GroundRobot& robot, const WindowSet& windows);

  // Maximum over windows whose block is not in `left_out` (one flag a block; empty: none).
  // Starts at `values` where that has the size of `rows`, else at the rows' nominals; fewer rounds
  // do from near by.
  WindowFit fit(const std::vector<FitRow>& rows, const std::vector<char>& left_out = {},
                const Eigen::VectorXd& values = {}, int rounds = 10) const;
  // The rows' values held, scales fitted.
  WindowFit hold(const std::vector<FitRow>& rows, const Eigen::VectorXd& values,
                 const std::vector<char>& left_out = {}) const;

  // Of every window, 3 by rows: how its residuals change with the values of a fit.
  std::vector<Eigen::MatrixXd> slopes(const WindowFit& fit) const;
  // Nats that `rows` (those of the fit first, some of them freed, then new ones that stand at
  // `values`) promise beyond a fit with these slopes, to second order.
  double promise(const WindowFit& fit, const std::vector<Eigen::MatrixXd>& fit_slopes,
                 const std::vector<FitRow>& rows, const Eigen::VectorXd& values) const;

  // 90 % intervals by blocks drawn with replacement, one Gauss-Newton step each; a row of (lo, hi)
  // for each of the fit's.
  Eigen::MatrixX2d intervals(const WindowFit& fit, std::uint64_t seed) const;

  const WindowSet& windows() const { return windows_; }

  // A fit's residuals as they are: m, m, rad.
  std::vector<Eigen::Vector3d> raw_residuals(const WindowFit& fit) const;

 private:
  std::vector<Eigen::Vector3d> residuals(const std::vector<FitRow>& rows,
                                         const Eigen::VectorXd& values) const;
  void rescale(WindowFit* fit, const std::vector<double>& use) const;
  double score(WindowFit* fit, const std::vector<double>& use) const;
  // The column of slopes that belongs to row k.
  void slope(const WindowFit& fit, Eigen::Index k, std::vector<Eigen::MatrixXd>* J) const;
  // Equations of one step: weighted squares of slopes, and of slopes with residuals, priors in.
  void normal_equations(const WindowFit& fit, const std::vector<Eigen::MatrixXd>& J,
                        const std::vector<double>& use, Eigen::MatrixXd* H,
                        Eigen::VectorXd* g) const;
  bool step(WindowFit* fit, const std::vector<double>& use, double* damping) const;
  std::vector<double> uses(const std::vector<char>& left_out) const;

  void shape_by_speed();

  const GroundRobot& robot_;
  const WindowSet& windows_;
  // Where a throttle leaves the speed unsure, the ends of a window err along its way above all:
  // what residuals are multiplied by, a window, so that the way counts less; empty: nothing.
  std::vector<Eigen::Matrix3d> shapes_;
};

}  // namespace gapfarm
