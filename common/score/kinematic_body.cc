#include "common/score/kinematic_body.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/base/constants.h"
#include "common/math/algebra.h"

namespace gapfarm {
namespace {

// Half of the way over which a wheel passes from one floor to the other (what touches the floor and
// what a tracker errs by): a hard step would have no slope.
constexpr double kBorder_m = 0.02;

// Of a wheel that stands so far beyond the border.
double ratio_beyond(double ratio, double beyond_m) {
  return 1 + (ratio - 1) * std::clamp(0.5 + beyond_m / (2 * kBorder_m), 0.0, 1.0);
}

}  // namespace

const FloorParts::Row* FloorParts::find(std::string_view name) {
  static constexpr Row kRows[] = {
      {"edge_angle", &Parts::edge_rad},    {"edge_offset", &Parts::edge_m},
      {"edge_ratio", &Parts::edge_ratio},  {"patch_x", &Parts::patch_x_m},
      {"patch_y", &Parts::patch_y_m},      {"patch_radius", &Parts::patch_radius_m},
      {"patch_ratio", &Parts::patch_ratio}};
  const auto row = std::ranges::find(kRows, name, &Row::name);
  return row == std::end(kRows) ? nullptr : row;
}

bool FloorParts::has(std::string_view name) { return find(name) != nullptr; }

void FloorParts::put(std::string_view name, double value) {
  const bool known = name.starts_with(kKnown);
  const Row* row = find(known ? name.substr(kKnown.size()) : name);
  Parts& to = known ? known_ : parts_;  // GCC 12 makes a copy of it behind .*
  if (row == nullptr) return;
  to.*row->value = value;
  to.beyond = {std::cos(to.edge_rad), std::sin(to.edge_rad)};
  even_ = parts_.edge_ratio == 1 && parts_.patch_ratio == 1 && known_.edge_ratio == 1 &&
          known_.patch_ratio == 1;
}

double FloorParts::under(const RobotPlace* at, const RobotWheel& wheel) const {
  if (at == nullptr || even_) return 1;
  const Eigen::Vector2d left(-at->ahead[1], at->ahead[0]);
  const Eigen::Vector2d place =
      at->place_m + wheel.x_m.value_or(0) * at->ahead + wheel.y_m.value_or(0) * left - origin_m_;
  double ratio = 1;
  for (const Parts* p : {&parts_, &known_}) {
    if (p->edge_ratio != 1) {
      ratio *= ratio_beyond(p->edge_ratio, p->beyond.dot(place) - p->edge_m);
    }
    if (p->patch_ratio != 1) {
      const Eigen::Vector2d middle(p->patch_x_m, p->patch_y_m);
      ratio *= ratio_beyond(p->patch_ratio, p->patch_radius_m - (place - middle).norm());
    }
  }
  return ratio;
}

double FloorParts::under_wheels(const RobotPlace* at, const GroundRobot& robot, bool driven) const {
  if (at == nullptr || even_) return 1;
  double sum = 0, counted = 0;
  for (const RobotWheel& wheel : robot.wheels) {
    if (driven && !wheel.driven) continue;
    sum += under(at, wheel);
    counted += 1;
  }
  return counted > 0 ? sum / counted : 1;
}

namespace {

constexpr double kLeastLoad = 0.05;      // of an even share: no wheel hangs in the air
constexpr double kLeastTraction = 0.02;  // a robot that hardly moves

}  // namespace

OmniWheels::OmniWheels(const GroundRobot& robot) {
  Eigen::Index n = 0;
  for (const RobotWheel& w : robot.wheels) n += w.driven ? 1 : 0;
  pulled_.resize(n, 3);
  dragged_.resize(n, 3);
  places_m_.resize(2, n);
  Eigen::Index i = 0;
  for (const RobotWheel& w : robot.wheels) {
    if (!w.driven) continue;
    const double e1 = w.heading_rad + w.roller_angle_rad;
    const double c = std::cos(e1), s = std::sin(e1), x = *w.x_m, y = *w.y_m;
    pulled_.row(i) << c, s, x * s - y * c;
    dragged_.row(i) << -s, c, x * c + y * s;
    places_m_.col(i++) << x, y;
  }
  loads_ = Eigen::VectorXd::Constant(n, 1 / static_cast<double>(n));
}

void OmniWheels::load(const Eigen::Vector2d& load_m) {
  const auto n = static_cast<double>(wheels());
  const Eigen::Vector2d middle = places_m_.rowwise().mean();
  const Eigen::MatrixXd about = places_m_.colwise() - middle;
  const Eigen::Vector2d off = solve_symmetric(about * about.transpose(), load_m - middle);
  loads_ = (about.transpose() * off).array() + 1 / n;
  loads_ = loads_.cwiseMax(kLeastLoad / n);
}

Eigen::MatrixXd OmniWheels::inverse(const Eigen::VectorXd& tractions) const {
  if ((tractions.array() == 1).all()) return pseudo_inverse(pulled_);
  const Eigen::VectorXd drags = loads_.array() * (1 / tractions.array().max(kLeastTraction) - 1);
  const Eigen::MatrixXd forces = pulled_.transpose() * loads_.asDiagonal();
  const Eigen::MatrixXd balance =
      forces * pulled_ + dragged_.transpose() * drags.asDiagonal() * dragged_;
  return inverse_of_symmetric(balance) * forces;
}

KinematicBody::KinematicBody(const GroundRobot& robot, const Kinematics& at)
    : robot_(robot),
      load_(robot.com_x_m.value_or(0), robot.com_y_m.value_or(0)),
      asked_(asked_by_channels(robot)),
      floor_(at.origin_m),
      reach_m_(wheel_reach_m(robot)) {
  for (std::size_t i = 0; i < at.names.size(); ++i) {
    put(at.names[i], at.values[static_cast<Eigen::Index>(i)]);
  }
  if (is_holonomic(robot_)) {
    for (const RobotWheel& w : robot_.wheels) roller_cos_.push_back(std::cos(w.roller_angle_rad));
    omni_.emplace(robot_);
    omni_->load(load_);
    tractions_ = Eigen::VectorXd::Constant(omni_->wheels(), traction_);
    inverse_ = omni_->inverse(tractions_);
  }
  separation_ratio_ = separation_;
  separation_ *=
      turning_separation_m(robot_).value_or(robot_.controller.wheel_separation_multiplier);
}

std::optional<double> skid_friction_ratio(const GroundRobot& robot, double separation_ratio) {
  double half = 0, front = 0, rear = 0;
  for (const RobotWheel& w : robot.wheels) {
    if (w.kind == WheelKind::kCaster) continue;
    half = std::max(half, std::abs(*w.y_m));
    front = std::max(front, *w.x_m);
    rear = std::min(rear, *w.x_m);
  }
  if (robot.drive != DriveKind::kSkid || !(front > rear) || half == 0) return std::nullopt;
  const double rolls = separation_ratio * turning_separation_m(robot).value_or(2 * half);
  return std::sqrt(std::max(rolls / (2 * half) - 1, 1e-3)) * 2 * half / (front - rear);
}

GroundRobot KinematicBody::corrected() const {
  GroundRobot robot = robot_;
  if (skids(robot) && separation_ratio_ != 1) {
    robot.friction_ratio =
        skid_friction_ratio(robot, separation_ratio_).value_or(robot.friction_ratio);
  }
  turn_by_separation(&robot);
  const double across = skids(robot) ? 1 : separation_ratio_;
  if (grip_m_s2_) robot.friction = *grip_m_s2_ / kGravity_m_s2 / robot.friction_ratio;
  for (RobotWheel& w : robot.wheels) {
    if (w.kind == WheelKind::kCaster) continue;
    *w.y_m *= across;
    const double side = w.side == WheelSide::kLeft    ? left_
                        : w.side == WheelSide::kRight ? right_
                                                      : travel_ * ahead_;
    *w.radius_m *= side;
  }
  if (is_holonomic(robot)) correct_arms(&robot);
  if (robot.com_x_m) *robot.com_x_m = load_[0];
  if (robot.com_y_m) *robot.com_y_m = load_[1];
  return robot;
}

std::span<const CommandRow> KinematicBody::taken(std::span<const CommandRow> logged, double began_s,
                                                 std::vector<CommandRow>* changed) const {
  if (sag_ == 0 && drift_ == 0 && rate_ == 0 && offsets_.isZero(0)) return logged;
  std::vector<CommandRow>& rows = *changed;
  rows.assign(logged.begin(), logged.end());
  const bool throttled = is_throttled(robot_);
  for (CommandRow& row : rows) {
    add_offsets(&row.values);
    const double left = std::max(0.0, 1 - sag_ * (row.t_s - began_s) / 60);
    for (std::size_t c = 0; c < row.values.size(); ++c) {
      const bool power = robot_.channels[c] != "steering";
      if (power && (!throttled || robot_.channels[c] == "throttle")) row.values[c] *= left;
      if (power && !throttled) row.values[c] /= 1 + rate_;
    }
    row.t_s += (drift_ + rate_) * (row.t_s - began_s);
  }
  return rows;
}

void KinematicBody::add_offsets(std::vector<double>* command) const {
  if (asked_.cols() == 0) return;
  Eigen::Map<Eigen::VectorXd> values(command->data(), asked_.cols());
  const Eigen::Vector2d asked = asked_ * values;
  if (asked[1] == 0) return;
  const Eigen::Vector3d by(asked[0], std::copysign(asked[0], asked[0] * asked[1]),
                           std::abs(asked[1]));
  // Its rows are at right angles.
  values += asked_.transpose() * (offsets_ * by).cwiseQuotient(asked_.rowwise().squaredNorm());
}

FloorForces KinematicBody::forces(const RobotPlace* at) const {
  if (at == nullptr || !is_throttled(robot_)) return {};
  return {kGravity_m_s2 * at->ahead.dot(downhill_),
          kGravity_m_s2 * (1 - floor_.under_wheels(at, robot_, false))};
}

Twist KinematicBody::velocity(std::span<const WheelMotion> wheels, const RobotDrive& drive,
                              const RobotPlace* at) const {
  const Twist v = on_level(wheels, drive, at);
  return at == nullptr ? v : v + on_slope(wheels, v, *at);
}

Twist KinematicBody::on_level(std::span<const WheelMotion> wheels, const RobotDrive& drive,
                              const RobotPlace* at) const {
  if (is_throttled(robot_)) return on_floor(ahead_ * drive.traction_m_s(), drive.curvature());
  if (is_steered(robot_)) {
    return on_floor(ahead_ * floor_.under_wheels(at, robot_, true) * drive.traction_m_s(),
                    drive.curvature());
  }
  if (is_holonomic(robot_)) {
    Eigen::Vector3d twist = Eigen::Vector3d::Zero();
    if (at != nullptr) stand_on(*at);
    Eigen::Index n = 0;
    for (std::size_t i = 0; i < wheels.size(); ++i) {
      const RobotWheel& w = robot_.wheels[i];
      if (!w.driven) continue;
      twist += inverse_.col(n++) * (wheels[i].speed_m_s * roller_cos_[i]);
    }
    return {travel_ * ahead_ * twist[0], travel_ * aside_ * twist[1], travel_ * turn_ * twist[2]};
  }
  double sum[2] = {0, 0};
  double count[2] = {0, 0};
  for (std::size_t i = 0; i < wheels.size(); ++i) {
    if (!robot_.wheels[i].driven) continue;
    const RobotWheel& w = robot_.wheels[i];
    const int side = w.side == WheelSide::kLeft ? 0 : 1;
    sum[side] += floor_.under(at, w) * wheels[i].speed_m_s;
    count[side] += 1;
  }
  const double l = left_ * sum[0] / std::max(count[0], 1.0);
  const double r = right_ * sum[1] / std::max(count[1], 1.0);
  return {(l + r) / 2, 0, (r - l) / separation_};
}

void KinematicBody::stand_on(const RobotPlace& at) const {
  bool changed = false;
  Eigen::Index n = 0;
  for (const RobotWheel& w : robot_.wheels) {
    if (!w.driven) continue;
    const double traction = traction_ * floor_.under(&at, w);
    changed = changed || traction != tractions_[n];
    tractions_[n++] = traction;
  }
  if (changed) inverse_ = omni_->inverse(tractions_);
}

void KinematicBody::put(const std::string& name, double value) {
  RobotThrottle& t = robot_.throttle;
  if (is_magnitude(name)) value = std::abs(value);
  for (RobotWheel& w : robot_.wheels) {
    if (name == radius_row(w)) *w.radius_m *= value;
  }
  if (name == "left") left_ *= value;
  if (name == "right") right_ *= value;
  if (name == "travel" && is_holonomic(robot_)) {
    travel_ = value;
  } else if (name == "travel") {
    left_ *= value;
    right_ *= value;
    ahead_ *= value;
  }
  if (name == "traction") traction_ = value;
  if (name == "load_x") load_[0] = value;
  if (name == "load_y") load_[1] = value;
  floor_.put(name, value);
  if (name == "downhill_x") downhill_[0] = value;
  if (name == "downhill_y") downhill_[1] = value;
  if (name == "separation") separation_ = value;
  if (name == "ahead") ahead_ *= value;
  if (name == "aside") aside_ *= value;
  if (name == "turn") turn_ *= value;
  if (name == "arm") turn_ /= value;
  if (name == "steering_gain") robot_.steering.gain *= value;
  if (name == "steering_left") scale_side(1, value, &robot_.steering);
  if (name == "steering_right") scale_side(-1, value, &robot_.steering);
  if (name == "wheelbase") *robot_.controller.wheelbase_m *= value;
  if (name == "power") t.gain *= value;
  if (name == "dead_band") robot_.motors.dead_band = value;
  if (name == "ramp") {
    robot_.motors.acceleration_limit_m_s2 =
        std::abs(value) > 1e-6 ? std::optional(1 / std::abs(value)) : std::nullopt;
  }
  if (name == "sag") sag_ = value;
  if (name == "drift") drift_ = value;
  if (name == "rate") rate_ = value;
  if (name == "grip") grip_m_s2_ = std::exp(value);
  if (name == "slip_angle") slip_angle_rad_ = value;
  if (name == "grip_shape") grip_shape_ = std::exp(value);
  if (name == "pose_scale") scale_ = value;
  if (name == "aspect") aspect_ = value;
  if (name == "steering_offset") robot_.steering.offset_rad += value;
  if (name == "understeer") robot_.steering.understeer_s2_m2 = value;
  if (name == "gain") t.gain = value;
  if (name == "zero") t.zero = value;
  if (name == "back_emf") t.back_emf = value;
  if (name == "drag") t.drag = value;
  if (name == "coulomb") t.coulomb = value;
  if (name == "cornering") t.cornering = value;
  if (name == "lag") robot_.motors.lag_s = value;
  if (name == "drive_lag") robot_.motors.drive_lag_s = value;
  if (name == "delay") robot_.motors.delay_s = value;
  constexpr const char* kBy[] = {"_by_turn", "_by_side", "_by_turn_speed"};
  for (Eigen::Index k = 0; k < offsets_.cols(); ++k) {
    if (name == std::string("ahead") + kBy[k]) offsets_(0, k) = value;
    if (name == std::string("turn") + kBy[k]) offsets_(1, k) = value;
  }
  if (name == "marker_x") robot_.X_RM.x = value;
  if (name == "marker_y") robot_.X_RM.y = value;
  if (name == "marker_yaw") robot_.X_RM.theta = value;
}

Twist KinematicBody::on_slope(std::span<const WheelMotion> wheels, const Twist& v,
                              const RobotPlace& at) const {
  const Eigen::Vector2d left(-at.ahead[1], at.ahead[0]);
  const Eigen::Vector2d down(at.ahead.dot(downhill_), left.dot(downhill_));
  if (skids(robot_)) {
    const double dragged = std::abs(v[2]) * reach_m_;
    return {dragged * down[0], dragged * down[1], 0};
  }
  if (is_throttled(robot_)) return Twist::Zero();  // forces()
  if (is_steered(robot_)) return {std::abs(v[0]) * down[0], 0, 0};
  double rolled = 0, driven = 0;
  for (std::size_t i = 0; i < wheels.size(); ++i) {
    if (!robot_.wheels[i].driven) continue;
    rolled += std::abs(wheels[i].speed_m_s);
    driven += 1;
  }
  rolled /= std::max(driven, 1.0);
  return {rolled * down[0], is_holonomic(robot_) ? rolled * down[1] : 0, 0};
}

Twist KinematicBody::on_floor(double v, double curvature) const {
  if (!grip_m_s2_) return {v, 0, v * curvature};
  const double asked = v * v * curvature / *grip_m_s2_;
  if (asked == 0) return {v, 0, 0};
  // (1 + |asked|^p)^(-1/p), by what costs half of two powers.
  const double power = std::exp(grip_shape_ * std::log(std::abs(asked)));
  const double held = std::exp(-std::log1p(power) / grip_shape_);
  return {v, -slip_angle_rad_ * v * asked * held, v * curvature * held};
}

// Twists were sent by a controller that goes on believing what it does.
void KinematicBody::turn_by_separation(GroundRobot* robot) const {
  if (separation_ratio_ == 1) return;
  ControllerKinematics& k = robot->controller;
  if (robot->effective_separation_m || robot->command == CommandKind::kTwist) {
    robot->effective_separation_m = separation_;
  } else if (skids(*robot)) {
    k.wheel_separation_multiplier *= separation_ratio_;
  } else if (k.wheel_separation_m) {
    *k.wheel_separation_m *= separation_ratio_;
  }
}

void KinematicBody::correct_arms(GroundRobot* robot) const {
  for (RobotWheel& w : robot->wheels) {
    if (w.kind == WheelKind::kCaster) continue;
    if (w.kind != WheelKind::kMecanum) {
      *w.x_m *= ahead_ / turn_;
      *w.y_m *= ahead_ / turn_;
      continue;
    }
    const double before = std::tan(std::abs(w.roller_angle_rad));
    const double tangent = before * ahead_ / aside_;
    const double arm = std::abs(*w.y_m) + std::abs(*w.x_m) * before;
    const double aside = arm * ahead_ / turn_ - std::abs(*w.x_m) * tangent;
    if (!(tangent > 0 && aside > 0)) return;  // no such wheel
    w.roller_angle_rad = std::copysign(std::atan(tangent), w.roller_angle_rad);
    *w.y_m = std::copysign(aside, *w.y_m);
  }
}

}  // namespace gapfarm
