#include "common/robot/robot_drive.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gapfarm {
namespace {

constexpr double kStandingSpeed_m_s = 1e-4;

int index_of(const std::vector<std::string>& names, std::string_view name) {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

double at(const std::vector<double>& commanded, int channel) {
  return channel < 0 ? 0 : commanded[static_cast<std::size_t>(channel)];
}

}  // namespace

CommandTrack::CommandTrack(std::span<const CommandRow> rows, std::size_t channels,
                           std::optional<double> timeout_s)
    : rows_(rows), timeout_s_(timeout_s), mean_(channels, 0.0) {}

const std::vector<double>& CommandTrack::mean(double t_s, double dt_s) {
  std::fill(mean_.begin(), mean_.end(), 0.0);
  if (rows_.empty()) return mean_;
  while (row_ + 1 < rows_.size() && rows_[row_ + 1].t_s <= t_s) ++row_;
  double from = t_s;
  const double until = t_s + dt_s;
  for (std::size_t r = row_; r < rows_.size() && from < until; ++r) {
    const double next =
        r + 1 < rows_.size() ? rows_[r + 1].t_s : std::numeric_limits<double>::infinity();
    double to = std::min(until, next);
    const double end = timeout_s_ ? rows_[r].t_s + *timeout_s_ : to;
    const double share = std::max(0.0, std::min(to, end) - from) / dt_s;
    for (std::size_t c = 0; c < mean_.size(); ++c) mean_[c] += share * rows_[r].values[c];
    from = std::max(from, to);
  }
  return mean_;
}

double CommandTrack::next_change(double t_s, double until_s) const {
  std::size_t r = row_;
  while (r + 1 < rows_.size() && rows_[r + 1].t_s <= t_s) ++r;
  for (; r < rows_.size() && rows_[r].t_s < until_s; ++r) {
    const bool last = r + 1 == rows_.size();
    const double next = last ? std::numeric_limits<double>::infinity() : rows_[r + 1].t_s;
    const double stops = timeout_s_ ? rows_[r].t_s + *timeout_s_ : next;
    if (stops < next && stops > t_s) return std::min(stops, until_s);
    if (!last && (stops < next || rows_[r + 1].values != rows_[r].values)) {
      return std::min(next, until_s);
    }
  }
  return until_s;
}

double CommandTrack::next_motion(double t_s) const {
  for (std::size_t r = row_; r < rows_.size(); ++r) {
    const bool over = r + 1 < rows_.size() && rows_[r + 1].t_s <= t_s;
    const bool moves = std::any_of(rows_[r].values.begin(), rows_[r].values.end(),
                                   [](double value) { return value != 0; });
    if (!over && moves) return std::max(t_s, rows_[r].t_s);
  }
  return std::numeric_limits<double>::infinity();
}

namespace {

// How fast the driven axle of a steered robot rolls, m/s a unit of its commanded speed: its
// controller makes of a twist what wheels as large as it believes would need.
double rolls_a_unit(const GroundRobot& robot) {
  double sum_m = 0, count = 0;
  for (const RobotWheel& wheel : robot.wheels) {
    if (!wheel.driven) continue;
    sum_m += *wheel.radius_m;
    count += 1;
  }
  if (count == 0) return 1;
  const double radius_m = sum_m / count;
  if (robot.command != CommandKind::kTwist) return radius_m;
  return radius_m / robot.controller.wheel_radius_m.value_or(radius_m);
}

}  // namespace

RobotDrive::RobotDrive(const GroundRobot& robot, std::span<const CommandRow> commands,
                       double speed_m_s)
    : robot_(robot),
      track_(commands, robot.channels.size(), robot.motors.command_timeout_s),
      steered_(is_steered(robot)),
      rolls_(steered_ ? rolls_a_unit(robot) : 1),
      wheel_lag_s_(steered_ ? robot.motors.drive_lag_s : robot.motors.lag_s),
      targets_(robot.wheels.size(), 0.0),
      limited_(robot.wheels.size(), 0.0),
      speeds_(robot.wheels.size(), 0.0),
      motions_(robot.wheels.size()),
      throttle_m_s_(speed_m_s) {
  const auto& names = robot.channels;
  for (const RobotWheel& wheel : robot.wheels) {
    const auto channel = wheel.driven ? channel_of(wheel, names) : std::nullopt;
    channel_.push_back(channel ? static_cast<int>(*channel) : -1);
  }
  v_ = index_of(names, "v");
  omega_ = index_of(names, "omega");
  vy_ = index_of(names, "vy");
  throttle_ = index_of(names, "throttle");
  speed_ = index_of(names, "speed");
  steering_ = index_of(names, "steering");
}

double RobotDrive::dead(double value) const {
  const double band = robot_.motors.dead_band;
  if (band <= 0) return value;
  return std::copysign(std::max(0.0, std::abs(value) - band), value);
}

void RobotDrive::wheel_targets(const std::vector<double>& commanded) {
  const bool duties = robot_.command == CommandKind::kDuties;
  const double scale = duties ? robot_.motors.full_speed_rad_s.value_or(1) : 1;
  for (std::size_t i = 0; i < targets_.size(); ++i) {
    targets_[i] = dead(at(commanded, channel_[i])) * scale * *robot_.wheels[i].radius_m;
  }
}

// What the controller makes of a twist, by its own sizes; rolling is by the wheels' own.
void RobotDrive::twist_targets(double v, double omega, double vy) {
  const ControllerKinematics& k = robot_.controller;
  const double half = k.wheel_separation_m.value_or(0) * k.wheel_separation_multiplier / 2;
  for (std::size_t i = 0; i < targets_.size(); ++i) {
    const RobotWheel& w = robot_.wheels[i];
    targets_[i] = 0;
    if (!w.driven) continue;
    const double side =
        w.side == WheelSide::kLeft || (w.side == WheelSide::kNone && *w.y_m > 0) ? 1.0 : -1.0;
    double surface = v - side * omega * half;
    double radius = k.wheel_radius_m.value_or(*w.radius_m);
    radius *= side > 0 ? k.left_wheel_radius_multiplier : k.right_wheel_radius_multiplier;
    if (robot_.drive == DriveKind::kMecanum) {
      const double arm = k.sum_of_robot_center_projection_m.value_or(std::abs(*w.x_m) + half);
      surface = v + std::tan(w.roller_angle_rad) * vy - side * omega * arm;
    } else if (robot_.drive == DriveKind::kOmni) {
      const double turn = *w.x_m * std::sin(w.heading_rad) - *w.y_m * std::cos(w.heading_rad);
      const double arm = k.robot_radius_m.value_or(std::abs(turn));
      surface = v * std::cos(w.heading_rad) + vy * std::sin(w.heading_rad) +
                omega * std::copysign(arm, turn);
    }
    targets_[i] = dead(surface) / radius * *w.radius_m;
  }
}

double RobotDrive::angle_of(double command) const {
  const RobotSteering& s = robot_.steering;
  double angle = command;
  if (!s.table.empty()) {
    const auto after = std::upper_bound(
        s.table.begin(), s.table.end(), command,
        [](double c, const RobotSteering::Point& point) { return c < point.command; });
    if (after == s.table.begin()) {
      angle = s.table.front().angle_rad;
    } else if (after == s.table.end()) {
      angle = s.table.back().angle_rad;
    } else {
      const RobotSteering::Point& a = *(after - 1);
      angle = a.angle_rad + (after->angle_rad - a.angle_rad) * (command - a.command) /
                                (after->command - a.command);
    }
  }
  angle = s.gain * angle + s.offset_rad;
  if (s.limit_rad) angle = std::clamp(angle, -*s.limit_rad, *s.limit_rad);
  return angle;
}

double RobotDrive::steer(double wanted_rad, double dt_s) {
  const double before = steering_rad_;
  const double lag = robot_.motors.lag_s;
  steering_rad_ = wanted_rad;
  if (fresh_) return wanted_rad;
  double mean = wanted_rad;
  if (lag > 0) {
    const double gap = before - wanted_rad, decay = std::exp(-dt_s / lag);
    steering_rad_ += gap * decay;
    mean += gap * (1 - decay) * lag / dt_s;
  }
  if (robot_.steering.rate_limit_rad_s) {
    const double most = *robot_.steering.rate_limit_rad_s * dt_s;
    const double limited = std::clamp(steering_rad_, before - most, before + most);
    if (limited != steering_rad_) mean = (before + limited) / 2;
    steering_rad_ = limited;
  }
  return mean;
}

double RobotDrive::throttle(double commanded, double dt_s, double yaw_rate_rad_s,
                            const FloorForces& floor) {
  const RobotThrottle& t = robot_.throttle;
  const double v = throttle_m_s_;
  const double push = std::max(0.0, std::abs(commanded) - t.zero);
  const double decay = push * t.back_emf + t.drag + t.cornering * std::abs(yaw_rate_rad_s);
  const double drives = std::copysign(push * t.gain, commanded) + floor.downhill;
  double next = (v + dt_s * drives) / (1 + dt_s * decay);
  // Dry friction stops, and does not turn round.
  const double held = std::max(0.0, t.coulomb + floor.resists) * dt_s;
  next = std::abs(next) <= held ? 0 : next - std::copysign(held, next);
  throttle_m_s_ = next;
  return (v + next) / 2;
}

// Every wheel of a steered robot on circles about one centre on the unsteered axle.
void RobotDrive::place_on_curve() {
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    const RobotWheel& w = robot_.wheels[i];
    const double ahead = 1 - curvature_ * *w.y_m;
    const double aside = curvature_ * *w.x_m;
    const double heading = w.steered ? std::atan2(aside, ahead) : 0.0;
    motions_[i].heading_rad = w.heading_rad + heading;
    motions_[i].speed_m_s =
        w.driven ? traction_m_s_ * (w.steered ? std::hypot(ahead, aside) : ahead) : 0;
  }
}

double RobotDrive::follow(std::size_t i, double target, double dt_s) {
  if (fresh_) {
    limited_[i] = speeds_[i] = target;
    return target;
  }
  double wanted = target, input = target;
  if (robot_.motors.acceleration_limit_m_s2) {
    const double most = *robot_.motors.acceleration_limit_m_s2 * dt_s;
    wanted = std::clamp(target, limited_[i] - most, limited_[i] + most);
    // The mean over the step: of the ramp as long as it takes, then of what it reached.
    input =
        wanted + (limited_[i] - wanted) / 2 * std::min(1.0, std::abs(wanted - limited_[i]) / most);
  }
  limited_[i] = wanted;
  const double lag = wheel_lag_s_;
  if (lag <= 0) {
    speeds_[i] = wanted;
    return input;
  }
  if (dt_s != decayed_s_) {
    decayed_s_ = dt_s;
    decay_ = std::exp(-dt_s / lag);
  }
  const double gap = speeds_[i] - input;
  speeds_[i] = input + gap * decay_;
  return input + gap * (1 - decay_) * lag / dt_s;
}

std::span<const WheelMotion> RobotDrive::advance(double t_s, double dt_s, double yaw_rate_rad_s) {
  advance_motors(t_s, dt_s, yaw_rate_rad_s);
  if (steered_) place_on_curve();
  return motions_;
}

std::span<const WheelMotion> RobotDrive::advance_motors(double t_s, double dt_s,
                                                        double yaw_rate_rad_s,
                                                        const FloorForces& floor) {
  const std::vector<double>& commanded = track_.mean(t_s - robot_.motors.delay_s, dt_s);
  if (steered_) {
    double speed = 0;
    bool steered_traction = false;
    double wanted = angle_of(at(commanded, steering_));
    if (is_throttled(robot_)) {
      speed = throttle(dead(at(commanded, throttle_)), dt_s, yaw_rate_rad_s, floor);
    } else if (robot_.command == CommandKind::kTwist) {
      const double v = at(commanded, v_);
      if (v != 0)
        wanted = angle_of(std::atan(at(commanded, omega_) * *robot_.controller.wheelbase_m / v));
      speed = follow(0, dead(v) * rolls_, dt_s);
    } else {
      speed = follow(0, dead(at(commanded, speed_)) * rolls_, dt_s);
      const RobotWheel* driven = driven_wheel(robot_);
      steered_traction = driven != nullptr && driven->steered;
    }
    const double steered_rad = steer(wanted, dt_s);
    // The middle of the unsteered axle is slower than a steered traction wheel.
    if (steered_traction) speed *= std::cos(steered_rad);
    const double slow = 1 + robot_.steering.understeer_s2_m2 * speed * speed;
    if (steered_rad != tangent_of_rad_) {
      tangent_of_rad_ = steered_rad;
      tangent_ = std::tan(steered_rad);
    }
    curvature_ = tangent_ / *robot_.controller.wheelbase_m / slow;
    traction_m_s_ = speed;
    fresh_ = false;
    stands_ = std::abs(speed) < kStandingSpeed_m_s;
    return motions_;
  }
  if (robot_.command == CommandKind::kTwist) {
    twist_targets(at(commanded, v_), at(commanded, omega_), at(commanded, vy_));
  } else {
    wheel_targets(commanded);
  }
  stands_ = true;
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    motions_[i].speed_m_s = follow(i, targets_[i], dt_s);
    motions_[i].heading_rad = robot_.wheels[i].heading_rad;
    stands_ = stands_ && targets_[i] == 0 && std::abs(speeds_[i]) < kStandingSpeed_m_s;
  }
  fresh_ = false;
  return motions_;
}

double RobotDrive::next_change(double t_s, double until_s) const {
  const double delay = robot_.motors.delay_s;
  return track_.next_change(t_s - delay, until_s - delay) + delay;
}

double RobotDrive::next_motion(double t_s) const {
  return track_.next_motion(t_s - robot_.motors.delay_s) + robot_.motors.delay_s;
}

}  // namespace gapfarm
