#include "worker/scenarios/srv1/srv1_motions.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace gapfarm {
namespace {

// Effects on the floor turn the motion by a few mm and mrad, and their harmonics fall quickly:
// eight headings settle almost all, and the check against every second one says when not.
constexpr std::size_t kFewestHeadings = 8;
// m and rad, of half the nodes; the whole set's is far less.
constexpr double kHeadingTolerance = 4e-3;
// Beyond this the motion jumps at some heading, which no interpolation follows: a drag that only
// just leaves the treads their grip.
constexpr double kHeadingJump = 1e-2;
// Motion is nearly linear in the speed that a time-dependent effect changes; where few headings
// will do, as for derivatives, so will few times.
constexpr std::size_t kTimes = 4, kFewTimes = 2;
constexpr double kPathInterval_s = 0.02;

}  // namespace

bool ConditionGroup::few(std::size_t headings) const {
  return trials < (headings > 0 ? headings : kFewestHeadings);
}

Situation reference_situation(const ConditionGroup& group) {
  Situation s;
  s.X_WR.theta = group.heading_rad;
  s.far_away = true;
  s.session_time_s = (group.first_time_s + group.last_time_s) / 2;
  s.last_left = group.last_left;
  s.last_right = group.last_right;
  return s;
}

Pose GroupMotion::end(double heading_rad, double session_time_s) const {
  Eigen::Vector3d d = drive_shift_;
  if (!by_heading_.empty()) d += interpolate_heading(by_heading_, heading_rad);
  if (!by_time_.empty()) d += interpolate_chebyshev(times_, by_time_, session_time_s);
  return reference_ * Pose{d[0], d[1], d[2]};
}

bool GroupMotion::better_alone() const { return better_alone_ || heading_error_ > kHeadingJump; }

Pose GroupMotion::spread_end(const Pose& X_SE) const {
  return X_SE * Pose{drive_shift_[0], drive_shift_[1], drive_shift_[2]};
}

double GroupMotion::distance_from_path(const Eigen::Vector2d& place) const {
  double nearest = place.norm();  // from the start
  for (const Eigen::Vector2d& p : driven_path_) nearest = std::min(nearest, (place - p).norm());
  return nearest;
}

// The steps of simulate_group; each returns false when a simulation did not end well.
class GroupSimulation {
 public:
  GroupSimulation(Srv1Robot& robot, const ConditionGroup& group)
      : robot_(robot), group_(group), situation_(reference_situation(group)) {}

  bool reference(bool with_path) {
    if (!run(situation_, {}, result_.motion.reference_, with_path ? &path_ : nullptr)) return false;
    result_.motion.branches_ = {{1, Pose{}}};
    return true;
  }

  bool headings(std::size_t asked) {
    if (asked == 0) return as_many_headings_as_needed();
    auto& values = result_.motion.by_heading_;
    values.resize(asked);
    const std::vector<double> nodes = heading_nodes(asked);
    for (std::size_t k = 0; k < asked; ++k) {
      Situation s = situation_;
      s.X_WR.theta = wrap_angle(nodes[k]);
      if (!offset(s, {}, values[k])) return false;
    }
    return true;
  }

  // Doubles the headings until every second one predicts the others, or more would have to be
  // simulated than there are trials.
  bool as_many_headings_as_needed() {
    auto& values = result_.motion.by_heading_;
    for (std::size_t n = kFewestHeadings; n <= kMostHeadings; n *= 2) {
      result_.motion.better_alone_ = !values.empty() && n / 2 > group_.trials;
      if (result_.motion.better_alone_) break;
      std::vector<Eigen::Vector3d> finer(n);
      const std::vector<double> nodes = heading_nodes(n);
      for (std::size_t k = 0; k < n; ++k) {
        if (!values.empty() && k % 2 == 0) {
          finer[k] = values[k / 2];
          continue;
        }
        Situation s = situation_;
        s.X_WR.theta = wrap_angle(nodes[k]);
        if (!offset(s, {}, finer[k])) return false;
      }
      values = std::move(finer);
      result_.motion.heading_error_ = half_error(values);
      if (result_.motion.heading_error_ < kHeadingTolerance) break;
    }
    return true;
  }

  bool times(std::size_t count) {
    if (group_.last_time_s <= group_.first_time_s) return true;
    auto& motion = result_.motion;
    motion.times_ = chebyshev_nodes(group_.first_time_s, group_.last_time_s, count);
    for (double time : motion.times_) {
      Situation s = situation_;
      s.session_time_s = time;
      motion.by_time_.emplace_back();
      if (!offset(s, {}, motion.by_time_.back())) return false;
    }
    return true;
  }

  // Mean and covariance over the gains, about the reference.
  bool spread(const std::vector<Gains>& gains, bool sampled) {
    std::vector<Eigen::Vector3d> offsets(gains.size());
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < gains.size(); ++k) {
      if (!offset(situation_, gains[k], offsets[k])) return false;
      mean += offsets[k] / static_cast<double>(gains.size());
    }
    Eigen::Matrix3d cov = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& d : offsets) cov += (d - mean) * (d - mean).transpose();
    const std::size_t divisor = sampled && gains.size() > 1 ? gains.size() - 1 : gains.size();
    if (!gains.empty()) cov /= static_cast<double>(divisor);
    result_.motion.drive_shift_ = mean;
    result_.motion.drive_cov_ = cov;
    return true;
  }

  bool random_drives(const std::vector<DriveBranch>& branches) {
    if (branches.size() < 2) return true;
    auto& to = result_.motion.branches_;
    to.clear();
    for (const DriveBranch& branch : branches) {
      Eigen::Vector3d d = Eigen::Vector3d::Zero();
      const bool eventless = branch.left_gain == 1 && branch.right_gain == 1;
      if (!eventless && !offset(situation_, {branch.left_gain, branch.right_gain}, d)) return false;
      to.push_back({branch.weight, {d[0], d[1], d[2]}});
    }
    return true;
  }

  void stale_readings(const Reading& reading) {
    if (reading.stale_share == 0) return;
    auto& to = result_.motion.branches_;
    for (auto& branch : to) branch.weight *= 1 - reading.stale_share;
    const Pose X_SA = pose_before_end(path_, reading.stale_age_s);
    to.push_back({reading.stale_share, between(result_.motion.reference_, X_SA)});
  }

  void keep_path() {
    for (const MotionSample& s : path_)
      result_.motion.driven_path_.emplace_back(s.X_SB.x, s.X_SB.y);
  }

  GroupResult take() { return std::move(result_); }

 private:
  bool run(const Situation& situation, const Gains& gains, Pose& X_SE,
           std::vector<MotionSample>* path = nullptr) {
    const Motion motion =
        robot_.run(group_.drive, situation, gains, path, path ? kPathInterval_s : 0);
    result_.outcome = to_outcome(motion.outcome);
    X_SE = motion.X_SE;
    result_.motion.facts_.include(facts_of(motion));
    return result_.outcome == v1::OK;
  }

  bool offset(const Situation& situation, const Gains& gains, Eigen::Vector3d& d) {
    Pose X_SE;
    if (!run(situation, gains, X_SE)) return false;
    d = local_difference(result_.motion.reference_, X_SE);
    return true;
  }

  static double half_error(const std::vector<Eigen::Vector3d>& values) {
    const std::vector<double> nodes = heading_nodes(values.size());
    double worst = 0;
    for (std::size_t k = 1; k < values.size(); k += 2) {
      const Eigen::Vector3d predicted = interpolate_heading(values, nodes[k], 2);
      worst = std::max(worst, (predicted - values[k]).cwiseAbs().maxCoeff());
    }
    return worst;
  }

  Srv1Robot& robot_;
  const ConditionGroup& group_;
  Situation situation_;
  GroupResult result_;
  std::vector<MotionSample> path_;
};

GroupResult simulate_group(Srv1Robot& robot, const ConditionGroup& group,
                           const PredictOptions& options, const std::vector<Gains>& draws) {
  GroupSimulation simulation(robot, group);
  const ActiveEffects& effects = robot.effects();
  const Reading reading = effects.reading();
  const bool by_place = effects.motion_context() & kStartPlace;
  bool ok = simulation.reference(by_place || reading.stale_share != 0);
  if (ok && by_place) simulation.keep_path();
  if (ok && (effects.motion_context() & kStartHeading) && !group.few(options.headings)) {
    ok = simulation.headings(options.headings);
  }
  if (ok && (effects.motion_context() & kSessionTime)) {
    ok = simulation.times(options.headings > 0 ? kFewTimes : kTimes);
  }
  if (ok && !options.means_only) {
    const std::vector<Gains> gains =
        draws.empty() ? cubature_points(robot.foreseen_noise()) : draws;
    ok = simulation.spread(gains, !draws.empty()) && simulation.random_drives(effects.branches());
    if (ok) simulation.stale_readings(reading);
  }
  return simulation.take();
}

std::vector<double> heading_nodes(std::size_t n) {
  assert(n % 2 == 0);
  std::vector<double> nodes;
  for (std::size_t k = 0; k < n; ++k) {
    nodes.push_back(2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(n));
  }
  return nodes;
}

Eigen::Vector3d interpolate_heading(std::span<const Eigen::Vector3d> values, double heading_rad,
                                    std::size_t stride) {
  const std::size_t n = values.size() / stride;
  const std::vector<double> nodes = heading_nodes(n);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < n; ++k) {
    const double delta = heading_rad - nodes[k];
    const double half = std::sin(delta / 2);
    if (std::abs(half) < 1e-12) return values[k * stride];
    // The cardinal function sin(n d / 2) / (n tan(d / 2)) of n (even) equispaced nodes.
    const auto count = static_cast<double>(n);
    sum += std::sin(count * delta / 2) * std::cos(delta / 2) / (count * half) * values[k * stride];
  }
  return sum;
}

std::vector<double> chebyshev_nodes(double lower, double upper, std::size_t n) {
  assert(n >= 2);
  std::vector<double> nodes;
  for (std::size_t k = 0; k < n; ++k) {
    const double angle = std::numbers::pi * static_cast<double>(k) / static_cast<double>(n - 1);
    nodes.push_back((lower + upper) / 2 - (upper - lower) / 2 * std::cos(angle));
  }
  return nodes;
}

Eigen::Vector3d interpolate_chebyshev(std::span<const double> nodes,
                                      std::span<const Eigen::Vector3d> values, double at) {
  Eigen::Vector3d above = Eigen::Vector3d::Zero();
  double below = 0;
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    if (at == nodes[k]) return values[k];
    double weight = k % 2 == 0 ? 1 : -1;
    if (k == 0 || k + 1 == nodes.size()) weight /= 2;
    weight /= at - nodes[k];
    above += weight * values[k];
    below += weight;
  }
  return above / below;
}

}  // namespace gapfarm
