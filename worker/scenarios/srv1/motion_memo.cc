#include "worker/scenarios/srv1/motion_memo.h"

#include <functional>
#include <utility>

namespace gapfarm {

// Of what differs among the motions of one log and of the derivatives of its predictions.
std::size_t MotionMemo::Hash::operator()(const MotionKey& key) const {
  std::size_t hash = 0;
  const auto add = [&](double value) {
    hash = (hash ^ std::hash<double>()(value)) * 0x9e3779b97f4a7c15;
    hash ^= hash >> 32;
  };
  const SimSettings& s = key.settings;
  for (const double v : {s.contact_length_m, s.track_gauge_m, s.friction, s.friction_ratio,
                         s.tread_creep, s.com_x_m, s.com_y_m, s.step_rate_hz}) {
    add(v);
  }
  for (const SideDrive& side : {key.drive.left, key.drive.right}) {
    for (const double v : {side.speed_m_s, side.lag_s, side.dead_travel_m}) add(v);
  }
  const Floor& f = key.floor;
  for (const double v : {key.drive.duration_s, f.tilt_rad, f.tilt_direction_rad, f.nap_strength,
                         f.nap_direction_rad, f.rolling_resistance}) {
    add(v);
  }
  for (const FrictionDisc& disc : f.patches) {
    for (const double v : {disc.x_m, disc.y_m, disc.radius_m, disc.ratio}) add(v);
  }
  return hash;
}

std::optional<Motion> MotionMemo::find(const MotionKey& key) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const Motions* motions : {&young_, &old_}) {
    const auto found = motions->find(key);
    if (found != motions->end()) return found->second;
  }
  return std::nullopt;
}

void MotionMemo::keep(const MotionKey& key, const Motion& motion) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (young_.size() >= most_) {
    old_ = std::move(young_);
    young_.clear();
  }
  young_.emplace(key, motion);
}

}  // namespace gapfarm
