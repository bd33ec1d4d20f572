#include "tests/truths/sizing.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/trials/text/csv.h"

namespace gapfarm::truths {
namespace {

constexpr double kGainStep = 0.02;
// Of the shift beyond nothing.  What happens to single trials grows in steps.
constexpr double kTolerance = 0.02, kTooFar = 0.2;
constexpr int kRounds = 14;

std::string cell_of(const PlannedDrive& d) {
  return d.command + " " + format_double(d.left) + " " + format_double(d.duration_s);
}

// Of one drive by itself, whose sides' speeds are `left` and `right` times what they would be.
Pose end_of(const EngineKind& engine, const Robot& robot, const PlannedDrive& d, double left,
            double right) {
  const Drive drive = {{robot.full_speed_m_s * d.left * left, 0},
                       {robot.full_speed_m_s * d.right * right, 0},
                       d.duration_s,
                       robot.lag_s};
  return engine.make({robot, {}, 0, 0})->drive({}, drive).back().X_WR;
}

Eigen::Vector3d change(const Pose& from, const Pose& to) {
  return {to.x - from.x, to.y - from.y, wrap_angle(to.theta - from.theta)};
}

// Spread of a logged end seen from the logged start.
Eigen::Matrix3d spread_of(const Pose& X_SE, const Eigen::Vector3d& by_left,
                          const Eigen::Vector3d& by_right, const Noise& noise) {
  const Eigen::Vector3d both = by_left + by_right;
  const Eigen::Vector3d by_heading(X_SE.y, -X_SE.x, -1);
  Eigen::Matrix3d s = noise.common * noise.common * both * both.transpose();
  s += noise.side * noise.side * (by_left * by_left.transpose() + by_right * by_right.transpose());
  s += noise.heading_rad * noise.heading_rad * by_heading * by_heading.transpose();
  const double p = noise.position_m, h = noise.heading_rad;
  s.diagonal() += Eigen::Vector3d(2 * p * p, 2 * p * p, h * h);
  return s;
}

}  // namespace

Baseline::Baseline(const EngineKind& engine, const Robot& robot,
                   const std::vector<PlannedDrive>& plan, const Noise& noise)
    : engine_(engine), robot_(robot), plan_(plan) {
  for (const PlannedDrive& drive : plan) {
    Cell& cell = cells_[cell_of(drive)];
    if (cell.information.size() > 0 && cell.information(0, 0) > 0) continue;
    cell.X_SE = end_of(engine, robot, drive, 1, 1);
    const Eigen::Vector3d left =
        change(cell.X_SE, end_of(engine, robot, drive, 1 + kGainStep, 1)) / kGainStep;
    const Eigen::Vector3d right =
        change(cell.X_SE, end_of(engine, robot, drive, 1, 1 + kGainStep)) / kGainStep;
    cell.information = spread_of(cell.X_SE, left, right, noise).inverse();
  }
}

double Baseline::size_of(const std::vector<Cause>& causes, std::uint64_t seed) const {
  const TrialLog log = drive_log(engine_, robot_, plan_, causes, {}, seed);
  double sum = 0;
  for (std::size_t i = 0; i < plan_.size(); ++i) {
    const Cell& cell = cells_.at(cell_of(plan_[i]));
    const Pose X_SE = between(log.trials[i].X_WS, log.trials[i].X_WE);
    const Eigen::Vector3d d = change(cell.X_SE, X_SE);
    sum += 1 + d.dot(cell.information * d) / 3;
  }
  return sum / static_cast<double>(plan_.size());
}

Sized sized_cause(const Baseline& baseline, const EffectRow& row, double wanted, double arena_m,
                  std::uint64_t seed) {
  // Shifts grow with a power of the strength: secants of logarithms within a bracket.
  double lower = 0, upper = 1, strength = 0.1;
  Sized best;
  double best_off = INFINITY;
  for (int round = 0; round < kRounds && best_off > kTolerance; ++round) {
    Sized tried;
    tried.cause = {&row, row.draw(strength, arena_m, Stream({seed, Purpose::kTest, ~0ull}))};
    tried.size = baseline.size_of({tried.cause}, seed);
    const double excess = (tried.size - 1) / (wanted - 1);
    if (std::abs(excess - 1) < best_off) {
      best_off = std::abs(excess - 1);
      best = std::move(tried);
    }
    if (strength == 1 && excess < 1) break;
    (excess < 1 ? lower : upper) = strength;
    const double next = excess > 0 ? strength / std::sqrt(excess) : 2 * strength;
    const double middle = lower > 0 ? std::sqrt(lower * upper) : upper / 4;
    const bool within = next > lower && next < upper;
    strength = within ? next : next >= 1 && upper == 1 ? 1 : middle;
  }
  best.reached = best_off < kTooFar;
  return best;
}

}  // namespace gapfarm::truths
