#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/base/try.h"
#include "common/random/stream.h"
#include "master/experiments/drive/drive.h"

namespace gapfarm {
namespace {

Error unknown(const CommandSpec& command, const std::string& who) {
  return Error{who + " does not know command '" + command.name +
               "' at these duties; log trials of it"};
}

// Poses at constant velocity from X_WS to X_WS X_SE.
Leg smooth_leg(const Mover::Start& start, const Pose& X_SE, double interval_s) {
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

class ConstantVelocityMover final : public Mover {
 public:
  ConstantVelocityMover(std::vector<ConstantVelocity> models, const DriveSettings& settings)
      : models_(std::move(models)), settings_(settings) {}

  Result<std::vector<Leg>> drive(std::span<const Start> starts) const override {
    std::vector<Leg> legs;
    for (const Start& start : starts) {
      const auto model = std::find_if(models_.begin(), models_.end(), [&](const auto& m) {
        const CommandSpec& c = m.command;
        return c.name == start.command.name && c.left == start.command.left &&
               c.right == start.command.right;
      });
      if (model == models_.end()) return unknown(start.command, "the constant-velocity model");
      const double t = start.command.duration_s;
      const Pose X_SE = exp({model->speed_m_s * t, 0, model->turn_rad_s * t});
      legs.push_back(smooth_leg(start, X_SE, settings_.interval_s));
    }
    return legs;
  }

 private:
  std::vector<ConstantVelocity> models_;
  DriveSettings settings_;
};

class MinedMover final : public Mover {
 public:
  MinedMover(const MotionModel& model, const DriveSettings& settings) : settings_(settings) {
    for (const CommandMotion& motion : model.commands()) {
      if (motion.trials >= MotionModelSettings{}.least_trials) motions_.push_back(motion);
    }
  }

  Result<std::vector<Leg>> drive(std::span<const Start> starts) const override {
    std::vector<Leg> legs;
    for (const Start& start : starts) {
      const CommandMotion* motion = closest(start.command);
      if (motion == nullptr) return unknown(start.command, "the mined motion model");
      const double share = start.command.duration_s / motion->command.duration_s;
      const Eigen::Matrix3d covariance = share * motion->motion.covariance;
      Stream stream({settings_.seed, Purpose::kSimulation, start.leg, start.run});
      const Eigen::Vector3d draw(stream.normal(), stream.normal(), stream.normal());
      const Eigen::Vector3d off = covariance.llt().matrixL() * draw;
      const Pose mean = exp(share * log(motion->motion.mean));
      const Pose X_SE{mean.x + off.x(), mean.y + off.y(), wrap_angle(mean.theta + off.z())};
      legs.push_back(smooth_leg(start, X_SE, settings_.interval_s));
    }
    return legs;
  }

 private:
  // Of the same name and duties, the one whose duration is closest.
  const CommandMotion* closest(const CommandSpec& command) const {
    const CommandMotion* found = nullptr;
    for (const CommandMotion& motion : motions_) {
      const CommandSpec& c = motion.command;
      if (c.name != command.name || c.left != command.left || c.right != command.right) continue;
      const auto off = [&](const CommandMotion& m) {
        return std::abs(m.command.duration_s - command.duration_s);
      };
      if (found == nullptr || off(motion) < off(*found)) found = &motion;
    }
    return found;
  }

  std::vector<CommandMotion> motions_;
  DriveSettings settings_;
};

class SimulatedMover final : public Mover {
 public:
  SimulatedMover(Farm& farm, const Problem& problem, const DriveSettings& settings)
      : farm_(farm), settings_(settings) {
    Problem bare = problem;
    bare.log = {};
    bare.genes.clear();
    // The pilot's camera is not what varies: the true pose is asked for.
    for (const char* key : {"pose_noise_position", "pose_noise_heading"}) {
      if (const auto row = bare.table().find(key)) bare.values[*row] = bare.table()[*row].lower;
    }
    hash_ = farm_.add_problem(to_proto(bare));
  }

  Result<std::vector<Leg>> drive(std::span<const Start> starts) const override {
    std::vector<v1::Task> tasks;
    for (const Start& start : starts) {
      v1::Task task;
      v1::SimulateTask* simulate = task.mutable_simulate();
      simulate->mutable_stream()->set_run_seed(settings_.seed);
      simulate->mutable_stream()->set_generation(start.leg);
      simulate->mutable_stream()->set_birth_id(start.run);
      simulate->set_path_interval(settings_.interval_s);
      v1::PlannedTrial* planned = simulate->add_plan();
      planned->set_moved(true);
      *planned->mutable_trial() = planned_trial(start);
      tasks.push_back(std::move(task));
    }
    ASSIGN_OR_RETURN(const auto results, farm_.run(hash_, tasks));
    std::vector<Leg> legs;
    for (std::size_t i = 0; i < starts.size(); ++i) {
      const v1::TaskResult& result = results[i];
      if (result.outcome() != v1::OK || result.simulate().trials_size() != 1) {
        return Error{"command '" + starts[i].command.name + "' ended with " +
                     v1::Outcome_Name(result.outcome()) + " " + result.message()};
      }
      legs.push_back({starts[i].command, from_proto(result.simulate().trials(0)).path});
      move_path(settings_.frame_x_m, settings_.frame_y_m, &legs.back().path);
    }
    return legs;
  }

 private:
  v1::Trial planned_trial(const Start& start) const {
    Trial trial;
    trial.session = "drive";
    trial.trial = static_cast<std::int64_t>(start.leg) + 1;
    trial.t_s = 0;
    trial.command = start.command.name;
    trial.left = start.command.left;
    trial.right = start.command.right;
    trial.duration_s = start.command.duration_s;
    trial.X_WS = {start.X_WS.x - settings_.frame_x_m, start.X_WS.y - settings_.frame_y_m,
                  start.X_WS.theta};
    trial.X_WE = trial.X_WS;
    return to_proto(trial);
  }

  Farm& farm_;
  DriveSettings settings_;
  std::string hash_;
};

}  // namespace

std::unique_ptr<Mover> simulated_mover(Farm& farm, const Problem& problem,
                                       const DriveSettings& settings) {
  return std::make_unique<SimulatedMover>(farm, problem, settings);
}

std::unique_ptr<Mover> constant_velocity_mover(std::vector<ConstantVelocity> models,
                                               const DriveSettings& settings) {
  return std::make_unique<ConstantVelocityMover>(std::move(models), settings);
}

std::unique_ptr<Mover> mined_mover(const MotionModel& model, const DriveSettings& settings) {
  return std::make_unique<MinedMover>(model, settings);
}

}  // namespace gapfarm
