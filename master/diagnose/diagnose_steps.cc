// Tuning, noise, screening, verdict.

#include "master/diagnose/diagnose_steps.h"

#include <algorithm>
#include <cmath>

#include "common/score/laws.h"
#include "common/score/statistics.h"
#include "master/diagnose/digits.h"
#include "master/diagnose/drive_noise.h"
#include "master/diagnose/effects/patch_places.h"
#include "master/diagnose/noise.h"

namespace gapfarm {
namespace {

constexpr double kSlippedSquared = 11.5;  // squared distance with 3 degrees of freedom: one in 110
constexpr double kLeastQuantum_m = 4e-4;

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
  const std::span<const Effect> known = problem_.table().effects();
  return std::find(options_.left_out.begin(), options_.left_out.end(), effect) !=
             options_.left_out.end() ||
         std::none_of(known.begin(), known.end(),
                      [&](const Effect& e) { return e.name == effect; });
}

bool DiagnosisRun::has_paths() const {
  return !problem_.external || (problem_.external->table.declaration().inputs & kExternalPath) != 0;
}

bool DiagnosisRun::looks_for(const std::string& effect, Looks look) const {
  return (subject_.looks & look) != 0 && !left_out(effect);
}

Status DiagnosisRun::tune() {
  Result<Study> study = subject_.make_study(problem_, options_.genes);
  if (!study) return study.error();
  study_ = std::move(*study);
  return subject_.tune(predictor_, options_.keep_base, &study_);
}

Status DiagnosisRun::rebuild_nuisances() {
  auto nuisances = subject_.nuisances(predictor_, study_);
  if (!nuisances) return nuisances.error();
  nuisances_ = std::move(*nuisances);
  blocks_ = subject_.blocks(study_);
  base_ = std::make_unique<Regression>(nuisances_, study_.whitened_residuals());
  return {};
}

Status DiagnosisRun::measure_noise() {
  if (Status s = rebuild_nuisances(); !s) return s;
  estimate_noise(*base_, blocks_, &study_);
  if (study_.trust.empty()) return rebuild_nuisances();
  // Again, without what far trials drew to themselves.
  if (Status s = rebuild_nuisances(); !s) return s;
  estimate_noise(*base_, blocks_, &study_);
  return rebuild_nuisances();
}

Status DiagnosisRun::search_catalogue() {
  std::vector<std::string> without = options_.left_out;
  if (lag_.trials > 0) without.emplace_back("motor_lag");
  auto catalogue = subject_.signatures(predictor_, study_, without);
  if (!catalogue) return catalogue.error();
  for (Signature& s : *catalogue) study_.drop_ignored(s.columns);
  selector_ = std::make_unique<Selector>(predictor_, study_, std::move(*catalogue), *base_);
  selector_->leave_out({options_.left_out.begin(), options_.left_out.end()});
  if (!left_out(kPatchEffect)) {
    selector_->look_for_patches([this] { return subject_.patches(predictor_, study_); });
  }
  std::vector<const Signature*> first;
  for (const Signature& s : first_) first.push_back(&s);
  auto all = selector_->candidates(selector_->with(first), {});
  if (!all) return all.error();
  result_.diagnosis.screening.clear();
  fill_screening(*all);
  tell_of_candidates(*all);
  candidates_ = std::move(*all);
  return select();
}

Status DiagnosisRun::screen() {
  if (!study_.on_bounds.empty()) tuned_ = study_;
  const Status looked = look_for_all();
  // A base on its bounds may be one that cannot be simulated with much of the catalogue.
  const bool fell = !looked && looked.error().code == ErrorCode::kSimulation;
  if (!looked && !(tuned_ && fell)) return looked;
  return tuned_ && (fell || chosen_.empty()) ? doubt_base() : Status{};
}

Status DiagnosisRun::look_for_all() {
  if (Status s = look_for_latency(); !s) return s;
  if (Status s = look_for_lag(); !s) return s;
  look_for_spreads(*base_);
  if (Status s = search_catalogue(); !s) return s;
  if (tuned_) {
    if (Status s = free_base(); !s) return s;
    if (chosen_.empty()) return {};
  }
  if ((subject_.base_moves || tuned_) && estimates_) {
    if (Status s = search_again(); !s) return s;
  }
  if (Status s = look_for_spreads_again(); !s) return s;
  const Regression explained = this->explained();
  look_for_slip(explained);
  return slip_.gain > 0 ? select_without_slips(explained) : Status{};
}

Status DiagnosisRun::select() {
  estimates_.reset();
  auto chosen = selector_->select(
      first_, first_.empty() ? 0 : latency_.gain,
      [&](const std::vector<EffectCandidate>& effects) { return relinearise(effects); });
  if (!chosen) return chosen.error();
  chosen_ = std::move(*chosen);
  return {};
}

// The effects fitted together, base and nuisances beside them to first order.
Result<JointFit> DiagnosisRun::estimate(const std::vector<EffectCandidate>& effects, int rounds) {
  const bool moves = subject_.base_moves || tuned_;
  Overrides start = start_of(effects);
  for (const EffectCandidate& effect : effects) {
    for (const auto& [row, value] : estimates_ ? estimates_->at : Overrides{}) {
      const std::string& of = problem_.table()[row].effect;
      if (of == effect.signature.effect || (of.empty() && moves)) start[row] = value;
    }
  }
  const BaseParameters base = moves ? BaseParameters::kFitted : BaseParameters::kHeld;
  auto fit = fit_jointly(predictor_, study_, effects, start, base, nuisances_, rounds);
  if (!fit) return fit;
  const auto moved = move_seams(predictor_, study_, nuisances_, &*fit);
  if (!moved) return moved.error();
  if (!*moved) return fit;
  return fit_jointly(predictor_, study_, effects, fit->at, base, nuisances_, rounds);
}

Result<Relinearised> DiagnosisRun::relinearise(const std::vector<EffectCandidate>& effects) {
  auto fit = estimate(effects, 2);
  if (!fit && fit.error().code == ErrorCode::kSimulation) return Relinearised{};
  if (!fit) return fit.error();
  std::vector<PredictionRequest> without;
  for (const EffectCandidate& effect : effects) {
    without.push_back({fit->at, {}});
    std::erase_if(without.back().at, [&](const auto& entry) {
      return problem_.table()[entry.first].effect == effect.signature.effect;
    });
  }
  const auto ends = predictor_.attempt(without);
  if (!ends) return ends.error();
  for (const auto& simulated : *ends) {
    if (!simulated) return Relinearised{};
  }
  estimates_ = std::move(*fit);
  tell_of_fit(*estimates_);
  Relinearised at_estimate{study_.whiten(estimates_->residuals), {}};
  for (std::size_t k = 0; k < effects.size(); ++k) {
    std::vector<Eigen::Vector3d> contribution;
    for (std::size_t i = 0; i < study_.size(); ++i) {
      contribution.push_back(local_difference((*(*ends)[k])[i], estimates_->ends[i]));
    }
    std::vector<Eigen::Index> own;
    for (std::size_t p = 0; p < estimates_->parameters.size(); ++p) {
      const Parameter& row = problem_.table()[estimates_->parameters[p].row];
      if (row.effect == effects[k].signature.effect) own.push_back(static_cast<Eigen::Index>(p));
    }
    Eigen::MatrixXd columns(at_estimate.data.size(), static_cast<Eigen::Index>(own.size()) + 1);
    columns.col(0) = study_.whiten(contribution);
    columns.rightCols(columns.cols() - 1) = estimates_->jacobian(Eigen::all, own);
    at_estimate.data += columns.col(0);
    if (subject_.effects->row(effects[k].signature.effect).by_contact) {
      columns = split_by_kind(study_, columns);
    }
    study_.drop_ignored(columns);
    at_estimate.columns.push_back(std::move(columns));
  }
  study_.drop_ignored(at_estimate.data);
  return at_estimate;
}

void DiagnosisRun::drop_ignored() {
  Eigen::VectorXd residuals = study_.whitened_residuals();
  study_.drop_ignored(residuals);
  study_.drop_ignored(nuisances_);
  for (CovariateBlock& block : blocks_) study_.drop_ignored(block.columns);
  for (Signature& s : first_) study_.drop_ignored(s.columns);
  base_ = std::make_unique<Regression>(nuisances_, residuals);
}

// Trials in which a side slipped pull on every mean: the effects are looked for again without them.
Status DiagnosisRun::select_without_slips(const Regression& explained) {
  const Eigen::VectorXd z = studentised(explained, 0.2);
  study_.ignored.resize(study_.size(), false);
  for (std::size_t i = 0; i < study_.size(); ++i) {
    if (z.segment<3>(static_cast<Eigen::Index>(3 * i)).squaredNorm() > kSlippedSquared) {
      study_.ignored[i] = true;
    }
  }
  drop_ignored();
  selector_->recount(*base_);
  return select();
}

Regression DiagnosisRun::explained() const {
  std::vector<const Signature*> all;
  for (const Signature& s : first_) all.push_back(&s);
  for (const ChosenEffect& c : chosen_) all.push_back(&c.candidate.signature);
  return selector_->with(all);
}

double DiagnosisRun::explained_nats(const Regression& explained) const {
  return (selector_->nothing_explained().left_squares() - explained.left_squares()) / 2;
}

void DiagnosisRun::fill_screening(const std::vector<EffectCandidate>& candidates) {
  std::vector<Eigen::VectorXd> explained;
  for (const EffectCandidate& c : candidates) {
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
      row.p = chi_squared_above(gain.dimensions, gain.squares);
    }
    Overrides start;
    const auto values = start_values(study_, *base_, s);
    for (const auto& [key, value] : values) start[problem_.table().row(key)] = value;
    for (const auto& [key, value] : values) {
      if (key.rfind(s.effect + ".", 0) != 0) continue;
      const std::size_t at = problem_.table().row(key);
      row.estimate +=
          (row.estimate.empty() ? "" : ", ") + key.substr(key.find('.') + 1) + " " +
          problem_.table().format(at, rounded_to_digits(value + frame_of(key, start), 4));
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

void DiagnosisRun::name_nothing() {
  first_.clear();
  chosen_.clear();
  slip_ = {};
  spreads_.clear();
  lag_ = {};
  if (as_logged_) study_ = std::move(*as_logged_);
  as_logged_.reset();
  study_.quantum_m = 0;
}

void DiagnosisRun::judge_leftovers(const Regression& explained) {
  leftovers_ = leftovers(explained, blocks_);
  if (study_.misfit_columns > 0) compare_with_repeats();
  scale_ = leftover_scale(explained);
  result_.diagnosis.checks.clear();
  for (const Leftover& l : leftovers_) {
    result_.diagnosis.checks.push_back({l.covariate, l.log10_p, l.excess});
  }
}

Status DiagnosisRun::judge() {
  if (doubted_) return {};
  for (const SelectionStep& step : selector_->steps()) {
    result_.diagnosis.steps.push_back({step.explained, step.offered});
  }
  const Regression explained = this->explained();
  judge_leftovers(explained);
  double nats = explained_nats(explained) + slip_.gain + (as_logged_ ? latency_.gain : 0);
  for (const FoundSpread& found : spreads_) nats += found.fit.gain;
  const bool on_grid =
      (subject_.looks & kLooksForRounding) != 0 && study_.quantum_m > kLeastQuantum_m;
  const bool rounded = on_grid && !left_out("pose_quantisation");
  const bool named = !first_.empty() || !chosen_.empty() || slip_.gain > 0 || !spreads_.empty() ||
                     lag_.gain > 0 || rounded;
  Verdict& verdict = result_.diagnosis.verdict;
  const bool two = std::any_of(chosen_.begin(), chosen_.end(), [](const ChosenEffect& c) {
    return kind_of(c.candidate.signature.effect) != c.candidate.signature.effect;
  });
  verdict = judge_verdict(named, nats, leftovers_, subject_.unknown_log10_p,
                          two ? kWrongShareOfTwo : kWrongShare);
  if (on_grid && !rounded) {
    odd_readings_ =
        "The logged positions lie on a grid, which nothing that was looked for explains.";
    if (verdict == Verdict::kEffect) verdict = Verdict::kEffectAndUnknown;
  }
  if (!odd_readings_.empty()) {
    if (verdict != Verdict::kEffectAndUnknown) verdict = Verdict::kUnknown;
    result_.diagnosis.cautions.push_back(odd_readings_);
  }
  if (!odd_drives_.empty()) {
    verdict = verdict == Verdict::kEffect || verdict == Verdict::kEffectAndUnknown
                  ? Verdict::kEffectAndUnknown
                  : Verdict::kUnknown;
    result_.diagnosis.cautions.push_back(odd_drives_);
  }
  if (verdict == Verdict::kUnknown || verdict == Verdict::kEffectAndUnknown) {
    note_nearest(explained);
  }
  if (verdict == Verdict::kUnknown) {
    unnamed_ = chosen_;
    name_nothing();
  }
  if (!rounded) study_.quantum_m = 0;
  return {};
}

}  // namespace gapfarm
