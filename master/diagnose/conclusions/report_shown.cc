// Trials, parameters and single drives, as the report shows them.

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

#include "common/base/ranges.h"
#include "common/math/algebra.h"
#include "master/diagnose/conclusions/report_parts.h"
#include "master/diagnose/effect_diagnosis.h"
#include "master/farm/planned_trials.h"

namespace gapfarm::steps {
namespace {

constexpr double kHardlyMoved = 0.8;  // of the prior's spread: the data add next to nothing
constexpr double kOneNumber = 0.95;   // a correlation: alone, each would be three times as sure
constexpr double kShownInterval_s = 0.05;
constexpr std::size_t kMostSamples = 40;  // of a path that is shown

// Covariance of the fit's parameters, for noise of unit variance.
Eigen::MatrixXd covariance_of(const Study& study, const JointFit& fit) {
  if (fit.parameters.empty()) return {};
  const Eigen::MatrixXd normal = information_of(study, fit, no_nuisances(study));
  const Eigen::VectorXd curvatures = axes_of_symmetric(normal).values;
  const double rounding = std::numeric_limits<double>::epsilon() *
                          static_cast<double>(normal.rows()) * curvatures.maxCoeff();
  if (!(curvatures.minCoeff() > rounding)) return {};
  return inverse_of_symmetric(normal);
}

std::vector<ParameterCorrelation> correlations_of(const ParameterTable& table, const JointFit& fit,
                                                  const Eigen::MatrixXd& cov) {
  std::vector<ParameterCorrelation> all;
  const auto key = [&](Eigen::Index k) { return table[fit.parameters[k].row].key; };
  for (Eigen::Index i = 0; i < cov.rows(); ++i) {
    for (Eigen::Index j = i + 1; j < cov.cols(); ++j) {
      const double r = cov(i, j) / std::sqrt(cov(i, i) * cov(j, j));
      if (std::isfinite(r)) all.push_back({key(i), key(j), std::clamp(r, -1.0, 1.0)});
    }
  }
  std::ranges::stable_sort(all, std::greater(),
                           [](const ParameterCorrelation& c) { return std::abs(c.r); });
  return all;
}

// Places are reported in the world, not in the log's own frame.
void to_world(double frame, ParameterRow* row) {
  for (double* value : {&row->after, &row->lower, &row->upper}) *value += frame;
  if (row->lo && row->hi) *row->lo += frame, *row->hi += frame;
}

// Every k-th sample and the last one; to a micrometre, so that the file stays small.
std::vector<PathSample> shown_path(const std::vector<PathSample>& path, const Pose& X_WS) {
  std::vector<PathSample> shown;
  const std::size_t every = 1 + path.size() / kMostSamples;
  const auto rounded = [](double v) { return std::round(v * 1e6) / 1e6; };
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (i % every != 0 && i + 1 != path.size()) continue;
    const Pose X = between(X_WS, path[i].pose);
    shown.push_back({rounded(path[i].t_s), {rounded(X.x), rounded(X.y), rounded(X.theta)}});
  }
  return shown;
}

// The worst and the median trial of all and of every command, by the tuned model's log score.
std::vector<ShownDrive> drives_to_show(const std::vector<DiagnosedTrial>& trials) {
  std::vector<std::string> commands;
  for (const DiagnosedTrial& t : trials) {
    if (!contains(commands, t.command)) commands.push_back(t.command);
  }
  std::vector<ShownDrive> drives;
  std::set<std::size_t> taken;
  const auto add = [&](const std::string& command) {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < trials.size(); ++i) {
      const bool fits = command == "all" || trials[i].command == command;
      if (fits && std::isfinite(trials[i].tuned_score)) order.push_back(i);
    }
    if (order.empty()) return;
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return trials[i].tuned_score; });
    for (const auto& [what, i] :
         {std::pair{"worst", order.front()}, std::pair{"median", order[order.size() / 2]}}) {
      if (taken.insert(i).second) drives.push_back({i, what + (" of " + command), {}, {}, {}});
    }
  };
  add("all");
  if (commands.size() > 1) std::for_each(commands.begin(), commands.end(), add);
  return drives;
}

// Residuals, ends and their covariances, seen from axes turned by `angle_rad`.
void turn(double angle_rad, DiagnosedTrial* trial) {
  const Eigen::Matrix3d rotation = rotation_about_z(-angle_rad);
  trial->tuned_residual = rotation * trial->tuned_residual;
  trial->final_residual = rotation * trial->final_residual;
  trial->tuned_cov = rotate_covariance(trial->tuned_cov, -angle_rad);
  trial->final_cov = rotate_covariance(trial->final_cov, -angle_rad);
  for (Pose* end : {&trial->measured, &trial->tuned, &trial->final_}) {
    end->theta = wrap_angle(end->theta + angle_rad);
  }
}

std::set<std::size_t> noise_rows(const DiagnosisSubject& subject) {
  return {subject.drive_common.row, subject.drive_side.row, subject.pose_position.row,
          subject.pose_heading.row};
}

// The values without anything random, as differences from the problem's.
std::vector<v1::Override> without_chance(const DiagnosisRequest& of, ParameterValues values) {
  const ParameterTable& table = of.table();
  for (const std::size_t row : noise_rows(of.subject)) values[row] = table[row].lower;
  table.without_chance(&values);
  return overrides_of(of.problem.values, values);
}

// Rows of the table that are reported: noise, base, and named effects.
std::set<std::size_t> reported_rows(const DiagnosisRequest& of, const JointFit& fit,
                                    const std::vector<NamedEffect>& effects) {
  std::set<std::size_t> reported = noise_rows(of.subject);
  for (std::size_t k = 0; k < fit.base_parameters; ++k) reported.insert(fit.parameters[k].row);
  for (std::size_t row = 0; row < of.table().size(); ++row) {
    if (contains(effects, of.table()[row].effect, &NamedEffect::name)) reported.insert(row);
  }
  return reported;
}

}  // namespace

std::vector<DiagnosedTrial> diagnosed_trials(const DiagnosisRequest& of, const Refit& refit) {
  const Study& study = refit.judged.named.study();
  const NestedFit &tuned = refit.nested.front(), &last = refit.nested.back();
  const std::vector<Eigen::Matrix3d> tuned_cov = tuned.study.covariances();
  const std::vector<Eigen::Matrix3d> last_cov = last.study.covariances();
  std::vector<DiagnosedTrial> trials;
  for (std::size_t i = 0; i < study.size(); ++i) {
    const ResidualTrial& t = study.trials[i];
    const Cell& cell = study.cells[t.cell];
    DiagnosedTrial to;
    to.session = of.problem.log.trials[i].session;
    to.trial = of.problem.log.trials[i].trial;
    to.command = cell.command.name;
    to.session_time_s = t.context.session_time_s;
    to.duration_s = cell.command.duration_s;
    to.level = cell.level;
    to.place_in_run = t.context.place_in_run;
    to.held_out = true;  // every trial's scores come from the other folds
    to.X_WS = t.X_WS;
    to.X_WS.x += of.frame_m.x();
    to.X_WS.y += of.frame_m.y();
    TrialView view = of.subject.view(study, i);
    to.measured = between(view.X_WV, t.X_WE);
    to.tuned = between(view.X_WV, tuned.fit.ends[i]);
    to.final_ = between(view.X_WV, last.fit.ends[i]);
    to.tuned_cov = tuned_cov[i];
    to.final_cov = last_cov[i];
    to.tuned_residual = tuned.fit.residuals[i];
    to.final_residual = last.fit.residuals[i];
    if (view.turn_rad != 0) turn(view.turn_rad, &to);
    to.covariates = std::move(view.covariates);
    to.tuned_score = tuned.scores[i];
    to.final_score = last.scores[i];
    trials.push_back(std::move(to));
  }
  return trials;
}

void fill_parameters(const DiagnosisRequest& of, const Refit& refit, DiagnosisResult* result) {
  const ParameterTable& table = of.table();
  const JointFit& fit = refit.nested.back().fit;
  const Study& study = refit.nested.back().study;
  Diagnosis& d = result->diagnosis;
  for (const std::size_t at : reported_rows(of, fit, d.effects)) {
    ParameterRow row = row_of(
        table[at], table[at].effect.empty() ? std::optional(result->tuned[at]) : std::nullopt,
        result->final_[at]);
    const auto& [lo, hi] = result->intervals[at];
    if (lo < hi) row.lo = lo, row.hi = hi;
    to_world(of.frame_of(row.key, fit.at), &row);
    d.parameters.push_back(std::move(row));
  }
  // Of the base, which only this fit knows the spread of.
  for (std::size_t k = 0; k < fit.base_parameters; ++k) {
    const FittedParameter& p = fit.parameters[k];
    ParameterRow* row = find_by(d.parameters, table[p.row].key, &ParameterRow::key);
    const double half = kNormal90 * p.standard_error * std::sqrt(refit.judged.scale);
    if (half > 0) {
      row->lo = std::max(row->after - half, row->lower);
      row->hi = std::min(row->after + half, row->upper);
    }
    if (p.standard_error > kHardlyMoved * prior_sd(study, study.base_parameters[k])) {
      row->note = "the data hardly move it";
    }
  }
  const Eigen::MatrixXd cov = covariance_of(study, fit);
  if (cov.size() == 0) return;
  d.correlations = correlations_of(table, fit, cov);
  for (const ParameterCorrelation& c : d.correlations) {
    const bool of_effect =
        !table[table.row(c.a)].effect.empty() || !table[table.row(c.b)].effect.empty();
    if (!of_effect || std::abs(c.r) < kOneNumber) continue;
    d.cautions.push_back(fmt::format(
        "These data know {} and {} as one number (correlation {:.2f}): take both values or "
        "neither, or measure one and give it in [parameters].",
        c.a, c.b, c.r));
  }
}

Result<std::vector<ShownDrive>> shown_drives(const DiagnosisRequest& of,
                                             const DiagnosisResult& result) {
  std::vector<ShownDrive> drives;
  if (!of.subject.labels.ends.empty()) return drives;  // of a scenario whose paths say nothing
  if (!of.has_paths()) return drives;
  drives = drives_to_show(result.diagnosis.trials);
  if (drives.empty()) return drives;
  std::vector<v1::Task> tasks;
  for (const ParameterValues* values : {&result.tuned, &result.final_}) {
    const std::vector<v1::Override> overrides = without_chance(of, *values);
    for (const ShownDrive& drive : drives) {
      v1::PlannedTrial planned;
      *planned.mutable_trial() = to_proto(of.problem.log.trials[drive.trial]);
      planned.mutable_trial()->clear_path();
      planned.set_moved(true);
      tasks.push_back(simulate_tasks({{planned}}, overrides, of.options.seed, kShownInterval_s)[0]);
    }
  }
  ASSIGN_OR_RETURN(const auto results,
                   of.farm.run(of.farm.add_problem(to_proto(of.problem)), tasks));
  for (std::size_t k = 0; k < results.size(); ++k) {
    ShownDrive& drive = drives[k % drives.size()];
    const Trial& logged = of.problem.log.trials[drive.trial];
    drive.measured = shown_path(logged.path, logged.X_WS);
    if (results[k].outcome() != v1::OK) continue;
    const Trial simulated = from_proto(results[k].simulate().trials(0));
    (k < drives.size() ? drive.tuned : drive.final_) = shown_path(simulated.path, simulated.X_WS);
  }
  return drives;
}

}  // namespace gapfarm::steps
