// A farm that answers by plain kinematics, and fails where it is commanded to.
#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include "common/score/motion_model.h"
#include "tests/unit/diagnose/answering_farm.h"

namespace gapfarm {

class KinematicFarm : public AnsweringFarm {
 public:
  using Fails = std::function<bool(const ParameterValues&)>;
  explicit KinematicFarm(Fails fails = {}) : fails_(std::move(fails)) {}

 private:
  v1::TaskResult answer(const Problem& problem, const v1::Task& whole) const override {
    v1::TaskResult result;
    ParameterValues values = problem.values;
    const v1::PredictTask& task = whole.predict();
    const v1::Point& point = whole.has_trace()      ? whole.trace().point()
                             : whole.has_simulate() ? whole.simulate().point()
                                                    : task.point();
    for (const v1::Override& o : point.overrides()) values[o.parameter()] = o.value();
    if (fails_ && fails_(values)) {
      result.set_outcome(v1::NEVER_RESTED);
      return result;
    }
    result.set_outcome(v1::OK);
    if (whole.has_simulate()) {
      simulate(problem, values, whole.simulate(), result.mutable_simulate());
      return result;
    }
    if (whole.has_trace()) {
      trace(values, whole.trace(), result.mutable_trace());
      return result;
    }
    result.mutable_predict();
    std::vector<std::uint32_t> wanted(task.trials().begin(), task.trials().end());
    for (std::uint32_t i = 0; wanted.empty() && i < problem.log.trials.size(); ++i) {
      add(problem, values, i, result.mutable_predict());
    }
    for (std::uint32_t i : wanted) add(problem, values, i, result.mutable_predict());
    return result;
  }

  // As the robot goes: at once, and at one speed, or a side of its own.
  static Twist motion_of(const ParameterValues& values, double left, double right, double time_s) {
    const double speed = values[row_of(Srv1::kFullSpeed)];
    const double apart = values[srv1_table().row("motor_asymmetry.ratio")] / 2;
    left *= 1 - apart;
    right *= 1 + apart;
    const double width = values[row_of(Srv1::kTrackGauge)] + values[row_of(Srv1::kContactLength)];
    return {speed * (left + right) / 2 * time_s, 0, speed * (right - left) / width * time_s};
  }

  static void trace(const ParameterValues& values, const v1::TraceTask& task, v1::TraceResult* to) {
    const v1::Command& c = task.command();
    for (double t = 0; t <= c.duration() + 1e-9; t += task.interval()) {
      v1::TraceSample* sample = to->add_samples();
      sample->set_t(t);
      *sample->mutable_pose() = to_proto(exp(motion_of(values, c.left(), c.right(), t)));
    }
  }

  // The ends alone.
  static void simulate(const Problem& problem, const ParameterValues& values,
                       const v1::SimulateTask& task, v1::SimulateResult* to) {
    for (const v1::PlannedTrial& planned : task.plan()) {
      Trial trial = from_proto(planned.trial());
      const CommandSpec c = resolved_command(trial, problem.commands);
      trial.X_WE = trial.X_WS * exp(motion_of(values, c.left, c.right, c.duration_s));
      *to->add_trials() = to_proto(trial);
    }
  }

  static void add(const Problem& problem, const ParameterValues& values, std::uint32_t i,
                  v1::PredictResult* to) {
    const Trial& trial = problem.log.trials[i];
    const CommandSpec c = resolved_command(trial, problem.commands);
    v1::Predicted* predicted = to->add_predictions();
    predicted->set_trial(i);
    *predicted->mutable_end() =
        to_proto(trial.X_WS * exp(motion_of(values, c.left, c.right, c.duration_s)));
  }

  Fails fails_;
};

// A log that this farm's robot drives at the problem's own values.
inline Problem kinematic_log(std::size_t count) {
  Problem problem;
  problem.values = problem.table().nominal();
  problem.commands = default_commands("srv1");
  for (std::size_t i = 0; i < count; ++i) {
    Trial t;
    t.session = "s";
    t.trial = static_cast<std::int64_t>(i);
    t.command = problem.commands[i % problem.commands.size()].name;
    t.duration_s = 0.5 + 0.5 * static_cast<double>(i % 3);
    const double angle = 2.4 * static_cast<double>(i);
    t.X_WS = {std::cos(angle), std::sin(angle), wrap_angle(1.7 * angle)};
    problem.log.trials.push_back(t);
  }
  for (Trial& t : problem.log.trials) {
    const CommandSpec c = resolved_command(t, problem.commands);
    const double speed = problem.values[row_of(Srv1::kFullSpeed)];
    const double width =
        problem.values[row_of(Srv1::kTrackGauge)] + problem.values[row_of(Srv1::kContactLength)];
    t.X_WE = t.X_WS * exp({speed * (c.left + c.right) / 2 * c.duration_s, 0,
                           speed * (c.right - c.left) / width * c.duration_s});
  }
  return problem;
}

}  // namespace gapfarm
