// Motions that need not be simulated again.
#pragma once

#include <cstddef>
#include <functional>
#include <initializer_list>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <utility>

#include "worker/sim/robot/motion.h"

namespace gapfarm {

inline std::size_t hash_of(std::initializer_list<double> numbers, std::size_t seed = 0) {
  std::size_t hash = seed;
  for (const double number : numbers) {
    hash = (hash ^ std::hash<double>()(number)) * 0x9e3779b97f4a7c15;
    hash ^= hash >> 32;
  }
  return hash;
}

inline std::size_t hash_of(const Floor& f, std::size_t seed) {
  std::size_t hash =
      hash_of({f.tilt_rad, f.tilt_direction_rad, f.nap_strength, f.nap_direction_rad,
               f.rolling_resistance, f.grain_ratio, f.grain_direction_rad, f.speed_slope_s_m},
              seed);
  for (const FrictionDisc& d : f.patches) hash = hash_of({d.x_m, d.y_m, d.radius_m, d.ratio}, hash);
  return hash;
}

// A simulation is a function of its key alone, so what is found is what it would give.  A key has
// == and hash().  Holds the last motions that were asked for, no more than twice `most`.  Any
// number of threads.
template <class Key>
class MotionMemo {
 public:
  explicit MotionMemo(std::size_t most = 4096) : most_(most) {}

  std::optional<Motion> find(const Key& key) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (const auto found = young_.find(key); found != young_.end()) return found->second;
    const auto found = old_.find(key);
    if (found == old_.end()) return std::nullopt;
    const Motion motion = found->second;
    insert(key, motion);
    return motion;
  }

  void keep(const Key& key, const Motion& motion) {
    const std::lock_guard<std::mutex> lock(mutex_);
    insert(key, motion);
  }

 private:
  struct Hash {
    std::size_t operator()(const Key& key) const { return key.hash(); }
  };

  void insert(const Key& key, const Motion& motion) {
    if (young_.size() >= most_) old_ = std::exchange(young_, {});
    young_.emplace(key, motion);
  }

  std::size_t most_;
  std::mutex mutex_;
  std::unordered_map<Key, Motion, Hash> young_, old_;
};

}  // namespace gapfarm
