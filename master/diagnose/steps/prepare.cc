#include "master/diagnose/steps/prepare.h"

#include <algorithm>
#include <cmath>

#include "common/math/statistics.h"
#include "common/trials/shifted.h"
#include "master/diagnose/conclusions/confidence.h"
#include "master/diagnose/conclusions/headline.h"
#include "master/io/log_checks/sanity.h"

namespace gapfarm {
namespace {

// Places reach 10 m; a log that uses half of that is taken relative to its own middle.
constexpr double kNearWorld_m = 5;

// Of start poses, by coordinate: a few wild rows do not move it.
double middle(const TrialLog& log, double Pose::*coordinate) {
  std::vector<double> values;
  for (const Trial& t : log.trials) values.push_back(t.X_WS.*coordinate);
  // Whole metres keep the grid of rounded readings.
  return values.empty() ? 0 : std::round(median(values));
}

bool far_out(const TrialLog& log) {
  std::vector<double> reaches;
  for (const Trial& t : log.trials) {
    reaches.push_back(std::max(std::abs(t.X_WS.x), std::abs(t.X_WS.y)));
  }
  return !reaches.empty() && quantile(reaches, 0.95) > kNearWorld_m;
}

}  // namespace

PreparedLog prepare_log(const Problem& problem, const std::optional<Eigen::Vector2d>& frame_m) {
  PreparedLog prepared{problem, 0, 0, check_sanity(problem)};
  if (any_unusable(prepared.sanity)) return prepared;
  TrialLog& log = prepared.problem.log;
  const std::vector<std::size_t> impossible = impossible_trials(problem);
  for (auto row = impossible.rbegin(); row != impossible.rend(); ++row) {
    log.trials.erase(log.trials.begin() + static_cast<std::ptrdiff_t>(*row));
  }
  if (frame_m) {
    prepared.frame_x_m = frame_m->x();
    prepared.frame_y_m = frame_m->y();
  } else if (far_out(log)) {
    prepared.frame_x_m = middle(log, &Pose::x);
    prepared.frame_y_m = middle(log, &Pose::y);
  }
  log = shifted(std::move(log), -prepared.frame_x_m, -prepared.frame_y_m);
  return prepared;
}

DiagnosisResult unusable_result(const PreparedLog& log) {
  DiagnosisResult result;
  Diagnosis& d = result.diagnosis;
  d.verdict = Verdict::kUnusable;
  d.sanity = log.sanity;
  for (const SanityFinding& f : log.sanity) {
    if (!f.names_an_effect || f.severity != Severity::kUnusable) continue;
    NamedEffect effect;
    effect.name = f.name;
    effect.aliases = f.or_else;
    effect.confidence = sanity_confidence();
    effect.text = f.text + " " + f.remedy;
    d.effects.push_back(std::move(effect));
  }
  fill_conclusions(drive_effect_diagnoses(), &d);
  result.tuned = result.final_ = log.problem.values;
  result.intervals.assign(result.final_.size(), {1, 0});
  return result;
}

}  // namespace gapfarm
