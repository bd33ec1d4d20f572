// How well the ends of windows are met, robustly, and what a step of least squares makes of that.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "common/recordings/windows.h"
#include "common/trials/trial.h"

namespace gapfarm {

using WindowEnds = std::vector<Eigen::Vector3d>;    // measured less predicted: m, m, rad
using WindowSlopes = std::vector<Eigen::MatrixXd>;  // of each end: 3 rows, a column a value

// Of each window its length among lengths that count alike, 0 on.  Lengths are octaves; a few
// windows of a length between two horizons (poses are not even) count with the nearest one, or they
// would weigh as much as hundreds.
std::vector<std::size_t> window_lengths(std::span<const double> durations_s);

// Of each window one of at most `count` stretches of the log that are held out in turn: whole runs,
// those in a row together and those with the same commands wherever they are, or of one or two runs
// the log's time in equal parts.  What is alike (repeats, a floor) is held out together, or it
// would be predicted by itself.  REQUIRES: trials that are windows of `runs`.
std::vector<std::size_t> held_out_stretches(std::span<const Trial> windows,
                                            std::span<const CommandedRun> runs, std::size_t count);

// A value, and its standard error by omitting parts of the log in turn.
struct Unsure {
  double value = 0;
  double error = 0;
};

// Student's density of position and heading, with a scale of its own for windows of each length, so
// that no length and neither position nor heading is given up for another.  Each length counts
// alike, one with a handful of windows as much less as these are fewer.  Weights add up to the
// number of windows.
class RobustErrors {
 public:
  // Scales are those of the density of `reference`.  REQUIRES: a reference end a window.
  RobustErrors(std::span<const double> durations_s, const WindowEnds& reference);

  std::size_t windows() const { return length_.size(); }
  double nats(const WindowEnds& ends) const;
  double nats_of(std::size_t window, const Eigen::Vector3d& end) const;
  // Nats a window over those of `baseline`.  `parts`: of each window, the part of the log that it
  // is in (left_out_stretches()): what a run has of its own is in all of it.
  Unsure gain(const WindowEnds& ends, const WindowEnds& baseline,
              std::span<const std::size_t> parts) const;
  // Of each length: how large errors of position and heading are beside those of `baseline`, the
  // logarithm of the ratio of their middles; nothing where a length has only a few windows.  A
  // middle is the mean logarithm of the middle half, which jumps less than a median.
  std::vector<std::array<Unsure, 2>> log_ratios(const WindowEnds& ends, const WindowEnds& baseline,
                                                std::span<const std::size_t> parts) const;
  // Where `ends` are met much more nearly than the scales say, these become those of `ends`: what
  // outliers shows only beside what does not.  Whether any did.
  bool sharpen(const WindowEnds& ends);
  // Position and heading of each length count that much more than now.
  void emphasise(std::span<const std::array<double, 2>> factors);
  std::size_t lengths() const { return scales_.size(); }
  // Of the squares of an end's three residuals, in least squares that approach nats().
  Eigen::Vector3d weights(std::size_t window, const Eigen::Vector3d& end) const;

 private:
  // Of each length: positions' and headings' errors.
  std::vector<std::array<std::vector<double>, 2>> sizes_of(const WindowEnds& ends) const;

  std::vector<std::size_t> length_;            // of each window: which
  std::vector<std::array<double, 2>> use_;     // of a window of each length: position, heading
  std::vector<std::array<double, 2>> scales_;  // of each length: m, rad
};

// H move = g: Gauss and Newton's step away from where the ends are `ends`.
struct NormalEquations {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
};
NormalEquations normal_equations(const RobustErrors& errors, const WindowEnds& ends,
                                 const WindowSlopes& slopes);

// Where H move = g leads from `at` within [0, 1]: a value that would leave stays on its bound, and
// the others move as is best then.
Eigen::VectorXd step_within_bounds(const NormalEquations& equations, const Eigen::VectorXd& at);

// Of each stretch the step, to be taken off the values, that least squares makes of the others.
// `prior` adds to the equations of every step.
std::vector<Eigen::VectorXd> held_out_steps(const RobustErrors& errors, const WindowEnds& ends,
                                            const WindowSlopes& slopes,
                                            const NormalEquations& prior,
                                            std::span<const std::size_t> stretches);

// Ends that were not fitted to: each stretch is predicted by values after that step, to first
// order.
WindowEnds held_out_ends(const RobustErrors& errors, const WindowEnds& ends,
                         const WindowSlopes& slopes, const NormalEquations& prior,
                         std::span<const std::size_t> stretches);

}  // namespace gapfarm
