// Tuning, noise, screening, verdict.

#include "master/diagnose/diagnose_steps.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>

#include "common/score/statistics.h"
#include "master/diagnose/drive_noise.h"
#include "master/diagnose/noise.h"
#include "master/diagnose/nuisance.h"

namespace gapfarm {
namespace {

constexpr double kLeastLatencyGain = 14;  // nats; the share and the age are searched on a grid
constexpr double kLeastSlipGain = 11;
constexpr double kLeastQuantum_m = 4e-4;
// Of fewer trials, a place or a direction that is searched for explains any of them.
constexpr std::size_t kFewestTrials = 40;

}  // namespace

void DiagnosisRun::stage(const std::string& name) {
  const auto now = std::chrono::steady_clock::now();
  if (!stage_.empty()) {
    result_.diagnosis.timing_s.emplace_back(stage_,
                                            std::chrono::duration<double>(now - began_).count());
  }
  stage_ = name;
  began_ = now;
  if (!name.empty() && options_.on_stage) options_.on_stage(name);
}

bool DiagnosisRun::left_out(const std::string& effect) const {
  return std::find(options_.left_out.begin(), options_.left_out.end(), effect) !=
         options_.left_out.end();
}

Status DiagnosisRun::tune() {
  Result<Study> study = make_study(problem_);
  if (!study) return study.error();
  study_ = std::move(*study);
  return tune_base(predictor_, options_.keep_base, &study_);
}

Status DiagnosisRun::rebuild_nuisances() {
  auto nuisances = nuisance_columns(predictor_, study_);
  if (!nuisances) return nuisances.error();
  nuisances_ = std::move(*nuisances);
  blocks_ = covariate_blocks(study_);
  base_ = std::make_unique<Regression>(nuisances_, study_.whitened_residuals());
  return {};
}

Status DiagnosisRun::measure_noise() {
  if (Status s = rebuild_nuisances(); !s) return s;
  estimate_noise(*base_, blocks_, &study_);
  return rebuild_nuisances();
}

// A late camera reads a pose before the motion has ended; the gap to the next reading shows it.
Status DiagnosisRun::look_for_latency() {
  if (left_out("pose_latency") || study_.gaps.size() < 20) return {};
  constexpr double kStep_s = 0.02;
  Overrides shorter = study_.base;
  shorter[problem_.table().row("timing_offset.offset")] = -kStep_s;
  const auto ends = predictor_.ends({{shorter, {}}});
  if (!ends) return ends.error();
  std::vector<Eigen::Vector3d> velocity;
  for (const Eigen::Vector3d& d : differences(study_, ends->front(), kStep_s)) {
    velocity.push_back(-d);
  }
  latency_ = fit_latency(study_.gaps, velocity, study_.noise.pose, study_.size());
  if (latency_.gain < kLeastLatencyGain) return {};
  std::vector<Eigen::Vector3d> late;
  for (std::size_t i = 0; i < study_.size(); ++i) {
    late.push_back(-latency_.weights[i] * latency_.latency_s * velocity[i]);
  }
  Signature s;
  s.effect = "pose_latency";
  s.columns = study_.whiten(late);
  s.fixed = {{"pose_latency.share", latency_.share}, {"pose_latency.latency", latency_.latency_s}};
  first_.push_back(std::move(s));
  return {};
}

Status DiagnosisRun::screen() {
  if (Status s = look_for_latency(); !s) return s;
  auto catalogue = signatures(predictor_, study_, options_.left_out);
  if (!catalogue) return catalogue.error();
  selector_ = std::make_unique<Selector>(predictor_, study_, std::move(*catalogue), *base_);
  if (!left_out("friction_patch")) {
    if (Status s = selector_->add_patches(); !s) return s;
  }
  std::vector<const Signature*> first;
  for (const Signature& s : first_) first.push_back(&s);
  auto all = selector_->candidates(selector_->with(first), {});
  if (!all) return all.error();
  fill_screening(*all);
  auto chosen = selector_->select(first_);
  if (!chosen) return chosen.error();
  chosen_ = std::move(*chosen);
  return {};
}

void DiagnosisRun::fill_screening(const std::vector<Candidate>& candidates) {
  std::vector<Eigen::VectorXd> explained;
  for (const Candidate& c : candidates) {
    explained.push_back(base_->explained(c.signature.columns));
  }
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Signature& s = candidates[i].signature;
    Screened row;
    row.effect = s.effect;
    row.gain = candidates[i].gain;
    const Gain gain = base_->gain(s.columns);
    if (gain.dimensions == 0) {
      row.note = "cannot be seen in this log: the base model absorbs all that it would do";
    } else {
      row.p = boost::math::cdf(
          boost::math::complement(boost::math::chi_squared(gain.dimensions), gain.squares));
    }
    for (const auto& [key, value] : start_values(study_, *base_, s)) {
      const std::size_t at = problem_.table().row(key);
      row.estimate += (row.estimate.empty() ? "" : ", ") + key.substr(key.find('.') + 1) + " " +
                      problem_.table().format(at, std::round(value * 1e5) / 1e5);
    }
    for (std::size_t j = 0; j < candidates.size(); ++j) {
      const double lengths = explained[i].norm() * explained[j].norm();
      if (i == j || lengths == 0) continue;
      if (std::abs(explained[i].dot(explained[j])) > kAliasCosine * lengths) {
        row.alias_set.push_back(candidates[j].signature.effect);
      }
    }
    result_.diagnosis.screening.push_back(std::move(row));
  }
}

// Events that slow one side in some trials show as a heavy tail along that side's derivative.
void DiagnosisRun::look_for_slip(const Regression& explained) {
  if (left_out("slip_events")) return;
  const Eigen::VectorXd z = studentised(explained, 0.2);
  std::size_t far = 0;
  for (Eigen::Index i = 0; i < z.size(); i += 3) far += z.segment<3>(i).squaredNorm() > 13 ? 1 : 0;
  if (far <= 4 && residual_kurtosis(z) <= 3.2) return;
  std::vector<bool> mask(study_.size(), true);
  for (const ChosenEffect& effect : chosen_) {
    if (effect.candidate.signature.effect != "camera_seam") continue;
    const auto& at = effect.candidate.signature.fixed;
    const bool x = at.at("camera_seam.axis") == 0;
    for (std::size_t i = 0; i < study_.size(); ++i) {
      const ResidualTrial& t = study_.trials[i];
      const double position = at.at("camera_seam.position");
      // Which camera saw a pose on the line is not known.
      mask[i] = std::abs((x ? t.X_WP.x : t.X_WP.y) - position) > 0.03 &&
                std::abs((x ? t.X_WS.x : t.X_WS.y) - position) > 0.01;
    }
  }
  for (std::size_t i = 0; !first_.empty() && i < study_.size(); ++i) {
    if (study_.trials[i].context.moved) mask[i] = false;
  }
  slip_ = fit_slip(study_.trials, study_.unwhiten(z), mask, study_.noise);
}

// Names nothing where the data are too few for a claim, and says so.
bool DiagnosisRun::too_thin() {
  if (study_.size() >= kFewestTrials) return false;
  first_.clear();
  chosen_.clear();
  study_.quantum_m = 0;
  result_.diagnosis.verdict = Verdict::kNone;
  result_.diagnosis.cautions.push_back(
      "Fewer than " + std::to_string(kFewestTrials) +
      " trials: the catalogue was screened, but no effect is named on so few.");
  return true;
}

void DiagnosisRun::judge() {
  if (too_thin()) return;
  std::vector<const Signature*> all;
  for (const Signature& s : first_) all.push_back(&s);
  for (const ChosenEffect& c : chosen_) all.push_back(&c.candidate.signature);
  const Regression explained = selector_->with(all);
  look_for_slip(explained);
  leftovers_ = leftovers(explained, blocks_);
  const Eigen::VectorXd left = explained.left();
  std::vector<double> squares(left.data(), left.data() + left.size());
  for (double& s : squares) s *= s;
  scale_ = std::clamp(median(squares) / 0.455, 0.9, 1.4);

  const double nats = (base_->left_squares() - explained.left_squares()) / 2;
  const bool slips = slip_.gain > kLeastSlipGain;
  const bool rounded = study_.quantum_m > kLeastQuantum_m && !left_out("pose_quantisation");
  const bool named = !first_.empty() || !chosen_.empty() || slips || rounded;
  result_.diagnosis.verdict = judge_verdict(named, nats + (slips ? slip_.gain : 0), leftovers_);
  if (result_.diagnosis.verdict == Verdict::kUnknown) {
    first_.clear();
    chosen_.clear();
    slip_ = {};
  }
  if (!slips) slip_ = {};
  if (!rounded || result_.diagnosis.verdict == Verdict::kUnknown) study_.quantum_m = 0;
}

}  // namespace gapfarm
