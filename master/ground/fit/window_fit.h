// Fits of the kinematic model to windows of runs: maximum of a heavy-tailed likelihood with the
// tolerances of a well-kept robot file as prior.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/hash.h"
#include "common/robot/robot.h"
#include "common/score/kinematic_body.h"
#include "master/ground/fit/window_set.h"
#include "master/ground/hypotheses.h"
#include "master/infer/settings.h"

namespace gapfarm {

struct FitRow {
  KinematicRow row;
  bool free = false;  // held by plausible_error() in place of the tolerance
};

// Standard deviation of a row's prior, from no data.
double prior_deviation(const FitRow& row);

// Where a row of this name stands; -1: nowhere.
Eigen::Index row_index(const std::vector<FitRow>& rows, std::string_view name);

// Each within its tolerance.
std::vector<FitRow> held_rows(const std::vector<KinematicRow>& rows);

// None within its tolerance.
std::vector<FitRow> all_free(std::vector<FitRow> rows);

// Where they stand as long as no log has its say.
Eigen::VectorXd nominals(const std::vector<FitRow>& rows);

// How a window of poses ended beside a fit: along and across the end's heading, m, and of it, rad.
struct EndedWindow {
  std::size_t length = 0;  // which of the settings' lengths
  double seconds = 0;
  std::size_t run = 0;       // in the log
  Eigen::Vector3d residual;  // as it is
  Eigen::MatrixXd slopes;    // how that changes with the values
};

// What a fit to another log says of the values, and how sure that is.
struct GroundReference : Kinematics {
  Eigen::MatrixXd draws;         // a column each: how far off the values may be, all at once
  std::vector<char> shown = {};  // of each: whether its log knows it better than its prior
  Eigen::MatrixXd covariance;
  std::vector<std::string> units = {};  // of each, of its difference from what it was
  std::vector<EndedWindow> windows = {};

  // With its values where there are none.
  void complete(Kinematics* at) const;
  // Whether there is one of these that it has and its log does not know.
  bool leaves_open(const std::vector<KinematicRow>& rows) const;
};

struct WindowFit {
  std::vector<FitRow> rows;
  Eigen::VectorXd values;
  std::vector<Eigen::Vector3d> scales;     // of each horizon: m, m, rad
  std::vector<Eigen::Vector3d> residuals;  // of each window, in the predicted end's axes, shaped
  std::vector<double> nats;                // log density of each window
  double objective = 0;                    // nats of the windows of its blocks, and the prior
};

// A fit as far as it cannot be had in no time.
struct KeptFit {
  Eigen::VectorXd values;
  std::vector<Eigen::Vector3d> scales;
};

// Fits that were made before, so that what was stopped goes on from there.
class FitMemo {
 public:
  virtual ~FitMemo() = default;
  virtual std::optional<KeptFit> find(const std::string& key) = 0;
  virtual void keep(const std::string& key, const KeptFit& fit) = 0;
};

// Speeds that commands add to what the kinematics make of them, as shares: ahead and of the rims
// when turning, by whether a turn is commanded, by its sign, and by how fast it is.  Empty of
// robots that are not commanded by twists or by two sides.
std::vector<KinematicRow> command_offsets(const GroundRobot& robot);

struct OffsetFit {
  Eigen::VectorXd values;
  Eigen::MatrixXd covariance;
};

inline const std::optional<GroundReference> kNoReference;

// Of a residual in a step of least squares, its scale being s.
inline double window_weight(double r, double s) {
  const double z = r / s;
  return (kWindowTail + 1) / (kWindowTail + z * z) / (s * s);
}

// Log density of a residual: Student's.
double window_nats(double residual, double scale);

// Times and values, into a hash.
inline void add_rows(const std::vector<CommandRow>& rows, Hasher* hasher) {
  for (const CommandRow& row : rows) {
    hasher->add(row.t_s);
    for (const double value : row.values) hasher->add(value);
  }
}

// Hash of all that fits to these windows depend on beside rows and start.
std::string question_of(const GroundRobot& robot, const WindowSet& windows,
                        const std::optional<GroundReference>& reference);

// Not infer::Fitter, which has one scale of the noise: here each length and component has its own,
// and the values' priors go together where a reference is known.
class WindowFitter {
 public:
  // All outlive the fitter.  With a reference its values are in place of the robot's, and rows are
  // held to them by their tolerance and by how sure it is of them.
  WindowFitter(const GroundRobot& robot, const WindowSet& windows,
               const std::optional<GroundReference>& reference = kNoReference,
               FitMemo* memo = nullptr);
  // Not with a reference that would be gone: one that is no optional is made into one on the way.
  WindowFitter(const GroundRobot&, const WindowSet&, const std::optional<GroundReference>&&,
               FitMemo* = nullptr) = delete;

  // Maximum over windows whose block is not in `left_out` (one flag a block; empty: none).
  // Starts at `values` where that has the size of `rows`, else at the rows' nominals; fewer rounds
  // do from near by.
  WindowFit fit(const std::vector<FitRow>& rows, const std::vector<char>& held_out = {},
                const Eigen::VectorXd& values = {}, int rounds = 40) const;
  // The rows' values held, scales fitted.
  WindowFit hold(const std::vector<FitRow>& rows, const Eigen::VectorXd& values,
                 const std::vector<char>& held_out = {}) const;

  // A fit with these residuals (m, m, rad) in place of its own, scales fitted.
  WindowFit judge(WindowFit fit, const std::vector<Eigen::Vector3d>& raw,
                  const std::vector<char>& held_out = {}) const;
  // What makes a window's residual (m, m, rad) one in scales.
  Eigen::Matrix3d whitener(const WindowFit& fit, std::size_t window) const;

  // Of every window, 3 by rows: how its residuals change with the values of a fit.
  std::vector<Eigen::MatrixXd> slopes(const WindowFit& fit) const;
  // Nats that `rows` (those of the fit first, some of them freed, then new ones that stand at
  // `values`) promise beyond a fit with these slopes, to second order.
  double promise(const WindowFit& fit, const std::vector<Eigen::MatrixXd>& fit_slopes,
                 const std::vector<FitRow>& rows, const Eigen::VectorXd& values) const;

  // Values by runs drawn with replacement and blocks of them, one Gauss-Newton step each, a column
  // a draw: what differs from run to run (a clock's offset) is no surer for a run that is long.
  // Free values, or all, that no window shows scatter as their priors do.
  Eigen::MatrixXd draws(const WindowFit& fit, std::uint64_t seed, bool all = false) const;
  // 90 % intervals of them; a row of (lo, hi) for each of the fit's.  With a reference: of how far
  // they are from it, which is not sure either, beside its values.
  Eigen::MatrixX2d intervals(const WindowFit& fit, std::uint64_t seed) const;

  // The values of a fit, and behind them those of command_offsets().  What a robot makes of
  // commands that its kinematics have no word for is its own, and must not pass for another wheel;
  // windows count the less the more their commands change and the robot turns: so much less as
  // makes the residuals likeliest.
  OffsetFit fit_with_offsets(WindowFit fit);

  const WindowSet& windows() const { return windows_; }
  const GroundRobot& robot() const { return robot_; }
  // Of Kinematics: the reference's where there is one.
  const Eigen::Vector2d& origin_m() const {
    return reference_ ? reference_->origin_m : windows_.origin_m;
  }

  // The likeliest WindowSet::least_noise by a fit's residuals, of some; as it is where nothing is
  // stated.
  double likeliest_least_noise(const WindowFit& fit) const;

  // A fit that every run has a share of its travel of its own beside, which makes its windows fit
  // best: a battery, what rollers picked up.
  WindowFit within_runs(WindowFit fit) const;

  // Of the prior of these rows, whose middle are their nominals; with what the reference leaves
  // open.
  Eigen::MatrixXd prior_precision(const std::vector<FitRow>& rows) const;

  // A fit's residuals as they are: m, m, rad.
  std::vector<Eigen::Vector3d> raw_residuals(const WindowFit& fit) const;
  // Of poses; gyros and returns are omitted.
  std::vector<EndedWindow> ended_windows(const WindowFit& fit) const;

 private:
  // Of every window, at each of some values.
  std::vector<std::vector<Eigen::Vector3d>> residuals(
      const std::vector<FitRow>& rows, const std::vector<Eigen::VectorXd>& points) const;
  std::vector<Eigen::Vector3d> residuals(const Kinematics& at, const std::vector<Pose>& ends) const;
  // Of the rows and the reference.
  Kinematics kinematics(const std::vector<FitRow>& rows, const Eigen::VectorXd& values) const;
  void rescale(WindowFit* fit, const std::vector<double>& use) const;
  double score(WindowFit* fit, const std::vector<double>& use) const;
  // The columns of slopes that belong to rows from `first` on.
  void add_slopes(const WindowFit& fit, Eigen::Index first, std::vector<Eigen::MatrixXd>* J) const;
  // Of one step: squares of slopes, and slopes with residuals, weighted.
  struct Equations {
    Eigen::MatrixXd H;
    Eigen::VectorXd g;
  };
  // Of each part of the windows, without priors; of every horizon and component H is so much of
  // what weights make it.
  std::vector<Equations> equations_of(const WindowFit& fit, const std::vector<Eigen::MatrixXd>& J,
                                      const std::vector<double>& use, const std::vector<int>& part,
                                      const std::vector<Eigen::Vector3d>& curvature) const;
  // Of all, priors in.
  Equations normal_equations(const WindowFit& fit, const std::vector<Eigen::MatrixXd>& J,
                             const std::vector<double>& use) const;
  // Of each block; H as the density curves.
  std::vector<Equations> equations_of_blocks(const WindowFit& fit) const {
    return equations_of(fit, slopes(fit), uses({}), windows_.block, curvature_shares(fit));
  }
  // With slopes of a fit nearby.
  bool step(WindowFit* fit, const std::vector<Eigen::MatrixXd>& J, const std::vector<double>& use,
            double* damping) const;
  std::vector<double> uses(const std::vector<char>& held_out) const;
  double prior(const WindowFit& fit) const;
  // Of a row in the reference; -1: it is not there.
  Eigen::Index in_reference(const FitRow& row) const;
  std::vector<Eigen::Vector3d> curvature_shares(const WindowFit& fit) const;
  // Those of `kept`; without scales, their likeliest.
  WindowFit standing(const std::vector<FitRow>& rows, const KeptFit& kept,
                     const std::vector<double>& use) const;
  // A name for this very fit.
  std::string key_of(const std::vector<FitRow>& rows, const std::vector<char>& held_out,
                     const Eigen::VectorXd& start, int rounds) const;

  void shape_by_speed();
  std::vector<Eigen::Matrix3d> noise_shapes(double least) const;
  // A fit with these residuals (`raw`: as they are) under such shapes, with scales of their own;
  // its nats.
  WindowFit shaped(WindowFit fit, const std::vector<Eigen::Vector3d>& raw,
                   const std::vector<Eigen::Matrix3d>& shapes,
                   const std::vector<double>& use) const;
  double nats_shaped(const WindowFit& fit, const std::vector<Eigen::Vector3d>& raw,
                     const std::vector<Eigen::Matrix3d>& shapes) const;
  void take_biases_out(std::vector<Eigen::Vector3d>* r) const;
  void weigh_by_commands(const WindowFit& fit);

  const GroundRobot& robot_;
  const WindowSet& windows_;
  KinematicPaths paths_;
  const std::optional<GroundReference>& reference_;
  FitMemo* memo_;
  std::string question_;  // hash of robot, windows and reference; empty without a memo
  // Where a throttle leaves the speed unsure, the ends of a window err along its way above all;
  // of increments each row may say how sure it is: what residuals are multiplied by, a window;
  // empty: nothing.
  std::vector<Eigen::Matrix3d> shapes_;
};

}  // namespace gapfarm
