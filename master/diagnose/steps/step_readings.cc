// Readings that came late, and what logged paths say of the motors.

#include <algorithm>

#include "common/math/statistics.h"
#include "master/diagnose/evidence/distribution.h"
#include "master/diagnose/steps/step_parts.h"

namespace gapfarm::steps {
namespace {

constexpr int kLatencyRounds = 4;
constexpr double kPathInterval_s = 0.005;
constexpr double kLeastLatencyGain = 14;  // nats; the share and the age are searched on a grid
constexpr double kLeastLagGain = 14;      // it stands for all samples of a path, which go together

// Of every trial just before its motors stop, in the axes of its predicted end; none where that
// cannot be simulated.
Result<std::vector<Eigen::Vector3d>> end_velocities(const DiagnosisRequest& of,
                                                    const Study& study) {
  constexpr double kStep_s = 0.02;
  Overrides shorter = study.base;
  shorter[of.table().row("timing_offset.offset")] = -kStep_s;
  const auto ends = of.predictor.attempt({{shorter, {}}});
  if (!ends) return ends.error();
  std::vector<Eigen::Vector3d> velocity;
  if (!ends->front()) {
    of.predictor.exclude("pose_latency");
    return velocity;
  }
  for (const Eigen::Vector3d& d : differences(study, *ends->front(), kStep_s)) {
    velocity.push_back(-d);
  }
  return velocity;
}

// The gap to the next reading counts from the stop of the motors, the parameter from rest: asks the
// simulation how long before rest each command was where that gap begins.
Result<double> latency_from_rest(const DiagnosisRequest& of, const Study& study,
                                 const LatencyFit& latency,
                                 const std::vector<Eigen::Vector3d>& velocity) {
  std::vector<CommandSpec> commands;
  for (const Cell& cell : study.cells) commands.push_back(cell.command);
  const auto paths = of.predictor.paths(study.base, commands, kPathInterval_s);
  if (!paths && paths.error().code == ErrorCode::kSimulation) return latency.latency_s;
  if (!paths) return paths.error();
  std::vector<const Eigen::Vector3d*> of_cell(study.cells.size());
  for (std::size_t i = 0; i < study.size(); ++i) of_cell[study.trials[i].cell] = &velocity[i];
  std::vector<double> ages;
  for (std::size_t c = 0; c < commands.size(); ++c) {
    const std::vector<PathSample>& path = (*paths)[c];
    const Eigen::Vector3d& late_velocity = *of_cell[c];
    for (std::size_t k = path.size(); k-- > 0;) {
      const Eigen::Vector3d short_of = -local_difference(path.back().pose, path[k].pose);
      if (late_velocity.dot(short_of) < latency.latency_s * late_velocity.squaredNorm()) continue;
      ages.push_back(path.back().t_s - path[k].t_s);
      break;
    }
  }
  return ages.empty() ? latency.latency_s : median(ages);
}

// Late readings make the motors look slow and the drive noisy, and so themselves less late.
Result<Explanation> put_late_readings_right(const DiagnosisRequest& of, Explanation partial,
                                            std::vector<Eigen::Vector3d> velocity) {
  const Study as_logged = partial.study();
  for (int round = 0; round < kLatencyRounds; ++round) {
    Study study = partial.study();
    const std::vector<Eigen::Vector3d> marks = late_marks(study, partial.latency, velocity);
    for (std::size_t i = 0; i < study.size(); ++i) study.trials[i].late = marks[i];
    study.noise = as_logged.noise;
    if (Status s = of.subject.tune(of.predictor, of.options.keep_base, &study); !s)
      return s.error();
    auto measured = measure(of, study);
    if (!measured) return measured.error();
    partial.evidence = std::make_shared<const Evidence>(std::move(*measured));
    auto faster = end_velocities(of, partial.study());
    if (!faster) return faster.error();
    if (faster->empty()) break;
    velocity = std::move(*faster);
    partial.latency = fit_latency(partial.study(), velocity);
  }
  const auto from_rest = latency_from_rest(of, partial.study(), partial.latency, velocity);
  if (!from_rest) return from_rest.error();
  partial.latency_from_rest_s = *from_rest;
  partial.as_logged = as_logged;
  return partial;
}

}  // namespace

// A late camera reads a pose before the motion has ended; the next reading shows it.
Result<Explanation> look_for_late_readings(const DiagnosisRequest& of, Explanation partial) {
  const Study& study = partial.study();
  if ((of.subject.looks & kLooksForLateReadings) == 0 || study.gaps.size() < kFewestGaps)
    return partial;
  const auto velocity = end_velocities(of, study);
  if (!velocity) return velocity.error();
  if (velocity->empty()) return partial;
  partial.latency = fit_latency(study, *velocity);
  if (partial.latency.gain < kLeastLatencyGain) return partial;
  if (of.excluded("pose_latency")) {
    partial.odd_readings =
        "Of some readings the next one says that the robot was still under way: nothing "
        "that could explain them was looked for.";
    return partial;
  }
  auto right = put_late_readings_right(of, std::move(partial), *velocity);
  if (!right) return right;
  Signature s;
  s.effect = "pose_latency";
  std::vector<Eigen::Vector3d> late;
  for (const ResidualTrial& t : right->study().trials) late.push_back(t.late);
  s.columns = right->study().whiten(late);
  s.fixed = {{"pose_latency.share", right->latency.share},
             {"pose_latency.latency", right->latency_from_rest_s}};
  right->first.push_back(std::move(s));
  return right;
}

Result<Explanation> look_for_lag(const DiagnosisRequest& of, Explanation partial) {
  if (!of.looks_for("motor_lag", kLooksForLag) || !of.has_paths()) return partial;
  auto lag = fit_path_lag(of.predictor, partial.study());
  if (!lag && lag.error().code == ErrorCode::kSimulation) {
    of.predictor.exclude("motor_lag");
    return partial;
  }
  if (!lag) return lag.error();
  partial.lag = *lag;
  if (partial.lag.gain < kLeastLagGain) partial.lag.gain = 0;
  return partial;
}

}  // namespace gapfarm::steps
