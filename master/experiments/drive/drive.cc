#include "master/experiments/drive/drive.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/random/stream.h"
#include "master/farm/planned_trials.h"

namespace gapfarm {
namespace {

// Shorter commands are not worth giving, but every run gets each, so that legs correspond.
constexpr double kShortest_s = 0.01;
constexpr double kPause_s = 1;  // between commands of a list

Trial planned_leg(const CommandSpec& command, std::size_t index, double t_s, const Pose& X_WS,
                  const DriveSettings& settings) {
  Trial trial;
  trial.session = "drive";
  trial.trial = static_cast<std::int64_t>(index) + 1;
  trial.t_s = t_s;
  trial.command = command.name;
  trial.left = command.left;
  trial.right = command.right;
  trial.duration_s = command.duration_s;
  trial.X_WS = {X_WS.x - settings.frame_x_m, X_WS.y - settings.frame_y_m, X_WS.theta};
  trial.X_WE = trial.X_WS;
  return trial;
}

// Moves a path along the world's axes, m.
void move_path(double dx_m, double dy_m, std::vector<PathSample>* path) {
  for (PathSample& sample : *path) {
    sample.pose.x += dx_m;
    sample.pose.y += dy_m;
  }
}

Result<CommandSpec> lasting(const ConstantVelocity& model, double seconds,
                            const Eigen::Vector2d& target) {
  if (seconds > kLongestCommand_s) {
    return Error{fmt::format(
        "way-point {:g},{:g} takes {:.0f} s of '{}', more than {:g} s; give way-points between",
        target.x(), target.y(), seconds, model.command.name, kLongestCommand_s)};
  }
  CommandSpec command = model.command;
  command.duration_s = std::max(seconds, kShortest_s);
  return command;
}

Result<CommandSpec> turn_toward(const WaypointPilot& pilot, const Pose& X_WR,
                                const Eigen::Vector2d& target) {
  const double bearing = std::atan2(target.y() - X_WR.y, target.x() - X_WR.x);
  const double error = wrap_angle(bearing - X_WR.theta);
  const ConstantVelocity& turn = error > 0 ? pilot.left : pilot.right;
  return lasting(turn, error / turn.turn_rad_s, target);
}

Result<CommandSpec> go_to(const WaypointPilot& pilot, const Pose& X_WR,
                          const Eigen::Vector2d& target) {
  const double distance = std::hypot(target.x() - X_WR.x, target.y() - X_WR.y);
  return lasting(pilot.forward, distance / pilot.forward.speed_m_s, target);
}

// Appends one leg to every run; `choose` gives each its command.
template <class Choose>
Status drive_leg(const Mover& mover, std::uint64_t leg, std::vector<Pose>& at,
                 std::vector<DrivenRun>& runs, const Choose& choose) {
  std::vector<MoverStart> starts;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    ASSIGN_OR_RETURN(const CommandSpec command, choose(at[r]));
    starts.push_back({at[r], command, r, leg});
  }
  ASSIGN_OR_RETURN(auto legs, mover(starts));
  for (std::size_t r = 0; r < runs.size(); ++r) {
    at[r] = legs[r].path.back().pose;
    runs[r].push_back(std::move(legs[r]));
  }
  return {};
}

bool same_duties(const CommandSpec& a, const CommandSpec& b) {
  return a.name == b.name && a.left == b.left && a.right == b.right;
}

Error unknown(const CommandSpec& command, const std::string& who) {
  return Error{who + " does not know command '" + command.name +
               "' at these duties; log trials of it"};
}

// Poses at constant velocity from X_WS to X_WS X_SE.
Leg smooth_leg(const MoverStart& start, const Pose& X_SE, double interval_s) {
  Leg leg{start.command, {}};
  const double duration_s = start.command.duration_s;
  const Twist twist = log(X_SE);
  const auto steps = std::max(1.0, std::ceil(duration_s / interval_s));
  for (int i = 0; i <= static_cast<int>(steps); ++i) {
    const double share = i / steps;
    leg.path.push_back({share * duration_s, start.X_WS * exp(share * twist)});
  }
  return leg;
}

// Of the same name and duties, the one whose duration is closest.
const CommandMotion* closest(const std::vector<CommandMotion>& motions,
                             const CommandSpec& command) {
  const CommandMotion* found = nullptr;
  for (const CommandMotion& motion : motions) {
    if (!same_duties(motion.command, command)) continue;
    const auto off = [&](const CommandMotion& m) {
      return std::abs(m.command.duration_s - command.duration_s);
    };
    if (found == nullptr || off(motion) < off(*found)) found = &motion;
  }
  return found;
}

v1::Task leg_task(const MoverStart& start, const DriveSettings& settings) {
  v1::Task task;
  v1::SimulateTask* simulate = task.mutable_simulate();
  simulate->mutable_stream()->set_run_seed(settings.seed);
  simulate->mutable_stream()->set_generation(start.leg);
  simulate->mutable_stream()->set_birth_id(start.run);
  simulate->set_path_interval(settings.interval_s);
  v1::PlannedTrial* planned = simulate->add_plan();
  planned->set_moved(true);
  *planned->mutable_trial() =
      to_proto(planned_leg(start.command, start.leg, 0, start.X_WS, settings));
  return task;
}

}  // namespace

Result<std::vector<ConstantVelocity>> nominal_velocities(Farm& farm, const Problem& problem) {
  std::vector<v1::Task> tasks;
  for (const CommandSpec& command : problem.commands) {
    v1::Task task;
    v1::TraceTask* trace = task.mutable_trace();
    *trace->mutable_command() = to_proto(command);
    trace->set_interval(0.05);
    tasks.push_back(std::move(task));
  }
  ASSIGN_OR_RETURN(const auto results, farm.run(farm.add_problem(to_proto(problem)), tasks));
  std::vector<ConstantVelocity> models;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const v1::TaskResult& result = results[i];
    if (result.outcome() != v1::OK || result.trace().samples_size() == 0) {
      return Error{"command '" + problem.commands[i].name + "' ends with " +
                   v1::Outcome_Name(result.outcome()) + " in this model " + result.message()};
    }
    if (!(problem.commands[i].duration_s > 0)) continue;
    const auto& samples = result.trace().samples();
    const Twist twist = log(from_proto(samples[samples.size() - 1].pose()));
    ConstantVelocity model;
    model.command = problem.commands[i];
    model.speed_m_s = twist[0] / model.command.duration_s;
    model.turn_rad_s = twist[2] / model.command.duration_s;
    models.push_back(model);
  }
  return models;
}

Result<std::vector<DrivenRun>> drive_commands(Farm& farm, const Problem& problem, const Pose& X_WS,
                                              const std::vector<CommandSpec>& commands,
                                              unsigned runs, const DriveSettings& settings) {
  std::vector<v1::PlannedTrial> plan(commands.size());
  double t_s = 0;
  for (std::size_t c = 0; c < commands.size(); ++c) {
    plan[c].set_moved(c == 0);
    *plan[c].mutable_trial() = to_proto(planned_leg(commands[c], c, t_s, X_WS, settings));
    t_s += commands[c].duration_s + kPause_s;
  }
  ASSIGN_OR_RETURN(
      const auto results,
      farm.run(farm.add_problem(to_proto(problem)),
               simulate_tasks(std::vector(runs, plan), {}, settings.seed, settings.interval_s)));
  std::vector<DrivenRun> driven;
  for (const v1::TaskResult& result : results) {
    RETURN_IF_ERROR(ended_well(result, "a run"));
    DrivenRun run;
    for (std::size_t c = 0; c < commands.size(); ++c) {
      run.push_back({commands[c], from_proto(result.simulate().trials(static_cast<int>(c))).path});
      move_path(settings.frame_x_m, settings.frame_y_m, &run.back().path);
    }
    driven.push_back(std::move(run));
  }
  return driven;
}

Result<std::vector<DrivenRun>> drive_commands(const Mover& mover, const Pose& X_WS,
                                              const std::vector<CommandSpec>& commands,
                                              unsigned runs) {
  std::vector<DrivenRun> driven(runs);
  std::vector<Pose> at(runs, X_WS);
  for (std::size_t c = 0; c < commands.size(); ++c) {
    const auto given = [&](const Pose&) -> Result<CommandSpec> { return commands[c]; };
    RETURN_IF_ERROR(drive_leg(mover, c, at, driven, given));
  }
  return driven;
}

Result<WaypointPilot> make_pilot(std::span<const ConstantVelocity> models) {
  // Metres against radians as the corner of a robot sees them.
  constexpr double kHalfRobot_m = 0.05;
  using Model = ConstantVelocity;
  const auto turn = [](const Model& m) { return kHalfRobot_m * m.turn_rad_s; };
  const auto ahead = [&](const Model& m) { return m.speed_m_s - 10 * std::abs(turn(m)); };
  const auto left = [&](const Model& m) { return turn(m) - std::abs(m.speed_m_s); };
  const auto right = [&](const Model& m) { return -turn(m) - std::abs(m.speed_m_s); };
  bool has_all = true;
  const auto best = [&](const auto& suits) {
    const auto found = std::ranges::max_element(models, {}, suits);
    const bool does = found != models.end() && suits(*found) > 0;
    has_all = has_all && does;
    return does ? *found : Model{};
  };
  const WaypointPilot pilot{best(ahead), best(left), best(right)};
  if (!has_all) {
    return Error{
        "way-points take a command that goes ahead and one each that turns left and right on the "
        "spot; the model's commands have none"};
  }
  return pilot;
}

Result<std::vector<DrivenRun>> drive_waypoints(const Mover& mover, const WaypointPilot& pilot,
                                               const Pose& X_WS,
                                               std::span<const Eigen::Vector2d> targets,
                                               unsigned runs) {
  std::vector<DrivenRun> driven(runs);
  std::vector<Pose> at(runs, X_WS);
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const auto turn = [&](const Pose& X_WR) { return turn_toward(pilot, X_WR, targets[i]); };
    const auto go = [&](const Pose& X_WR) { return go_to(pilot, X_WR, targets[i]); };
    RETURN_IF_ERROR(drive_leg(mover, 2 * i, at, driven, turn));
    RETURN_IF_ERROR(drive_leg(mover, 2 * i + 1, at, driven, go));
  }
  return driven;
}

Mover simulated_mover(Farm& farm, const Problem& problem, const DriveSettings& settings) {
  Problem bare = problem;
  bare.log = {};
  bare.genes.clear();
  // The pilot's camera is not what varies: the true pose is asked for.
  for (const char* key : {"pose_noise_position", "pose_noise_heading"}) {
    if (const auto row = bare.table().find(key)) bare.values[*row] = bare.table()[*row].lower;
  }
  return [&farm, settings, hash = farm.add_problem(to_proto(bare))](
             std::span<const MoverStart> starts) -> Result<std::vector<Leg>> {
    const auto tasks = mapped(starts, [&](const MoverStart& s) { return leg_task(s, settings); });
    ASSIGN_OR_RETURN(const auto results, farm.run(hash, tasks));
    std::vector<Leg> legs;
    for (std::size_t i = 0; i < starts.size(); ++i) {
      const v1::TaskResult& result = results[i];
      if (result.outcome() != v1::OK || result.simulate().trials_size() != 1) {
        return Error{"command '" + starts[i].command.name + "' ended with " +
                     v1::Outcome_Name(result.outcome()) + " " + result.message()};
      }
      legs.push_back({starts[i].command, from_proto(result.simulate().trials(0)).path});
      move_path(settings.frame_x_m, settings.frame_y_m, &legs.back().path);
    }
    return legs;
  };
}

Mover constant_velocity_mover(std::vector<ConstantVelocity> models, const DriveSettings& settings) {
  return [models, settings](std::span<const MoverStart> starts) -> Result<std::vector<Leg>> {
    std::vector<Leg> legs;
    for (const MoverStart& start : starts) {
      const auto model = std::ranges::find_if(
          models, [&](const auto& m) { return same_duties(m.command, start.command); });
      if (model == models.end()) return unknown(start.command, "the constant-velocity model");
      const double t = start.command.duration_s;
      const Pose X_SE = exp({model->speed_m_s * t, 0, model->turn_rad_s * t});
      legs.push_back(smooth_leg(start, X_SE, settings.interval_s));
    }
    return legs;
  };
}

Mover mined_mover(const MotionModel& model, const DriveSettings& settings) {
  const auto motions = filtered(model.commands(), [](const CommandMotion& motion) {
    return motion.trials >= MotionModelSettings{}.least_trials;
  });
  return [motions, settings](std::span<const MoverStart> starts) -> Result<std::vector<Leg>> {
    std::vector<Leg> legs;
    for (const MoverStart& start : starts) {
      const CommandMotion* motion = closest(motions, start.command);
      if (motion == nullptr) return unknown(start.command, "the mined motion model");
      const double share = start.command.duration_s / motion->command.duration_s;
      const Eigen::Matrix3d covariance = share * motion->motion.covariance;
      Stream stream({settings.seed, Purpose::kSimulation, start.leg, start.run});
      const Eigen::Vector3d draw(stream.normal(), stream.normal(), stream.normal());
      const Eigen::Vector3d off = covariance.llt().matrixL() * draw;
      const Pose mean = exp(share * log(motion->motion.mean));
      const Pose X_SE{mean.x + off.x(), mean.y + off.y(), wrap_angle(mean.theta + off.z())};
      legs.push_back(smooth_leg(start, X_SE, settings.interval_s));
    }
    return legs;
  };
}

}  // namespace gapfarm
