// Refits, figures and words.

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "common/random/stream.h"
#include "common/score/statistics.h"
#include "master/diagnose/confidence.h"
#include "master/diagnose/diagnose_steps.h"
#include "master/diagnose/findings.h"
#include "master/diagnose/headline.h"
#include "master/diagnose/intervals.h"
#include "master/diagnose/seam.h"

namespace gapfarm {
namespace {

constexpr int kBootstraps = 400;

// For so long another robot may roll on by itself: what a late reading's age is counted from is its
// recorder's secret.
constexpr double kCoasting_s = 0.04;
constexpr double kLagError = 0.05;  // of a lag seen in paths, between simulations

struct RootMeanSquare {
  double position_mm = 0;
  double heading_mrad = 0;
};

RootMeanSquare root_mean_square(const std::vector<Eigen::Vector3d>& residuals) {
  double position = 0, heading = 0;
  for (const Eigen::Vector3d& r : residuals) {
    position += r.head<2>().squaredNorm() / static_cast<double>(residuals.size());
    heading += r[2] * r[2] / static_cast<double>(residuals.size());
  }
  return {1e3 * std::sqrt(position), 1e3 * std::sqrt(heading)};
}

std::vector<double> difference(std::vector<double> values, const std::vector<double>& less) {
  for (std::size_t i = 0; i < values.size(); ++i) values[i] -= less[i];
  return values;
}

// Residuals, ends and their covariances, seen from axes turned by `angle_rad`.
void turn(double angle_rad, DiagnosedTrial* trial) {
  const auto turned = [&](const Eigen::Vector3d& v) {
    const Pose seen = Pose{0, 0, -angle_rad} * Pose{v[0], v[1], 0};
    return Eigen::Vector3d(seen.x, seen.y, v[2]);
  };
  trial->tuned_residual = turned(trial->tuned_residual);
  trial->final_residual = turned(trial->final_residual);
  trial->tuned_cov = rotate_covariance(trial->tuned_cov, -angle_rad);
  trial->final_cov = rotate_covariance(trial->final_cov, -angle_rad);
  for (Pose* end : {&trial->measured, &trial->tuned, &trial->final_}) {
    end->theta = wrap_angle(end->theta + angle_rad);
  }
}

}  // namespace

// Share of the explainable gap, with an interval from a bootstrap over the chains between
// unrecorded moves, whose trials share a start.
void DiagnosisRun::set_closed(NamedEffect* effect, const std::vector<double>& gained) const {
  std::vector<std::vector<std::size_t>> chains;
  for (std::size_t i = 0; i < study_.size(); ++i) {
    if (chains.empty() || study_.trials[i].context.moved) chains.emplace_back();
    chains.back().push_back(i);
  }
  const std::vector<double>& base = nested_scores_.front();
  const auto share = [&](const std::vector<std::size_t>& drawn) {
    double gain = 0, gap = 0;
    for (std::size_t c : drawn) {
      for (std::size_t i : chains[c]) {
        gain += gained[i];
        gap += floor_ - base[i];
      }
    }
    return gap > 0 ? std::clamp(gain / gap, -1.0, 1.5) : 0.0;
  };
  std::vector<std::size_t> all(chains.size());
  for (std::size_t c = 0; c < all.size(); ++c) all[c] = c;
  effect->closed = share(all);
  Stream stream({options_.seed, Purpose::kStatistics, 3, 0, 0});
  std::vector<double> shares;
  for (int b = 0; b < kBootstraps; ++b) {
    for (std::size_t& c : all) c = stream.below(chains.size());
    shares.push_back(share(all));
  }
  effect->closed_lo = quantile(shares, 0.05);
  effect->closed_hi = quantile(shares, 0.95);
}

// Of every trial, by a nested fit over the one before.
std::vector<double> DiagnosisRun::gained_by(std::size_t nested) const {
  return difference(nested_scores_[nested], nested_scores_[nested - 1]);
}

NamedEffect DiagnosisRun::named(std::size_t k, const JointFit& estimates) const {
  const ChosenEffect& chosen = chosen_[k];
  NamedEffect effect;
  effect.name = chosen.candidate.signature.effect;
  std::vector<AliasReason> reasons;
  for (const Alias& alias : chosen.aliases) {
    effect.aliases.push_back(alias.effect);
    reasons.push_back({alias.effect, std::abs(alias.cosine)});
  }
  effect.alias_reason = alias_sentence(effect.name, reasons, subject_.lacks(study_, problem_.log));
  effect.confidence = confidence_of(chosen.candidate.gain, subject_.least_gain);
  for (const auto& [row, value] : estimates.at) {
    const Parameter& p = problem_.table()[row];
    if (p.effect != effect.name || p.kind != ParameterKind::kReal) continue;
    Estimate e{p.key.substr(p.key.find('.') + 1), value, value, value, p.unit};
    double fit_error = 0;
    for (const FittedParameter& fitted : estimates.parameters) {
      if (fitted.row == row) fit_error = fitted.standard_error * std::sqrt(scale_);
    }
    const double half =
        kNormal90 * std::hypot(fit_error, error_beyond_fit(study_, problem_.table(), row,
                                                           estimates.at, chosen.candidate.gain));
    e.lo = value - half;
    e.hi = value + half;
    if (!e.key.ends_with("direction")) {
      e.lo = std::max(e.lo, p.lower);
      e.hi = std::min(e.hi, p.upper);
    }
    const double frame = frame_of(p.key, estimates.at);
    for (double* told : {&e.value, &e.lo, &e.hi}) *told += frame;
    effect.parameters.push_back(e);
  }
  if (is_seam(effect.name)) {
    effect.axis = estimates.at.at(problem_.table().row(effect.name + ".axis")) == 0 ? "x" : "y";
  }
  const std::size_t before = k + (as_logged_ ? 1 : 0);
  effect.gap_before = floor_ - mean(nested_scores_[before]);
  effect.gap_after = floor_ - mean(nested_scores_[before + 1]);
  set_closed(&effect, gained_by(before + 1));
  const auto held_out = [&](std::size_t n) {
    return root_mean_square(
        held_out_residuals(nested_studies_[n], nested_[n], subject_.folds(study_)));
  };
  const RootMeanSquare without = held_out(before), with = held_out(before + 1);
  effect.position_mm_before = without.position_mm;
  effect.heading_mrad_before = without.heading_mrad;
  effect.position_mm_after = with.position_mm;
  effect.heading_mrad_after = with.heading_mrad;
  return effect;
}

double DiagnosisRun::frame_of(const std::string& key, const Overrides& at) const {
  const Parameter& p = problem_.table()[problem_.table().row(key)];
  const WorldPlace* place = place_of(*subject_.effects, p);
  if (place == nullptr) return 0;
  if (place->axis >= 0) return frame_m_[place->axis];
  const auto axis = at.find(problem_.table().row(p.effect + ".axis"));
  return axis != at.end() && axis->second != 0 ? frame_m_.y() : frame_m_.x();
}

// That positions lie on a grid is certain; by this it is put among the others.
double DiagnosisRun::pose_grid_gain() const {
  return 0.02 * static_cast<double>(study_.size()) + 20;
}

// Effects that widen the distribution rather than move it: their gain is that of the mixture.
std::vector<DiagnosisRun::SpreadEffect> DiagnosisRun::spread_effects_found() const {
  std::vector<SpreadEffect> found;
  if (!first_.empty()) {
    const double age = latency_from_rest_s_, share = latency_.share;
    found.push_back(
        {"pose_latency",
         latency_.gain,
         {{"latency", age, std::max(0.0, 0.8 * latency_.latency_s - kCoasting_s), 1.2 * age, "s"},
          {"share", share, 0.7 * share, std::min(1.0, 1.4 * share), "-"}},
         gained_by(1)});
  }
  if (lag_.gain > 0) {
    const double half = kNormal90 * std::hypot(lag_.standard_error_s, kLagError * lag_.tau_s);
    found.push_back({"motor_lag",
                     lag_.gain,
                     {{"tau", lag_.tau_s, lag_.tau_s - half, lag_.tau_s + half, "s"}},
                     {}});
  }
  if (slip_.gain > 0) {
    const double p = slip_.probability, loss = slip_.loss;
    found.push_back(
        {"slip_events",
         slip_.gain,
         {{"probability", p, 0.6 * p, 1.6 * p, "-"}, {"loss", loss, 0.7 * loss, 1.4 * loss, "-"}},
         difference(slip_scores_, nested_scores_.back())});
  }
  for (const FoundSpread& spread : spreads_) {
    found.push_back({spread.row->effect, spread.fit.gain, spread.fit.estimates,
                     difference(spread.scores, nested_scores_.back())});
  }
  if (study_.quantum_m > 0) {
    const double q = study_.quantum_m;
    found.push_back(
        {"pose_quantisation", pose_grid_gain(), {{"step", q, 0.99 * q, 1.01 * q, "m"}}, {}});
  }
  return found;
}

NamedEffect DiagnosisRun::named(const SpreadEffect& found) const {
  NamedEffect effect;
  effect.name = found.name;
  effect.confidence = confidence_of(found.gain, subject_.least_gain);
  effect.parameters = found.estimates;
  if (!found.gained.empty()) {
    effect.gap_after = -mean(found.gained);
    set_closed(&effect, found.gained);
    return effect;
  }
  // The gain is over all that the readings tell; of the gap it can close what the means left.
  const double per_trial = std::min(found.gain / static_cast<double>(study_.size()),
                                    std::max(0.0, floor_ - mean(nested_scores_.back())));
  effect.gap_after = -per_trial;
  set_closed(&effect, std::vector<double>(study_.size(), per_trial));
  return effect;
}

// Greatest gain first; each one's gap goes on from the one before.
void DiagnosisRun::name_effects() {
  std::vector<std::pair<double, NamedEffect>> all;
  for (std::size_t k = 0; k < chosen_.size(); ++k) {
    all.emplace_back(chosen_[k].candidate.gain, named(k, *estimates_));
  }
  for (const SpreadEffect& found : spread_effects_found()) {
    all.emplace_back(found.gain, named(found));
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  double gap = floor_ - mean(nested_scores_.front());
  for (auto& [gain, effect] : all) {
    const double change = effect.gap_after - effect.gap_before;
    effect.gap_before = gap;
    effect.gap_after = gap += change;
    effect.text = effect_sentence(effect, *subject_.effects);
    result_.diagnosis.effects.push_back(std::move(effect));
  }
}

void DiagnosisRun::fill_gap() {
  Diagnosis& d = result_.diagnosis;
  const std::vector<std::size_t> folds = subject_.folds(study_);
  d.gap.tuned = floor_ - mean(nested_scores_.front());
  d.gap.final_ =
      d.effects.empty() ? floor_ - mean(nested_scores_.back()) : d.effects.back().gap_after;
  d.gap.floor = 0;
  const RootMeanSquare tuned =
      root_mean_square(held_out_residuals(nested_studies_.front(), nested_.front(), folds));
  const RootMeanSquare last =
      root_mean_square(held_out_residuals(nested_studies_.back(), nested_.back(), folds));
  double position = 0, heading = 0;
  for (const Eigen::Matrix3d& cov : nested_studies_.back().covariances()) {
    position += (cov(0, 0) + cov(1, 1)) / static_cast<double>(study_.size());
    heading += cov(2, 2) / static_cast<double>(study_.size());
  }
  d.position_mm = {tuned.position_mm, last.position_mm, 1e3 * std::sqrt(position)};
  d.heading_mrad = {tuned.heading_mrad, last.heading_mrad, 1e3 * std::sqrt(heading)};
}

void DiagnosisRun::fill_trials() {
  result_.diagnosis.shown = subject_.shown;
  result_.diagnosis.words = subject_.words;
  const JointFit& tuned = nested_.front();
  const JointFit& last = nested_.back();
  const std::vector<Eigen::Matrix3d> tuned_cov = nested_studies_.front().covariances();
  const std::vector<Eigen::Matrix3d> last_cov = nested_studies_.back().covariances();
  for (std::size_t i = 0; i < study_.size(); ++i) {
    const ResidualTrial& t = study_.trials[i];
    const Cell& cell = study_.cells[t.cell];
    DiagnosedTrial to;
    to.session = problem_.log.trials[i].session;
    to.trial = problem_.log.trials[i].trial;
    to.command = cell.command.name;
    to.session_time_s = t.context.session_time_s;
    to.duration_s = cell.command.duration_s;
    to.level = cell.level;
    to.place_in_run = t.context.place_in_run;
    to.held_out = true;  // every trial's scores come from the other folds
    to.X_WS = t.X_WS;
    to.X_WS.x += frame_m_.x();
    to.X_WS.y += frame_m_.y();
    TrialView view = subject_.view(study_, i);
    to.measured = between(view.X_WV, t.X_WE);
    to.tuned = between(view.X_WV, tuned.ends[i]);
    to.final_ = between(view.X_WV, last.ends[i]);
    to.tuned_cov = tuned_cov[i];
    to.final_cov = last_cov[i];
    to.tuned_residual = tuned.residuals[i];
    to.final_residual = last.residuals[i];
    if (view.turn_rad != 0) turn(view.turn_rad, &to);
    to.covariates = std::move(view.covariates);
    to.tuned_score = nested_scores_.front()[i];
    to.final_score = nested_scores_.back()[i];
    result_.diagnosis.trials.push_back(std::move(to));
  }
}

Status DiagnosisRun::report() {
  if (Status s = fit_residual(); !s) return s;
  name_effects();
  fill_gap();
  fill_trials();
  fill_values();
  Diagnosis& d = result_.diagnosis;
  const auto look = [&](const std::vector<Eigen::Vector3d>& residuals) {
    return subject_.where(study_, residuals, problem_);
  };
  d.where = look(nested_.front().residuals);
  const bool unexplained =
      d.verdict == Verdict::kUnknown || d.verdict == Verdict::kEffectAndUnknown;
  if (unexplained) d.unexplained = look(nested_.back().residuals);
  const std::vector<std::string> thin = subject_.cautions(study_, problem_.log);
  d.cautions.insert(d.cautions.end(), thin.begin(), thin.end());
  for (const Leftover& l : leftovers_) {
    if (l.log10_p < subject_.unknown_log10_p) {
      d.cautions.push_back("What is left still depends on " + l.covariate + ".");
    }
  }
  if (d.verdict == Verdict::kEffectAndUnknown) {
    if (Status s = look_for_second_places(); !s) return s;
  }
  if (Status s = compare_with_baselines(); !s) return s;
  fill_parameters();
  if (Status s = show_drives(); !s) return s;
  complete_screening();
  say_what_the_program_lacks();
  say_what_was_left_out();
  if (frame_m_.x() != 0 || frame_m_.y() != 0) {
    d.cautions.push_back(
        "The log lies far from the world's origin: model.toml counts places from x "
        "= " +
        plain_number(frame_m_.x()) + " m, y = " + plain_number(frame_m_.y()) +
        " m (its [frame]), and a seam's shift is the one there.");
  }
  if (Status s = plan_next(); !s) return s;
  tell(*subject_.effects, &d);
  return {};
}

}  // namespace gapfarm
