// The base, the noise and the evidence that later steps look at.

#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "common/math/laws.h"
#include "common/math/statistics.h"
#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/evidence/residuals.h"
#include "master/diagnose/evidence/session_gains.h"
#include "master/diagnose/steps/step_parts.h"
#include "master/infer/settings.h"

namespace gapfarm::steps {
namespace {

constexpr int kLatencyRounds = 4;
constexpr double kPathInterval_s = 0.005;
constexpr double kLagError = 0.05;  // of a lag seen in paths, between simulations

// Of every trial just before its motors stop, in the axes of its predicted end; none where that
// cannot be simulated.
Result<std::vector<Eigen::Vector3d>> end_velocities(const DiagnosisRequest& of,
                                                    const Study& study) {
  constexpr double kStep_s = 0.02;
  Overrides shorter = study.base;
  shorter[of.table().row("timing_offset.offset")] = -kStep_s;
  ASSIGN_OR_RETURN(const auto ends, of.predictor.attempt({{shorter, {}}}));
  if (!ends.front()) {
    of.predictor.exclude("pose_latency");
    return std::vector<Eigen::Vector3d>();
  }
  return differences(study.predicted_ends(), *ends.front(), -kStep_s);
}

// The gap to the next reading counts from the stop of the motors, the parameter from rest: asks the
// simulation how long before rest each command was where that gap begins.
Result<double> latency_from_rest(const DiagnosisRequest& of, const Study& study,
                                 const LatencyFit& latency,
                                 const std::vector<Eigen::Vector3d>& velocity) {
  std::vector<CommandSpec> commands = mapped(study.cells, &Cell::command);
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
    RETURN_IF_ERROR(of.subject.tune(of.predictor, of.options.keep_base, &study));
    ASSIGN_OR_RETURN(auto measured, measure(of, study));
    partial.evidence = std::make_shared<const Evidence>(std::move(measured));
    ASSIGN_OR_RETURN(auto faster, end_velocities(of, partial.study()));
    if (faster.empty()) break;
    velocity = std::move(faster);
    partial.latency = fit_latency(partial.study(), velocity);
  }
  ASSIGN_OR_RETURN(const auto from_rest,
                   latency_from_rest(of, partial.study(), partial.latency, velocity));
  partial.latency_from_rest_s = from_rest;
  partial.as_logged = as_logged;
  return partial;
}

Result<Eigen::MatrixXd> nuisances_of(const DiagnosisRequest& of, Study& study) {
  auto nuisances = of.subject.nuisances(of.predictor, study);
  if (nuisances && study.session_spread > 0) *nuisances = beside_sessions(study, *nuisances);
  return nuisances;
}

}  // namespace

std::vector<BaseParameter> whole_base(const DiagnosisRequest& of, const Study& study) {
  std::vector<BaseParameter> base = study.base_parameters;
  for (const RetunedParameter& p : study.drive.retuned) {
    const bool searched = contains(of.options.genes, p.row, &Gene::row);
    if (!searched || p.unit != 0 || contains(base, p.row, &BaseParameter::row)) continue;
    base.push_back({p.row, p.prior_sd});
  }
  return base;
}

Result<Study> tune(const DiagnosisRequest& of) {
  Result<Study> study = of.subject.make_study(of.problem, of.options.genes);
  if (!study) return study;
  Study whole = *study;
  RETURN_IF_ERROR(of.subject.tune(of.predictor, of.options.keep_base, &*study));
  whole.base_parameters = whole_base(of, *study);
  const bool more = whole.base_parameters.size() > study->base_parameters.size();
  if (study->on_bounds.empty() || !more) return study;
  // What draws a part of the base to its bounds may be that the rest is kept where it is.
  whole.drive.tuned = whole.base_parameters;
  const Status tuned = of.subject.tune(of.predictor, of.options.keep_base, &whole);
  if (tuned && whole.on_bounds.empty()) return whole;
  // Or that what moves the robot is yet to be found: beside it the rest may move, too.
  study->base_parameters = std::move(whole.base_parameters);
  return study;
}

Evidence evidence_beside(Study study, Eigen::MatrixXd nuisances,
                         std::vector<CovariateBlock> blocks) {
  Eigen::VectorXd residuals = study.whitened_residuals();
  study.drop_ignored(residuals);
  study.drop_ignored(nuisances);
  for (CovariateBlock& block : blocks) study.drop_ignored(block.columns);
  Regression base(nuisances, residuals);
  return {std::move(study), std::move(nuisances), std::move(blocks), std::move(base)};
}

Result<Evidence> evidence_of(const DiagnosisRequest& of, Study study) {
  ASSIGN_OR_RETURN(auto nuisances, nuisances_of(of, study));
  std::vector<CovariateBlock> blocks = of.subject.blocks(study);
  return evidence_beside(std::move(study), std::move(nuisances), std::move(blocks));
}

Result<std::optional<Evidence>> evidence_at(const DiagnosisRequest& of, const Evidence& before,
                                            const Overrides& at) {
  ASSIGN_OR_RETURN(const auto ends, of.predictor.attempt({{at, {}}}));
  if (!ends.front()) return std::optional<Evidence>();
  Study there = before.study;
  there.base = at;
  for (std::size_t i = 0; i < there.size(); ++i) there.trials[i].X_WP = (*ends.front())[i];
  auto nuisances = nuisances_of(of, there);
  if (!nuisances && nuisances.error().code == ErrorCode::kSimulation)
    return std::optional<Evidence>();
  if (!nuisances) return nuisances.error();
  return std::optional(evidence_beside(before.study, std::move(*nuisances), before.blocks));
}

Eigen::MatrixXd beside_sessions(const Study& study, const Eigen::MatrixXd& nuisances) {
  const Eigen::MatrixXd own = session_columns(study, study.session_spread);
  Eigen::MatrixXd both(own.rows(), own.cols() + nuisances.cols());
  both << own, nuisances;
  return both;
}

Result<Evidence> measure(const DiagnosisRequest& of, const Study& tuned) {
  auto evidence = evidence_of(of, tuned);
  // Twice where far trials are trusted less: again without what they drew to themselves.
  for (int round = 0; round < 2 && evidence; ++round) {
    if (round > 0 && evidence->study.trust.empty()) break;
    Study measured = evidence->study;
    estimate_noise(evidence->base, evidence->blocks, &measured);
    evidence = evidence_of(of, std::move(measured));
  }
  return evidence;
}

Explanation without(const Explanation& all, const std::vector<bool>& ignored) {
  Explanation rest = all;
  Study study = all.study();
  study.ignored = ignored;
  for (Signature& s : rest.first) study.drop_ignored(s.columns);
  rest.evidence = std::make_shared<const Evidence>(
      evidence_beside(std::move(study), all.evidence->nuisances, all.evidence->blocks));
  return rest;
}

bool DiagnosisRequest::excluded(const std::string& effect) const {
  return contains(options.excluded, effect) || !contains(table().effects(), effect, &Effect::name);
}

bool DiagnosisRequest::has_paths() const {
  return !problem.external || (problem.external->table.declaration().inputs & kExternalPath) != 0;
}

double DiagnosisRequest::frame_of(const std::string& key, const Overrides& at) const {
  const Parameter& p = table()[table().row(key)];
  const WorldPlace* place = place_of(*subject.effects, p);
  if (place == nullptr) return 0;
  if (place->axis >= 0) return frame_m[place->axis];
  const auto axis = at.find(table().row(p.effect + ".axis"));
  return axis != at.end() && axis->second != 0 ? frame_m.y() : frame_m.x();
}

// A late camera reads a pose before the motion has ended; the next reading shows it.
Result<Explanation> look_for_late_readings(const DiagnosisRequest& of, Explanation partial) {
  const Study& study = partial.study();
  if (!of.knows("pose_latency") || study.gaps.size() < kFewestReadings) return partial;
  ASSIGN_OR_RETURN(const auto velocity, end_velocities(of, study));
  if (velocity.empty()) return partial;
  partial.latency = fit_latency(study, velocity);
  if (partial.latency.gain < kLeastLatencyGain) return partial;
  if (of.excluded("pose_latency")) {
    partial.odd_readings =
        "Of some readings the next one says that the robot was still under way: nothing that could "
        "explain them was looked for.";
    return partial;
  }
  auto right = put_late_readings_right(of, std::move(partial), velocity);
  if (!right) return right;
  Signature s;
  s.effect = "pose_latency";
  s.columns = right->study().whiten(mapped(right->study().trials, &ResidualTrial::late));
  right->first.push_back(std::move(s));
  const LatencyFit& found = right->latency;
  const double age = right->latency_from_rest_s, share = found.share;
  right->spreads.push_back(
      {"pose_latency",
       {found.gain,
        {{"latency", age, std::max(0.0, 0.8 * found.latency_s - kCoasting_s), 1.2 * age, "s"},
         {"share", share, 0.7 * share, std::min(1.0, 1.4 * share), "-"}}}});
  return right;
}

Result<Explanation> look_for_lag(const DiagnosisRequest& of, Explanation partial) {
  if (!of.knows("motor_lag") || of.excluded("motor_lag") || !of.has_paths()) return partial;
  auto lag = fit_path_lag(of.predictor, partial.study());
  if (!lag && lag.error().code == ErrorCode::kSimulation) {
    of.predictor.exclude("motor_lag");
    return partial;
  }
  if (!lag) return lag.error();
  partial.lag = *lag;
  if (partial.lag.gain < kLeastLatencyGain) partial.lag.gain = 0;
  if (partial.lag.gain == 0) return partial;
  const double tau = partial.lag.tau_s;
  const double half = kNormal90 * std::hypot(partial.lag.standard_error_s, kLagError * tau);
  partial.spreads.push_back(
      {"motor_lag", {partial.lag.gain, {{"tau", tau, tau - half, tau + half, "s"}}}});
  return partial;
}

}  // namespace gapfarm::steps
