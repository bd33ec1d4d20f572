// Readings that came late, and what logged paths say of the motors.

#include <algorithm>

#include "common/score/statistics.h"
#include "master/diagnose/diagnose_steps.h"

namespace gapfarm {
namespace {

constexpr int kLatencyRounds = 4;
constexpr double kPathInterval_s = 0.005;
constexpr double kLeastLatencyGain = 14;  // nats; the share and the age are searched on a grid
constexpr double kLeastLagGain = 14;      // it stands for all samples of a path, which go together

}  // namespace

// Of every trial just before its motors stop, in the axes of its predicted end; none where that
// cannot be simulated.
Result<std::vector<Eigen::Vector3d>> DiagnosisRun::end_velocities() {
  constexpr double kStep_s = 0.02;
  Overrides shorter = study_.base;
  shorter[problem_.table().row("timing_offset.offset")] = -kStep_s;
  const auto ends = predictor_.attempt({{shorter, {}}});
  if (!ends) return ends.error();
  std::vector<Eigen::Vector3d> velocity;
  if (!ends->front()) {
    predictor_.leave_out("pose_latency");
    return velocity;
  }
  for (const Eigen::Vector3d& d : differences(study_, *ends->front(), kStep_s)) {
    velocity.push_back(-d);
  }
  return velocity;
}

// Late readings make the motors look slow and the drive noisy, and so themselves less late.
Status DiagnosisRun::put_late_readings_right(std::vector<Eigen::Vector3d> velocity) {
  as_logged_ = study_;
  for (int round = 0; round < kLatencyRounds; ++round) {
    const std::vector<Eigen::Vector3d> marks = late_marks(study_, latency_, velocity);
    for (std::size_t i = 0; i < study_.size(); ++i) study_.trials[i].late = marks[i];
    study_.noise = as_logged_->noise;
    if (Status s = subject_.tune(predictor_, options_.keep_base, &study_); !s) return s;
    if (Status s = measure_noise(); !s) return s;
    auto faster = end_velocities();
    if (!faster) return faster.error();
    if (faster->empty()) break;
    velocity = std::move(*faster);
    latency_ = fit_latency(study_, velocity);
  }
  return date_latency(velocity);
}

// The gap to the next reading counts from the stop of the motors, the parameter from rest: asks the
// simulation how long before rest each command was where that gap begins.
Status DiagnosisRun::date_latency(const std::vector<Eigen::Vector3d>& velocity) {
  std::vector<CommandSpec> commands;
  for (const Cell& cell : study_.cells) commands.push_back(cell.command);
  const auto paths = predictor_.paths(study_.base, commands, kPathInterval_s);
  if (!paths && paths.error().code == ErrorCode::kSimulation) {
    latency_from_rest_s_ = latency_.latency_s;
    return {};
  }
  if (!paths) return paths.error();
  std::vector<const Eigen::Vector3d*> of_cell(study_.cells.size());
  for (std::size_t i = 0; i < study_.size(); ++i) of_cell[study_.trials[i].cell] = &velocity[i];
  std::vector<double> ages;
  for (std::size_t c = 0; c < commands.size(); ++c) {
    const std::vector<PathSample>& path = (*paths)[c];
    const Eigen::Vector3d& way = *of_cell[c];
    for (std::size_t k = path.size(); k-- > 0;) {
      const Eigen::Vector3d short_of = -local_difference(path.back().pose, path[k].pose);
      if (way.dot(short_of) < latency_.latency_s * way.squaredNorm()) continue;
      ages.push_back(path.back().t_s - path[k].t_s);
      break;
    }
  }
  latency_from_rest_s_ = ages.empty() ? latency_.latency_s : median(ages);
  return {};
}

// A late camera reads a pose before the motion has ended; the next reading shows it.
Status DiagnosisRun::look_for_latency() {
  if ((subject_.looks & kLooksForLateReadings) == 0 || study_.gaps.size() < 20) return {};
  const auto velocity = end_velocities();
  if (!velocity) return velocity.error();
  if (velocity->empty()) return {};
  latency_ = fit_latency(study_, *velocity);
  if (latency_.gain < kLeastLatencyGain) return {};
  if (left_out("pose_latency")) {
    odd_readings_ =
        "Of some readings the next one says that the robot was still under way: nothing "
        "that could explain them was looked for.";
    return {};
  }
  if (Status s = put_late_readings_right(*velocity); !s) return s;
  Signature s;
  s.effect = "pose_latency";
  std::vector<Eigen::Vector3d> late;
  for (const ResidualTrial& t : study_.trials) late.push_back(t.late);
  s.columns = study_.whiten(late);
  s.fixed = {{"pose_latency.share", latency_.share},
             {"pose_latency.latency", latency_from_rest_s_}};
  first_.push_back(std::move(s));
  return {};
}

// Where paths were logged they say more of a lag than rest poses do, and have the last word.
Status DiagnosisRun::look_for_lag() {
  if (!looks_for("motor_lag", kLooksForLag) || !has_paths()) return {};
  auto lag = fit_path_lag(predictor_, study_);
  if (!lag && lag.error().code == ErrorCode::kSimulation) {
    predictor_.leave_out("motor_lag");
    return {};
  }
  if (!lag) return lag.error();
  lag_ = *lag;
  if (lag_.gain < kLeastLagGain) lag_.gain = 0;
  return {};
}

}  // namespace gapfarm
