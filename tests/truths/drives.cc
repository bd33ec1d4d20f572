#include "tests/truths/drives.h"

#include <array>
#include <cmath>
#include <numbers>

namespace gapfarm::truths {
namespace {

struct Command {
  const char* name;
  double left, right;
};
constexpr std::array<Command, 6> kCommands = {{{"forward", 1, 1},
                                               {"backward", -1, -1},
                                               {"turn_ccw", -0.3, 0.3},
                                               {"turn_cw", 0.3, -0.3},
                                               {"wide_ccw", 0.4, 1},
                                               {"wide_cw", 1, 0.4}}};
constexpr std::array<double, 3> kLevels = {0.5, 0.75, 1}, kDurations_s = {0.5, 1, 1.5};
constexpr double kPause_s = 4;

// What draws are for.
enum class Luck : std::uint64_t { kPlan, kDrive, kEffects, kStart, kEnd };

Stream luck(std::uint64_t seed, const PlannedDrive& drive, Luck what) {
  return Stream({seed, Purpose::kTest, drive.commanded.session,
                 static_cast<std::uint64_t>(drive.trial), static_cast<std::uint64_t>(what)});
}

class Driver {
 public:
  Driver(const EngineKind& engine, const Robot& robot, const std::vector<Cause>& causes,
         const Noise& noise, std::uint64_t seed)
      : robot_(robot), causes_(causes), noise_(noise), seed_(seed) {
    Scene scene{robot, {}, 0, 0};
    for (const Cause& cause : causes) {
      if (cause.row->scene) cause.row->scene(cause.values, scene);
      if (cause.row->read) cause.row->read(cause.values, readings_);
    }
    engine_ = engine.make(scene);
  }

  Trial drive(const PlannedDrive& planned) {
    if (planned.commanded.moved) X_WR_ = planned.X_WP;
    Trial trial;
    trial.session = "s" + std::to_string(planned.commanded.session + 1);
    trial.trial = planned.trial;
    trial.t_s = planned.commanded.t_s;
    trial.command = planned.command;
    trial.left = planned.left;
    trial.right = planned.right;
    trial.duration_s = planned.duration_s;
    Stream start = luck(seed_, planned, Luck::kStart), end = luck(seed_, planned, Luck::kEnd);
    trial.X_WS = logged_start(planned, start);
    const Path path = engine_->drive(X_WR_, drive_of(planned));
    X_WR_ = path.back().X_WR;
    const bool stale = end.uniform() < readings_.stale_share;
    trial.X_WE = logged(stale ? pose_before_end(path, readings_.stale_age_s) : X_WR_, end);
    return trial;
  }

 private:
  // The heading of a robot that a hand still holds is another one.
  Pose logged_start(const PlannedDrive& planned, Stream& stream) const {
    Pose X_WS = X_WR_;
    const double chance = stream.uniform(), turn = stream.uniform(-1, 1);
    if (planned.commanded.moved && chance < readings_.unsettled_share) {
      X_WS.theta = wrap_angle(X_WS.theta + turn * readings_.unsettled_angle_rad);
    }
    return logged(X_WS, stream);
  }

  Pose logged(Pose X, Stream& stream) const {
    for (const Cause& cause : causes_) {
      if (cause.row->see) cause.row->see(cause.values, X);
    }
    X.x += noise_.position_m * stream.normal();
    X.y += noise_.position_m * stream.normal();
    X.theta = wrap_angle(X.theta + noise_.heading_rad * stream.normal());
    const double grid = readings_.grid_m;
    if (grid > 0) X = {grid * std::round(X.x / grid), grid * std::round(X.y / grid), X.theta};
    return X;
  }

  Drive drive_of(const PlannedDrive& planned) const {
    CommandedMotion commanded{{planned.left}, {planned.right}, planned.duration_s, robot_.lag_s};
    Stream effects = luck(seed_, planned, Luck::kEffects);
    for (const Cause& cause : causes_) {
      if (cause.row->drive) cause.row->drive(cause.values, planned.commanded, effects, commanded);
    }
    Stream stream = luck(seed_, planned, Luck::kDrive);
    const double both = 1 + noise_.common * stream.normal();
    const double left = both * (1 + noise_.side * stream.normal());
    const double right = both * (1 + noise_.side * stream.normal());
    const auto side = [&](const SideCommand& s, double varied) {
      return SideDrive{robot_.full_speed_m_s * s.duty * s.gain * varied, s.dead_travel_m};
    };
    return {side(commanded.left, left), side(commanded.right, right), commanded.on_s,
            commanded.lag_s};
  }

  Robot robot_;
  const std::vector<Cause>& causes_;
  Noise noise_;
  std::uint64_t seed_;
  Readings readings_;
  std::unique_ptr<Engine> engine_;
  Pose X_WR_;
};

}  // namespace

std::vector<PlannedDrive> draw_plan(const PlanSize& size, std::uint64_t seed) {
  std::vector<PlannedDrive> plan;
  for (unsigned s = 0; s < size.sessions; ++s) {
    double t_s = 0, last_left = 0, last_right = 0;
    for (unsigned i = 0; i < size.trials; ++i) {
      PlannedDrive drive;
      drive.trial = i;
      drive.commanded = {t_s, s, i % size.chain == 0, last_left, last_right};
      Stream stream = luck(seed, drive, Luck::kPlan);
      const Command& command = kCommands[stream.below(kCommands.size())];
      const double level = kLevels[stream.below(kLevels.size())];
      drive.command = command.name;
      drive.left = last_left = level * command.left;
      drive.right = last_right = level * command.right;
      drive.duration_s = kDurations_s[stream.below(kDurations_s.size())];
      drive.X_WP = {size.arena_m * stream.uniform(0.15, 0.85),
                    size.arena_m * stream.uniform(0.15, 0.85),
                    stream.uniform(-std::numbers::pi, std::numbers::pi)};
      t_s += drive.duration_s + kPause_s * stream.uniform(0.75, 1.25);
      plan.push_back(drive);
    }
  }
  return plan;
}

TrialLog drive_log(const EngineKind& engine, const Robot& robot,
                   const std::vector<PlannedDrive>& plan, const std::vector<Cause>& causes,
                   const Noise& noise, std::uint64_t seed) {
  Driver driver(engine, robot, causes, noise, seed);
  TrialLog log;
  for (const PlannedDrive& drive : plan) log.trials.push_back(driver.drive(drive));
  return log;
}

}  // namespace gapfarm::truths
