#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include "common/base/ranges.h"
#include "common/parameters/table.h"
#include "common/pose/pose.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/fit/estimate.h"
#include "master/diagnose/fit/free_commands.h"
#include "master/diagnose/places/patch_sketch.h"
#include "master/diagnose/places/where.h"
#include "master/diagnose/push/push_subject.h"
#include "master/diagnose/subject.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

PatchSearch sketched_patches(Predictor& predictor, const Study& study) {
  const auto sketch = std::make_shared<const PatchSketch>(predictor.problem(), study);
  return
      [sketch](const Regression& explained, const PatchWish& wish) -> Result<std::vector<Patch>> {
        return mapped(sketch->search(explained, wish), &PatchSketch::Place::patch);
      };
}

// How near the robot's contacts come to a disc's centre, on the way that the base predicts.
double nearest_to(const Patch& patch, const Pose& X_WS, const Twist& motion,
                  const Footprint& footprint) {
  constexpr int kLooks = 16;
  double nearest = std::numeric_limits<double>::infinity();
  for (int k = 0; k <= kLooks; ++k) {
    const Pose X_WB = X_WS * exp(Twist(motion * k / kLooks));
    for (const Eigen::Vector2d& contact : footprint.contacts()) {
      const Pose at = X_WB * Pose{contact.x(), contact.y(), 0};
      nearest = std::min(nearest, std::hypot(at.x - patch[0], at.y - patch[1]));
    }
  }
  return nearest;
}

std::vector<std::uint32_t> touched_by_drives(const Problem& problem, const Study& study,
                                             const Patch& patch) {
  constexpr double kSpare_m = 0.03;  // for a way that is none of one twist, and between its steps
  const double spare = kSpare_m * study.scale;
  const Footprint footprint = footprint_of(problem, study);
  std::vector<std::uint32_t> touched;
  for (std::uint32_t i = 0; i < study.size(); ++i) {
    const double nearest = nearest_to(patch, study.trials[i].X_WS, motion_of(study, i), footprint);
    if (nearest < patch[2] + spare) touched.push_back(i);
  }
  return touched;
}

// A robot on two sides drives commands: srv1's, or one that a program of the user's simulates.
DiagnosisSubject drive_subject(const char* scenario, const ParameterTable& table) {
  DiagnosisSubject s;
  s.scenario = scenario;
  s.effects = &drive_effect_diagnoses();
  s.least_gain = kLeastGainOfDrives;
  s.farthest = 0;  // slips are looked for
  s.base_moves = false;
  s.drive_common = {table.row("drive_noise_common")};
  s.drive_side = {table.row("drive_noise_side")};
  s.pose_position = {table.row("pose_noise_position")};
  s.pose_heading = {table.row("pose_noise_heading")};
  s.drive_tail = {table.row("drive_noise_tail")};
  s.pose_tail = {table.row("pose_noise_tail")};
  s.covariance = trial_covariance;
  s.make_study = make_study;
  s.tune = tune_base;
  s.nuisances = [](Predictor& predictor, Study& study) {
    return nuisance_columns(predictor, study);
  };
  s.blocks = covariate_blocks;
  s.signatures = signatures;
  s.touched_by = touched_by_drives;
  s.patches = sketched_patches;
  s.folds = folds_of;
  s.where = [](const Study& study, std::span<const Eigen::Vector3d> residuals,
               const Problem& problem) {
    return where(study.trials, residuals, study.covariances(), study.cells, problem);
  };
  s.cautions = [](const Study& study, const TrialLog& log) {
    return cautions(study.trials, study.cells, log);
  };
  s.lacks = [](const Study& study, const TrialLog& log) {
    return lacking(log_variety(study.trials, study.cells, log));
  };
  s.experiments = plan_drives;
  s.view = [](const Study& study, std::size_t trial) {
    return TrialView{study.trials[trial].X_WS, 0, {}};
  };
  return s;
}

DiagnosisSubject srv1_subject() {
  DiagnosisSubject s = drive_subject("srv1", srv1_table());
  s.slope_rate_hz = 60;
  s.slope_headings = 6;
  return s;
}

enum class StartKind { kManyStarts, kAfterOpposite, kLate };

constexpr int kStarts = 5;  // no harmonic of the heading up to the fourth repeats on five
constexpr double kFirstHeading = 0.3;  // rad
constexpr double kEarly_s = 30;
constexpr double kLate_s = 1200;
constexpr double kTrouble_s = 10;  // what a special way costs beyond the command
constexpr std::array<double, 3> kDurations_s = {0.5, 1, 2};
constexpr std::array<double, 2> kLevels = {0.5, 1};  // of each command's own duties

// Places over the box around the log's own starts; the origin alone without a log.
std::vector<Pose> starts_like(const TrialLog& log) {
  Extent box;
  for (const Trial& trial : log.trials) box.add(trial.X_WS);
  if (log.trials.empty()) box.add(Pose());
  std::vector<Pose> starts;
  for (int k = 0; k < kStarts; ++k) {
    // Steps of 2/5 in y against 1/5 in x: no two on a line with a side of the box.
    const double across = (k + 0.5) / kStarts;
    const double along = ((2 * k) % kStarts + 0.5) / kStarts;
    starts.push_back({box.x0 + across * (box.x1 - box.x0), box.y0 + along * (box.y1 - box.y0),
                      wrap_angle(kFirstHeading + 2 * std::numbers::pi * k / kStarts)});
  }
  return starts;
}

Trial trial_of(const CommandSpec& c, const Pose& start, double t_s, const std::string& session) {
  Trial trial;
  trial.session = session;
  trial.t_s = t_s;
  trial.command = c.name;
  trial.left = c.left;
  trial.right = c.right;
  trial.duration_s = c.duration_s;
  trial.X_WS = start;
  trial.X_WE = start;
  return trial;
}

// Every trial has a session of its own, so that what went before is what the design says.
std::vector<std::uint32_t> add_trials(const std::vector<Pose>& starts, const CommandSpec& command,
                                      StartKind start_kind, std::vector<Trial>* log) {
  std::vector<std::uint32_t> indices;
  const std::size_t count = start_kind == StartKind::kManyStarts ? starts.size() : 1;
  for (std::size_t k = 0; k < count; ++k) {
    const std::string session = "d" + std::to_string(log->size());
    double t_s = start_kind == StartKind::kLate ? kLate_s : kEarly_s;
    if (start_kind == StartKind::kAfterOpposite) {
      CommandSpec opposite = command;
      opposite.left = -opposite.left;
      opposite.right = -opposite.right;
      log->push_back(trial_of(opposite, starts[k], t_s, session));
      t_s += opposite.duration_s + 4;
    }
    indices.push_back(static_cast<std::uint32_t>(log->size()));
    log->push_back(trial_of(command, starts[k], t_s, session));
    log->back().trial = start_kind == StartKind::kAfterOpposite ? 1 : 0;
  }
  return indices;
}

std::string drive_names(const CommandSpec& command, double level, StartKind start_kind,
                        bool many_starts) {
  std::string how = " from any start";
  if (many_starts) how = " from several headings and places";
  if (start_kind == StartKind::kAfterOpposite) how = " straight after driving the opposite way";
  if (start_kind == StartKind::kLate)
    how = " " + plain_number(kLate_s / 60) + " minutes into a session";
  return "Drive " + command.name + " for " + plain_number(command.duration_s) + " s at " +
         (level == 1 ? "full" : "half") + " level" + how;
}

}  // namespace

std::shared_ptr<const DiagnosisSubject> diagnosis_subject(const Problem& problem) {
  // A program has rows of its own, so its subject is its problem's.
  if (problem.external && !problem.windows()) {
    return std::make_shared<const DiagnosisSubject>(drive_subject("external", problem.table()));
  }
  static const std::array<std::shared_ptr<const DiagnosisSubject>, 2> subjects = {
      std::make_shared<const DiagnosisSubject>(srv1_subject()),
      std::make_shared<const DiagnosisSubject>(push_subject())};
  const auto found = std::ranges::find_if(
      subjects, [&](const auto& subject) { return problem.scenario == subject->scenario; });
  return found == subjects.end() ? nullptr : *found;
}

ExperimentPlan plan_drives(const Problem& problem) {
  ExperimentPlan plan{
      problem, {}, "design of one command", "log paths, or measure one of them directly"};
  plan.problem.genes.clear();
  plan.problem.log = {};
  const std::vector<Pose> starts = starts_like(problem.log);
  for (const CommandSpec& own : problem.commands) {
    for (const double duration : kDurations_s) {
      for (const double level : kLevels) {
        CommandSpec command = own;
        command.left *= level;
        command.right *= level;
        command.duration_s = duration;
        std::uint32_t ordinary = 0;
        for (const StartKind start_kind :
             {StartKind::kManyStarts, StartKind::kAfterOpposite, StartKind::kLate}) {
          Design design;
          design.group = command.name;
          design.trials = add_trials(starts, command, start_kind, &plan.problem.log.trials);
          design.cost = duration + (start_kind == StartKind::kManyStarts ? 0 : kTrouble_s);
          if (start_kind == StartKind::kManyStarts) ordinary = design.trials.front();
          if (start_kind != StartKind::kManyStarts) design.ordinary = ordinary;
          design.action = [command, level, start_kind](bool many_starts) {
            return drive_names(command, level, start_kind, many_starts);
          };
          plan.designs.push_back(std::move(design));
        }
      }
    }
  }
  return plan;
}

}  // namespace gapfarm
