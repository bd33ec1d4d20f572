#include "tests/truths/engine.h"

#include <algorithm>
#include <cmath>

namespace gapfarm::truths {
namespace {

constexpr double kStanding_m_s = 1e-3;

}  // namespace

Pose pose_before_end(const Path& path, double age_s) {
  const double t_s = path.back().t_s - age_s;
  const auto after = std::find_if(path.begin(), path.end(),
                                  [&](const Sample& sample) { return sample.t_s >= t_s; });
  if (after == path.begin()) return after->X_WR;
  const Sample& a = *(after - 1);
  const double share = (t_s - a.t_s) / (after->t_s - a.t_s);
  const Twist whole = log(between(a.X_WR, after->X_WR));
  return a.X_WR * exp(share * whole);
}

double Motor::step(double dt_s) {
  const double wanted = t_s_ < drive_.on_s ? side_.speed_m_s : 0;
  speed_m_s_ += (wanted - speed_m_s_) * (1 - std::exp(-dt_s / drive_.lag_s));
  t_s_ += dt_s;
  travel_m_ += std::abs(speed_m_s_) * dt_s;
  return travel_m_ >= side_.dead_travel_m ? speed_m_s_ : 0;
}

bool Motor::stands() const { return t_s_ >= drive_.on_s && std::abs(speed_m_s_) < kStanding_m_s; }

}  // namespace gapfarm::truths
