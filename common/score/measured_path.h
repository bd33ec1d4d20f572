#pragma once

#include <iterator>
#include <map>

#include "common/pose/pose.h"

namespace gapfarm {

// Where a run's marker was measured, straight on between.
class MeasuredPath {
 public:
  void add(double t_s, const Pose& X_WM) { poses_[t_s] = X_WM; }

  Pose at(double t_s) const {
    const auto after = poses_.lower_bound(t_s);
    if (after == poses_.begin()) return after->second;
    const auto before = std::prev(after);
    if (after == poses_.end()) return before->second;
    const double share = (t_s - before->first) / (after->first - before->first);
    return before->second * exp(Twist(share * log(between(before->second, after->second))));
  }

 private:
  std::map<double, Pose> poses_;
};

}  // namespace gapfarm
