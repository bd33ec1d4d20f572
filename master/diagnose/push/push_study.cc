#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <span>

#include "common/base/ranges.h"
#include "common/parameters/table.h"
#include "common/score/motion_model.h"
#include "master/diagnose/fit/estimate.h"
#include "master/diagnose/fit/slopes.h"
#include "master/diagnose/push/push_subject.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr double kRetuningStep = 0.05;  // of the logarithm

// What says how a piece is supported: the row of all pieces, followed by those of their own.
struct SupportRows {
  std::size_t of_all = row_of(Push::kShapeFactor);

  std::size_t own(std::size_t piece) const { return of_all + 1 + piece; }
  bool holds(std::size_t row) const { return row >= of_all && row < own(kOwnShapeFactors); }
  double value(const Problem& problem, std::size_t piece) const {
    const double value = problem.values[own(piece)];
    return value > 0 ? value : problem.values[of_all];
  }
};
static_assert(row_of(Push::kShapeFactor1) == row_of(Push::kShapeFactor) + 1 &&
              row_of(Push::kPressure1) == row_of(Push::kPressure) + 1);

SupportRows support_rows(const Problem& problem) {
  if (!rests_on_its_face(problem.values)) return {};
  return {row_of(Push::kPressure)};
}

// The rows that tuning moves.
Result<std::vector<BaseParameter>> base_of(const Problem& problem, std::span<const Gene> genes,
                                           const std::set<std::size_t>& pieces) {
  const SupportRows support = support_rows(problem);
  bool factor = genes.empty(), finger = genes.empty(), ground = false;
  for (const Gene& gene : genes) {
    factor = factor || support.holds(gene.row);
    finger = finger || gene.row == row_of(Push::kFingerFriction);
    ground = ground || gene.row == row_of(Push::kGroundFriction);
  }
  std::vector<BaseParameter> base;
  for (const std::size_t piece : pieces) {
    if (!factor) break;
    const bool own = pieces.size() > 1 || problem.values[support.own(piece)] > 0;
    if (own && piece >= kOwnShapeFactors) {
      return Error{"piece " + problem.pieces[piece].name + " is number " +
                   std::to_string(piece + 1) + " of the config, and only the first " +
                   std::to_string(kOwnShapeFactors) +
                   " can have a shape factor or a pressure of their own; list it earlier"};
    }
    base.push_back({own ? support.own(piece) : support.of_all, kFactorPrior});
  }
  if (finger) base.push_back({row_of(Push::kFingerFriction), kFactorPrior});
  if (ground) base.push_back({row_of(Push::kGroundFriction), kGroundPrior});
  return base;
}

void set_ends(const std::vector<Pose>& ends, Study* study) {
  study->use_predicted_ends(ends);
  for (ResidualTrial& t : study->trials) {
    const Eigen::Vector2d slid = transform(t.X_WP, t.push.p_RC) - transform(t.X_WS, t.push.p_RC);
    t.spread.slid_m = slid.norm();
    // Half of the whole motion each, along and across the push.
    const Eigen::Vector3d motion(slid.x(), slid.y(), wrap_angle(t.X_WP.theta - t.X_WS.theta));
    t.left = t.right = rotation_about_z(-t.push.direction_rad) * motion / 2;
  }
}

// Start noise through the simulation: cubature points at sqrt(3) standard deviations, as the
// worker's own prediction has them, so that a bend within them counts as spread.
Status measure_spread(Predictor& predictor, Study* study) {
  const ParameterTable& table = *study->table;
  std::vector<PredictionRequest> requests;
  const double steps[] = {std::sqrt(3.0) * study->noise.pose.position_m,
                          std::sqrt(3.0) * study->noise.pose.position_m,
                          std::sqrt(3.0) * study->noise.pose.heading_rad};
  const char* const keys[] = {"placement_bias.x", "placement_bias.y", "placement_bias.angle"};
  for (int k = 0; k < 3; ++k) {
    for (double sign : {1.0, -1.0}) {
      requests.push_back({study->base, {}});
      requests.back().at[table.row(keys[k])] = sign * steps[k];
    }
  }
  ASSIGN_OR_RETURN(const auto ends, predictor.attempt(requests));
  for (std::size_t i = 0; i < study->size(); ++i) {
    ResidualTrial& t = study->trials[i];
    t.spread.position.setZero();
    t.spread.heading.setZero();
    for (int k = 0; k < 3; ++k) {
      const auto& above = ends[2 * k];
      const auto& below = ends[2 * k + 1];
      Eigen::Vector3d up = Eigen::Vector3d::Zero(), down = up;
      if (above) up = local_difference(t.X_WP, (*above)[i]);
      if (below) down = local_difference(t.X_WP, (*below)[i]);
      if (!above) up = -down;  // one side alone is mirrored
      if (!below) down = -up;
      Eigen::Matrix3d& moments = k < 2 ? t.spread.position : t.spread.heading;
      moments += (up * up.transpose() + down * down.transpose()) / (2 * steps[k] * steps[k]);
      t.spread.start.col(k) = (up - down) / (2 * steps[k]);
    }
  }
  return {};
}

// Slopes of everything that retuning may move, tuned here or not.
Status measure_retuning(Predictor& predictor, Study* study) {
  std::vector<BaseParameter> parameters = study->base_parameters;
  for (BaseParameter& p : parameters) p.prior_log_sd = std::max(p.prior_log_sd, 0.5);
  for (const auto& [row, prior] :
       {std::pair{Push::kFingerFriction, 0.3}, std::pair{Push::kGroundFriction, 0.5}}) {
    const bool known = contains(parameters, row_of(row), &BaseParameter::row);
    if (!known) parameters.push_back({row_of(row), prior});
  }
  std::vector<Probe> probes;
  for (const BaseParameter& p : parameters) {
    const Parameter& row = (*study->table)[p.row];
    const double value = value_at(predictor.problem(), study->base, p.row);
    const double up = std::clamp(value * std::exp(kRetuningStep), row.lower, row.upper);
    const double down = std::clamp(value * std::exp(-kRetuningStep), row.lower, row.upper);
    probes.push_back({"", {{row.key, up}}, {{row.key, down}}, std::log(up / down)});
  }
  ASSIGN_OR_RETURN(auto slopes, probe_all(predictor, *study, probes));
  study->retuned.clear();
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    if (!slopes[k].empty()) study->retuned.push_back({parameters[k], std::move(slopes[k])});
  }
  return {};
}

}  // namespace

Eigen::Vector3d from_push_axes(const ResidualTrial& trial, const Eigen::Vector3d& shift) {
  return rotation_about_z(trial.push.direction_rad - trial.X_WP.theta) * shift;
}

Eigen::Matrix3d push_covariance(const ResidualTrial& trial, const NoiseEstimate& noise) {
  const double position2 = noise.pose.position_m * noise.pose.position_m;
  const double heading2 = noise.pose.heading_rad * noise.pose.heading_rad;
  const double slid = noise.drive_common * trial.spread.slid_m;
  const double turned = noise.drive_side * kTurnUnit_rad_m * trial.spread.slid_m;
  Eigen::Matrix3d cov = position2 * trial.spread.position + heading2 * trial.spread.heading;
  cov.diagonal() +=
      Eigen::Vector3d(position2 + slid * slid, position2 + slid * slid, heading2 + turned * turned);
  return cov;
}

Result<Study> make_push_study(const Problem& problem, std::span<const Gene> genes) {
  const std::vector<Trial>& log = problem.log.trials;
  if (log.empty()) return Error{"the push log is empty; there is nothing to explain"};
  Study study;
  study.subject = diagnosis_subject(problem);
  study.table = &problem.table();
  std::vector<DrivenCommand> driven = mapped(log, [](const Trial& trial) {
    return DrivenCommand{0, 0, trial.tip.back().t_s - trial.tip.front().t_s};
  });
  const std::vector<TrialContext> contexts = trial_contexts(problem.log, driven);
  const std::vector<std::size_t> cells = push_cells(problem.log);
  std::map<std::string, std::size_t> sessions;
  std::set<std::size_t> pieces;
  study.cells.resize(1 + *std::max_element(cells.begin(), cells.end()));
  for (std::size_t i = 0; i < log.size(); ++i) {
    ResidualTrial t;
    const Piece& piece = problem.piece(log[i].command);
    t.command = static_cast<std::size_t>(&piece - problem.pieces.data());
    t.cell = cells[i];
    t.session = sessions.try_emplace(log[i].session, sessions.size()).first->second;
    t.context = contexts[i];
    t.context.moved = true;  // a push that begins where another ended is a start like any
    t.X_WS = log[i].X_WS;
    t.X_WE = log[i].X_WE;
    t.push = push_geometry(piece, log[i], problem.values[row_of(Push::kFingerRadius)]);
    Cell& cell = study.cells[cells[i]];
    cell.command = {piece.name, 0, 0, driven[i].duration_s};
    ++cell.trials;
    pieces.insert(t.command);
    study.trials.push_back(t);
  }
  study.sessions = sessions.size();
  ASSIGN_OR_RETURN(const auto base, base_of(problem, genes, pieces));
  study.base_parameters = base;
  const SupportRows support = support_rows(problem);
  for (const BaseParameter& p : base) {
    const bool own = p.row > support.of_all && support.holds(p.row);
    study.base[p.row] =
        own ? support.value(problem, p.row - support.own(0)) : problem.values[p.row];
  }
  // To begin with; logs of pushes hold no two readings of one pose.
  study.reading_noise_known = false;
  study.noise.pose = {problem.values[row_of(Push::kPoseNoisePosition)],
                      problem.values[row_of(Push::kPoseNoiseHeading)]};
  study.noise.drive_common = problem.values[row_of(Push::kPushNoiseSlide)];
  study.noise.drive_side = problem.values[row_of(Push::kPushNoiseTurn)] / kTurnUnit_rad_m;
  return study;
}

Status tune_push_base(Predictor& predictor, bool keep, Study* study) {
  // Twice: how a start's noise spreads depends on the base, which is fitted to what it leaves.
  for (int round = 0; round < 2; ++round) {
    ASSIGN_OR_RETURN(auto ends, predictor.ends({{study->base, {}}}));
    set_ends(ends.front(), study);
    if (Status s = measure_spread(predictor, study); !s) return s;
    study->use_noise(study->noise);
    if (keep || round == 1) break;
    ASSIGN_OR_RETURN(auto fit,
                     fit_jointly(predictor, *study, {}, study->base, BaseParameters::kFitted,
                                 no_nuisances(*study), kPushTuningRounds));
    study->base = fit.at;
  }
  return measure_retuning(predictor, study);
}

std::vector<std::size_t> push_folds(const Study& study) {
  return mapped(study.trials, [&](const ResidualTrial& t) { return t.cell % kFolds; });
}

DiagnosisSubject push_subject() {
  DiagnosisSubject s;
  s.scenario = "push";
  s.effects = &push_effect_diagnoses();
  s.least_gain = kLeastGainOfPushes;
  s.farthest = 4;
  s.base_moves = true;
  s.drive_common = {row_of(Push::kPushNoiseSlide)};
  s.drive_side = {row_of(Push::kPushNoiseTurn), kTurnUnit_rad_m};
  s.pose_position = {row_of(Push::kPoseNoisePosition)};
  s.pose_heading = {row_of(Push::kPoseNoiseHeading)};
  s.covariance = push_covariance;
  s.make_study = make_push_study;
  s.tune = tune_push_base;
  s.nuisances = push_nuisances;
  s.blocks = push_blocks;
  s.folds = push_folds;
  s.where = push_where;
  s.cautions = push_cautions;
  s.lacks = push_lacks;
  s.view = push_view;
  s.shown = {{"arm_mm", "centroid left of the finger's line, mm", "contact offset"},
             {"direction", "push direction in the world, degrees", "push direction"},
             {"side", "push direction in the piece, degrees", "side of the piece"},
             {"pushed_mm", "distance pushed, mm", "distance"},
             {"speed", "finger's speed, mm/s", "finger speed"},
             {"along_edge", "touch on its edge, half edges from its middle", "place of the touch"},
             {"middle_x", "start of the centroid along x, m", "start x"},
             {"middle_y", "start of the centroid along y, m", "start y"}};
  s.labels.ends =
      "One picture a piece, seen from where each push began: x along the finger's way, y to its "
      "left. Every push is a condition of its own: the ellipses, which should hold nine in ten, "
      "are those of all its pushes together, and an error takes each push's own prediction away.";
  s.labels.residuals = "Measured minus predicted, along and across the push.";
  s.labels.x = "along the push";
  s.labels.y = "across the push";
  return s;
}

}  // namespace gapfarm
