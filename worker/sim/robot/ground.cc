#include "worker/sim/robot/ground.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "worker/sim/observe.h"
#include "worker/sim/patch_robot.h"

namespace gapfarm {
namespace {

using std::numbers::pi;

// Rolling and swivelling have some drag; the projection needs a ratio above 0.
constexpr double kLeastRatio = 1e-4;
// A robot that neither is commanded to move nor moves is left alone until it is commanded to.
constexpr double kStillFor_s = 0.1;
constexpr double kStillSpeed_m_s = 1e-4;
constexpr double kStillTurn_rad_s = 1e-3;

// Of a wheel's even share of the weight.
double share_of_load(const GroundWorld& world, const RobotWheel& wheel) {
  if (world.cross_load == 0 || wheel.kind == WheelKind::kCaster) return 1;
  return 1 + world.cross_load * std::copysign(1.0, *wheel.x_m * *wheel.y_m);
}

double share(double drag) { return std::max(drag, kLeastRatio); }

Patch patch_of(const GroundRobot& robot, const RobotWheel& wheel) {
  Patch patch{*wheel.x_m, *wheel.y_m, robot.friction, robot.friction_ratio, false};
  switch (wheel.kind) {
    case WheelKind::kCaster:
      patch.friction = robot.friction * share(robot.caster_drag);
      patch.ratio = 1;
      break;
    case WheelKind::kOmni:
    case WheelKind::kMecanum:
      patch.ratio = share(robot.roller_drag);
      patch.rolls_across = true;
      break;
    case WheelKind::kPlain:
    case WheelKind::kTread:
      if (wheel.driven) break;
      // e1 lies along the axle: the idle wheel holds there and rolls across it.
      patch.friction = robot.friction * robot.friction_ratio;
      patch.ratio = share(robot.rolling_resistance / patch.friction);
      patch.rolls_across = true;
      break;
  }
  return patch;
}

}  // namespace

PatchSettings compile_patches(const GroundRobot& robot, const GroundWorld& world) {
  PatchSettings s;
  for (const RobotWheel& wheel : robot.wheels) {
    Patch patch = patch_of(robot, wheel);
    patch.friction *= share_of_load(world, wheel);
    if (wheel.kind != WheelKind::kTread) {
      s.patches.push_back(patch);
      continue;
    }
    const double half = wheel.contact_length_m.value_or(0) / 2;
    for (const double ahead : {half, -half}) {
      Patch end = patch;
      end.x_m += ahead * std::cos(wheel.heading_rad);
      end.y_m += ahead * std::sin(wheel.heading_rad);
      s.patches.push_back(end);
    }
  }
  s.mass_kg = *robot.mass_kg;
  s.com_x_m = *robot.com_x_m;
  s.com_y_m = *robot.com_y_m;
  s.com_z_m = *robot.com_z_m;
  s.yaw_inertia_kg_m2 = *robot.yaw_inertia_kg_m2;
  s.creep = world.creep;
  s.creep_speed_m_s = world.creep_speed_m_s;
  s.gravity_m_s2 = world.gravity_m_s2;
  s.step_rate_hz = world.step_rate_hz;
  s.solver_iterations = world.solver_iterations;
  return s;
}

void compile_motions(const GroundRobot& robot, std::span<const WheelMotion> wheels,
                     std::vector<PatchMotion>* patches) {
  patches->clear();
  for (std::size_t i = 0; i < wheels.size(); ++i) {
    const RobotWheel& wheel = robot.wheels[i];
    PatchMotion motion{wheels[i].heading_rad, wheels[i].speed_m_s};
    if (wheel.kind == WheelKind::kMecanum) {
      motion.e1_rad += wheel.roller_angle_rad;
      // A roller turns by what the floor moves past its wheel, not past the robot: straight ahead
      // it does not turn at all.
      motion.across_m_s = -motion.speed_m_s * std::sin(wheel.roller_angle_rad);
      motion.speed_m_s *= std::cos(wheel.roller_angle_rad);
    } else if (wheel.kind == WheelKind::kPlain && !wheel.driven) {
      motion.e1_rad += pi / 2;
      motion.speed_m_s = 0;
    } else if (wheel.kind == WheelKind::kCaster) {
      motion.speed_m_s = 0;
    }
    patches->push_back(motion);
    if (wheel.kind == WheelKind::kTread) patches->push_back(motion);
  }
}

GroundSimulator::GroundSimulator(const GroundRobot& robot, const GroundWorld& world,
                                 StepCounter* steps)
    : robot_(robot),
      world_(world),
      patches_(std::make_unique<PatchRobot>(compile_patches(robot, world), steps)) {}
GroundSimulator::~GroundSimulator() = default;

namespace {

// One run from its start to the last time asked for.
class Follower {
 public:
  Follower(const GroundRobot& robot, PatchRobot& patches, double step_s,
           std::span<const CommandRow> commands, const GroundStart& start,
           std::span<const double> times)
      : patches_(patches),
        robot_(robot),
        step_s_(step_s),
        drive_(robot, commands, start.twist.vx_m_s),
        start_s_(start.t_s),
        times_(times) {
    patches_.reset(start.twist);
    now_.t_s = start.t_s;
    const auto driven = std::count_if(robot.wheels.begin(), robot.wheels.end(),
                                      [](const RobotWheel& w) { return w.driven; });
    driven_ = std::max(1.0, static_cast<double>(driven));
  }

  GroundMotion run() {
    take();
    while (next_ < times_.size()) {
      if (stood_s_ >= kStillFor_s) skip();
      if (next_ == times_.size()) break;
      motion_.outcome = advance();
      if (motion_.outcome != MotionOutcome::kOk) {
        motion_.samples.clear();
        break;
      }
      take();
    }
    turn_into_angles(motion_);
    return std::move(motion_);
  }

 private:
  Pose pose() const { return pose_of(patches_.body().getWorldTransform(), patches_.origin()); }
  double time_of(long step) const { return start_s_ + static_cast<double>(step) * step_s_; }

  // Samples up to now.
  void take() {
    for (; next_ < times_.size() && times_[next_] <= now_.t_s; ++next_) {
      const double f =
          now_.t_s > last_.t_s ? (times_[next_] - last_.t_s) / (now_.t_s - last_.t_s) : 1;
      GroundSample s;
      s.t_s = times_[next_];
      s.X_SR = last_.X_SR * exp(f * log(between(last_.X_SR, now_.X_SR)));
      s.travel_m = last_.travel_m + f * (now_.travel_m - last_.travel_m);
      motion_.samples.push_back(f >= 1 ? GroundSample{times_[next_], now_.X_SR, now_.travel_m} : s);
    }
    last_ = now_;
  }

  void skip() {
    const double until = std::min(drive_.next_motion(now_.t_s), times_.back() + step_s_);
    now_.X_SR = pose();
    const long steps = static_cast<long>(std::floor((until - now_.t_s) / step_s_)) - 1;
    if (steps > 0) step_ += steps;
    now_.t_s = time_of(step_);
    last_ = now_;
    for (; next_ < times_.size() && times_[next_] <= now_.t_s; ++next_) {
      motion_.samples.push_back({times_[next_], now_.X_SR, now_.travel_m});
    }
    stood_s_ = 0;
  }

  MotionOutcome advance() {
    const auto wheels = drive_.advance(now_.t_s, step_s_, patches_.twist().omega_rad_s);
    compile_motions(robot_, wheels, &motions_);
    patches_.step(motions_, step_s_);
    ++step_;
    double travel = 0;
    for (const WheelMotion& w : wheels) travel += std::abs(w.speed_m_s);
    now_.t_s = time_of(step_);
    now_.travel_m += travel * step_s_ / driven_;
    // Poses cost; only those round a sample are looked at.
    if (times_[next_] <= now_.t_s + 2 * step_s_) now_.X_SR = pose();
    const btRigidBody& body = patches_.body();
    if (!is_sane(body.getLinearVelocity(), body.getAngularVelocity())) {
      return MotionOutcome::kDiverged;
    }
    const btTransform& X_SB = body.getWorldTransform();
    keep_extremes(X_SB.getBasis(), (X_SB * patches_.origin()).z(), motion_);
    if (has_fallen(X_SB.getBasis())) return MotionOutcome::kFellOver;
    const BodyTwist v = patches_.twist();
    const bool still = drive_.stands() && std::hypot(v.vx_m_s, v.vy_m_s) < kStillSpeed_m_s &&
                       std::abs(v.omega_rad_s) < kStillTurn_rad_s;
    stood_s_ = still ? stood_s_ + step_s_ : 0;
    return MotionOutcome::kOk;
  }

  PatchRobot& patches_;
  const GroundRobot& robot_;
  double step_s_;
  RobotDrive drive_;
  double start_s_;
  std::span<const double> times_;
  std::size_t next_ = 0;
  long step_ = 0;
  double driven_ = 1;  // wheels
  double stood_s_ = 0;
  GroundSample last_, now_;
  std::vector<PatchMotion> motions_;
  GroundMotion motion_;
};

}  // namespace

GroundMotion GroundSimulator::run(std::span<const CommandRow> commands, const GroundStart& start,
                                  std::span<const double> times) {
  return Follower(robot_, *patches_, 1 / world_.step_rate_hz, commands, start, times).run();
}

}  // namespace gapfarm
