// A robust fit of some parameters to all observations, by damped Gauss-Newton steps on simulated
// slopes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "common/pose/pose.h"
#include "master/infer/settings.h"
#include "master/infer/space.h"

namespace gapfarm::infer {

// How observations pull that are far out.  kStudent: the less the farther, by Student's t of
// kStudentTail. Where the noise is known, those within kFar of it pull in full, and others all
// alike, which leads from afar (kHuber), or the less the farther, since near the end they are
// something else, which must not lead away (kRedescending; MM-estimates begin with the one and end
// with the other, Yohai 1987).
enum class Loss { kStudent, kHuber, kRedescending };

// What was measured: a pose an observation, or how far it is from a predicted one, what it varies
// by, and the part of the data that it is held out with.
struct Observations {
  std::vector<Pose> measured;
  // In place of them: of an observation and its predicted pose, in that one's axes.
  std::function<Eigen::Vector3d(std::size_t, const Pose&)> difference = {};
  std::vector<Eigen::Matrix3d>
      whitener;                   // L^-1 of its covariance L L', in the predicted pose's axes
  std::vector<std::size_t> fold;  // from 0
  // Of coordinates that are no parameters: what each adds to the whitened residuals, three rows an
  // observation.
  Eigen::MatrixXd columns = {};
  // Between which the scale of the noise lies, over what the whitener says.
  double least_scale = kLeastNoiseScale, most_scale = INFINITY;
  Loss loss = Loss::kStudent;
  // How often each counts; 0: nothing is learnt from it.  Empty: once.
  std::vector<double> weight = {};
  // Those that are simulated (ascending); the others have no weight.  Empty: all.
  std::vector<std::uint32_t> asked = {};

  std::size_t size() const { return whitener.size(); }
};

struct Fit {
  Eigen::VectorXd u;            // in the space's coordinates
  Eigen::VectorXd z;            // whitened residuals
  Eigen::MatrixXd slopes;       // of z; empty: not known
  bool fresh = false;           // slopes are of this very point
  Eigen::VectorXd differences;  // that slopes were taken over, and will be next
  double scale = 1;             // of the noise, over what the whitener says
  double score = -INFINITY;     // robust, less what the prior costs, nats
  double damping = 0;
  bool settled = false;
};

// On which differences are taken.  One leads on; two, nearer to the point, say what a fit knows:
// the bend of a valley passes for a slope across it in differences of one side.
enum class Sides { kOne, kBoth };

// Of a step from a fit, to second order.
struct Normal {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right;

  // Nats that it gains.
  double gain(const Eigen::VectorXd& delta) const {
    return right.dot(delta) - 0.5 * delta.dot(matrix * delta);
  }
};

class Fitter {
 public:
  // `coarse`: predictions for slopes alone, which are taken between two of them; null: `forward`.
  // REQUIRES: all outlive it.
  Fitter(const Forward& forward, const Observations& observations, Space space,
         const Forward* coarse = nullptr, Sides sides = Sides::kOne);

  // The score at a point; -infinity where it cannot be simulated.
  Result<Fit> start(const Eigen::VectorXd& u) const;
  // The same of several, each in a space of its own, as one batch.  Where `reach` (ascending) is
  // not empty, only those observations are simulated, and the others left as in `elsewhere`,
  // whitened residuals.
  Result<std::vector<Fit>> starts(const std::vector<Eigen::VectorXd>& points,
                                  const std::vector<Space>& spaces,
                                  const std::vector<std::vector<std::uint32_t>>& reach = {},
                                  const Eigen::VectorXd& elsewhere = {}) const;
  // Where the whitened residuals are known to be these; without slopes.
  Fit known(Eigen::VectorXd u, Eigen::VectorXd z) const;
  double promise(const Fit& fit) const;
  // Steps uphill, at most so many.
  Status improve(Fit* fit, int steps) const;
  // Slopes of this very point; the first `known` columns are there.
  Status differentiate(Fit* fit, Eigen::Index known = 0) const;
  Normal normal(const Fit& fit, std::optional<std::size_t> without_fold = std::nullopt) const;
  // After the best step, by the observations of other folds alone, were predictions linear.
  // REQUIRES: slopes.
  Fit linear_step(const Fit& fit, std::optional<std::size_t> without_fold = std::nullopt) const;
  // Log score of every observation with such residuals, under the scale that is best for them.
  std::vector<double> scores(const Eigen::VectorXd& z) const;
  // Log score of every observation from fits to the other folds, linear steps from this one, as
  // unsure as they leave its prediction; 0 of those without weight.
  // REQUIRES: slopes.
  std::vector<double> held_out(const Fit& fit) const;

 private:
  // The best step from `u` within the bounds, no coordinate farther than kLongestStep.
  Eigen::VectorXd bounded_step(const Eigen::VectorXd& u, const Normal& equations) const;
  Eigen::Vector3d residual(std::size_t observation, const Pose& end) const;
  // 0 of what is not asked for.
  Eigen::VectorXd whitened(const std::vector<Pose>& ends) const;
  // What the coordinates without a parameter add there.
  Eigen::VectorXd beside(const Eigen::VectorXd& u) const;
  std::vector<Eigen::Index> columns_of_dimensions() const;
  // Nats of residuals at that scale of the noise; the scale between those allowed that makes it
  // greatest.
  double robust_score(const Eigen::VectorXd& z, double scale) const;
  double best_scale(const Eigen::VectorXd& z, std::optional<std::size_t> without_fold) const;
  void judge(Eigen::VectorXd z, Fit* fit,
             std::optional<std::size_t> without_fold = std::nullopt) const;
  double times(std::size_t i) const {
    return observations_.weight.empty() ? 1 : observations_.weight[i];
  }
  bool learns_from(std::size_t i, std::optional<std::size_t> without_fold) const {
    return times(i) > 0 && (!without_fold || observations_.fold[i] != *without_fold);
  }
  Status move_each(const Forward& forward, const Eigen::VectorXd& from, double share,
                   std::vector<Eigen::Index>* open, Fit* fit) const;
  Status move_both_ways(const Forward& forward, std::vector<Eigen::Index>* open, Fit* fit) const;
  Status step(Fit* fit) const;

  const Forward& forward_;
  const Observations& observations_;
  Space space_;
  const Forward* coarse_;
  Sides sides_;
};

}  // namespace gapfarm::infer
