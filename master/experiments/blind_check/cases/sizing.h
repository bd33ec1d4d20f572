// How strong an effect must be to cause a shift of a given size on a planned experiment.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/parameters/table.h"
#include "common/random/stream.h"
#include "common/trials/trial.h"
#include "gapfarm/v1/task.pb.h"

namespace gapfarm {

// Where effects of these names stand in the table; without a name all but second ones of a kind,
// each of which by itself is the first under another name.  Error: there is no such effect.
Result<std::vector<std::size_t>> effects_named(const ParameterTable& table,
                                               const std::vector<std::string>& names = {});

// Where trials start, m, world frame: places of patches and seams are drawn in its middle.
struct Arena {
  double x_lower = 0, x_upper = 2;
  double y_lower = 0, y_upper = 2;
};

// But for this share of the trials on each side.
Arena arena_of(const TrialLog& log, double share);

// One way in which an effect may be there: everything about it but how strong it is.
struct EffectDraw {
  std::size_t effect = 0;       // of the table
  std::vector<double> towards;  // one a strength: share of the way from neutral to its upper bound
                                // (negative: to its lower bound), [-1, 1]
  std::vector<double> rest;     // the parameters after the strengths
};

// Random signs or, for several strengths, a random direction; places in the middle half of the
// arena, directions on the circle, radii of 7 to 15 % of the arena, times of half to twice the
// catalogue's, either of a choice.
EffectDraw draw_effect(const ParameterTable& table, std::size_t effect, const Arena& arena,
                       Stream& stream);

inline constexpr double kFirstStrength = 0.1;  // that is tried

// The effect's parameters in the catalogue's order at `strength` in [0, 1]: 0 is neutral, 1 the
// bound.  Strengths go in proportion; where neutral is above a positive lower bound (a ratio), in
// proportion of the logarithm.
std::vector<double> effect_values(const ParameterTable& table, const EffectDraw& draw,
                                  double strength);

// Mean squared shift of the predicted ends in units of the base's predictive covariance S:
//
//   mean over trials of 1 + d^T S^-1 d / 3         d: from the base's mean to the effect's
//   mean over trials of tr(S^-1 (S' + d d^T)) / 3  S': the effect's covariance  (by_spread)
//
// both in the base's predicted end axes; 1 = nothing.  The second is what the residuals' second
// moment grows by when the base predicts data that have the effect.
// REQUIRES: as many predictions of each, with covariances of the base (and of the effect, when
// by_spread).  None when a covariance of the base is singular.
std::optional<double> size_of(const v1::PredictResult& base, const v1::PredictResult& effect,
                              bool by_spread);

// Finds the strength at which the size is what is wanted, by asking for one evaluation at a time:
//
//   while (!search.done()) search.tell(size_at(search.strength()));
//
// The excess (size - 1) grows about as a power of the strength, so steps are secants in logarithms
// kept within the bracket.
class StrengthSearch {
 public:
  // REQUIRES: target > 1.  Done within a hundredth of the excess.
  explicit StrengthSearch(double target);

  bool done() const { return state_ != State::kSearching; }
  bool found() const { return state_ == State::kFound; }
  double strength() const { return strength_; }  // to try next, or found
  double size() const { return size_; }          // at the last strength tried
  // No value: the simulation did not survive this strength, which is too much then.
  void tell(std::optional<double> size);

 private:
  enum class State { kSearching, kFound, kOutOfReach };
  struct Point {
    double log_strength = 0;
    std::optional<double> log_excess;  // over the target's; none: far below, or too much
  };
  void propose();

  double target_;
  State state_ = State::kSearching;
  double strength_ = kFirstStrength;
  double size_ = 1;
  std::optional<Point> below_, above_;
  unsigned evaluated_ = 0;
};

}  // namespace gapfarm
