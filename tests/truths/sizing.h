// How large an effect is on an experiment, and how strong it must be to be that large.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tests/truths/drives.h"

namespace gapfarm::truths {

// What a robot without any effect does, by command, duties and duration: the mean of its ends, seen
// from the logged start, and their spread.
class Baseline {
 public:
  Baseline(const EngineKind& engine, const Robot& robot, const std::vector<PlannedDrive>& plan,
           const Noise& noise);

  // Mean squared shift of the ends by the causes, in units of the spread S (docs/diagnosis.md):
  //
  //   mean over trials of 1 + d^T S^-1 d / 3     d: from the end without them to the one with them
  //
  // without noise.  1: nothing.
  double size_of(const std::vector<Cause>& causes, std::uint64_t seed) const;

 private:
  struct Cell {
    Pose X_SE;
    Eigen::Matrix3d information;  // S^-1
  };

  EngineKind engine_;
  Robot robot_;
  std::vector<PlannedDrive> plan_;
  std::map<std::string, Cell> cells_;
};

struct Sized {
  Cause cause;
  double size = 1;
  bool reached = false;  // false: the strongest that there is has `size`
};

// The effect at the strength that has the size `wanted`, drawn by `seed`.
Sized sized_cause(const Baseline& baseline, const EffectRow& row, double wanted, double arena_m,
                  std::uint64_t seed);

}  // namespace gapfarm::truths
