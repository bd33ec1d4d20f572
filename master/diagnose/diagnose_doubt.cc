// When no effect is to be named, and how a diagnosis ends that cannot go on.

#include <algorithm>
#include <cmath>

#include "common/score/statistics.h"
#include "master/diagnose/diagnose_steps.h"
#include "master/diagnose/digits.h"
#include "master/diagnose/effects/patch_places.h"
#include "master/diagnose/findings.h"
#include "master/diagnose/headline.h"
#include "master/sanity/words.h"

namespace gapfarm {
namespace {

// A parameter within this share of its range from an end sits there.
constexpr double kAtBound = 1e-3;
// Nats a trial: the worst of 11 practice logs and of the real forward log keep 0.2 with their
// effects.
constexpr double kMostMissed = 3;
constexpr double kLittleClosed = 0.02;  // of the gap

bool at_bound(const EffectDiagnoses& effects, const Parameter& row, double value) {
  if (row.kind != ParameterKind::kReal || place_of(effects, row) != nullptr) return false;
  if (row.key.ends_with(".direction")) return false;
  // What cannot be negative counts by its logarithm: a twentieth of the friction is far from none.
  const bool ratio = row.lower > 0;
  const auto at = [&](double x) { return ratio ? std::log(x) : x; };
  const double near = kAtBound * (at(row.upper) - at(row.lower));
  return at(value) <= at(row.lower) + near || at(value) >= at(row.upper) - near;
}

}  // namespace

// Tuning that ends on a bound would have gone on: another robot, or another log than the config's.
SanityFinding DiagnosisRun::on_bounds() const {
  std::vector<std::string> where;
  for (std::size_t row : tuned_->on_bounds) {
    const Parameter& p = problem_.table()[row];
    where.push_back(p.key + " " +
                    problem_.table().format(row, rounded_to_digits(tuned_->base.at(row), 3)) +
                    " (from " + problem_.table().format(row, p.lower) + " to " +
                    problem_.table().format(row, p.upper) + ")");
  }
  return {"base_on_bounds",
          "Tuning the base ended on the edge of what scenario " + problem_.scenario +
              " can be: " + listed(where) +
              ". A robot that needs such values is probably not one of this kind, so whatever the "
              "catalogue explained would be its being another one.",
          "Check what the config says of the robot and of duties and durations that the log leaves "
          "empty, or use a scenario that can be this robot.",
          Severity::kDoubt};
}

// A strong effect draws a base to its bounds, too; beside it the base comes back.  If not, nothing
// stays chosen.
Status DiagnosisRun::free_base() {
  std::vector<EffectCandidate> effects;
  for (const ChosenEffect& c : chosen_) effects.push_back(c.candidate);
  if (effects.empty()) return {};
  const Eigen::MatrixXd none(static_cast<Eigen::Index>(3 * study_.size()), 0);
  auto fit =
      fit_jointly(predictor_, study_, effects, estimates_ ? estimates_->at : start_of(effects),
                  BaseParameters::kFitted, none, kMostRounds);
  if (!fit) return fit.error();
  if (!base_on_bounds(study_, fit->at).empty()) chosen_.clear();
  estimates_ = std::move(*fit);
  return {};
}

// Nor is anything left to explain beside it; of a robot of another kind there is.
bool DiagnosisRun::explains_bounds() const {
  return result_.diagnosis.verdict == Verdict::kEffect && !chosen_.empty() &&
         base_on_bounds(study_, nested_.back().at).empty();
}

// As if nothing had been looked for.
Status DiagnosisRun::doubt_base() {
  as_logged_.reset();
  tuned_alone_.clear();
  result_.diagnosis.screening.clear();
  result_.diagnosis.nearest.clear();
  const SanityFinding finding = on_bounds();
  study_ = std::move(*tuned_);
  tuned_.reset();
  doubt(finding);
  return rebuild_nuisances();
}

void DiagnosisRun::doubt(SanityFinding finding) {
  doubted_ = true;
  name_nothing();
  result_.diagnosis.verdict = Verdict::kUnknown;
  result_.diagnosis.sanity.insert(result_.diagnosis.sanity.begin(), std::move(finding));
}

// With its effects the model should predict about as well as its noise allows.
void DiagnosisRun::doubt_misses() {
  const double gap = floor_ - mean(nested_scores_.back());
  if (doubted_ || !(gap > kMostMissed)) return;
  const bool named =
      !chosen_.empty() || !first_.empty() || slip_.gain > 0 || !spreads_.empty() || lag_.gain > 0;
  if (!named && result_.diagnosis.verdict != Verdict::kNone) return;
  misses_ = SanityFinding{
      "base_misses",
      "Even with everything that the catalogue offers the model loses " +
          plain_number(rounded_to_digits(gap, 3)) +
          " nats a trial against its own noise: it is not this robot's, and what fits such a gap "
          "best need not be a cause.",
      "Check robot, units and commands of the config against the log.", Severity::kDoubt};
}

// The chosen effect that is to be dropped and why: trials that no fit saw are predicted no better
// with it, or its best size is none or more than there can be.  The worst goes first: of two that
// are alike, the one after it may look worthless because of it.
// What closes next to nothing has to do so without doubt: beside a large gap a few nats are to be
// had by anything.  How much it closes is known only by the noise's own tails.
std::optional<std::pair<std::size_t, std::string>> DiagnosisRun::effect_to_drop(
    std::optional<double> perfect) const {
  const std::size_t before = as_logged_ ? 1 : 0;
  const double gap =
      perfect ? std::max(*perfect, mean(nested_scores_.back())) - mean(nested_scores_.front()) : 0;
  std::optional<std::size_t> worst;
  double least = INFINITY;
  for (std::size_t k = chosen_.size(); k-- > 0;) {
    const std::vector<double>&with = nested_scores_[before + k + 1],
          &without = nested_scores_[before + k];
    const double gain = mean(with) - mean(without);
    if (gain > 0 && (gain > kLittleClosed * gap || clearly_better(with, without))) continue;
    if (gain < least) worst = k;
    least = std::min(least, gain);
  }
  if (!worst) return std::nullopt;
  return std::pair{*worst,
                   std::string(" seemed to explain some of it, too, but trials that the fit "
                               "did not see are predicted no better with it.")};
}

std::optional<std::pair<std::size_t, std::string>> DiagnosisRun::effect_at_bound() const {
  for (std::size_t k = chosen_.size(); k-- > 0;) {
    for (const FittedParameter& fitted : estimates_->parameters) {
      const Parameter& row = problem_.table()[fitted.row];
      if (row.effect != chosen_[k].candidate.signature.effect) continue;
      if (!at_bound(*subject_.effects, row, fitted.value)) continue;
      return std::pair{
          k, " explains some of it only at the edge of what it can be (" + row.key + " = " +
                 problem_.table().format(fitted.row, rounded_to_digits(fitted.value, 4)) +
                 "), so it is not the cause."};
    }
  }
  return std::nullopt;
}

void DiagnosisRun::drop_effect(std::size_t k, const std::string& why) {
  const EffectCandidate& dropped = chosen_[k].candidate;
  result_.diagnosis.cautions.push_back(dropped.signature.effect + why);
  result_.diagnosis.nearest.push_back(
      {{dropped.signature.effect}, dropped.gain, 0, "", dropped.signature.effect + why});
  chosen_.erase(chosen_.begin() + static_cast<std::ptrdiff_t>(k));
  nested_.clear();
  nested_studies_.clear();
  nested_scores_.clear();
  result_.fits.clear();
}

// Every effect of the catalogue has a row, also those that no mean shows.
void DiagnosisRun::complete_screening() {
  std::vector<Screened>& rows = result_.diagnosis.screening;
  for (const Effect& effect : problem_.table().effects()) {
    const std::string& name = effect.name;
    const bool there =
        std::any_of(rows.begin(), rows.end(), [&](const Screened& s) { return s.effect == name; });
    // A second one of a kind is looked for where a first was found.
    const bool named = std::any_of(chosen_.begin(), chosen_.end(), [&](const ChosenEffect& c) {
      return c.candidate.signature.effect == name;
    });
    if (there || (!effect.repeats.empty() && !named)) continue;
    Screened& row = rows.emplace_back();
    row.effect = name;
    row.note = doubted_ ? "not looked for: no effect is to be named" : why_not_screened(name, &row);
  }
}

std::string DiagnosisRun::why_not_screened(const std::string& name, Screened* row) const {
  if (left_out(name)) return "left out of the catalogue as asked";
  if (predictor_.left_out().count(name)) return predictor_.left_out().at(name);
  const auto told = [&](double gain, const char* key, double value, const std::string& note) {
    row->gain = std::max(0.0, gain);
    if (gain > 0) {
      const std::size_t at = problem_.table().row(name + "." + key);
      row->estimate =
          std::string(key) + " " + problem_.table().format(at, rounded_to_digits(value, 4));
    }
    return note;
  };
  if (kind_of(name) != name) return "a second one, looked for beside the first";
  if (name == kPatchEffect) return "no disc of floor promises enough to be simulated";
  if (name == "slip_events") {
    return told(slip_.gain, "probability", slip_.probability,
                slip_.gain > 0 ? "by the tails of what is left"
                               : "single drives do not stray as slips would make them");
  }
  if (name == "pose_latency") {
    if (study_.gaps.size() < 20) return "too few resting poses were read twice";
    return told(latency_.gain, "latency",
                latency_from_rest_s_ > 0 ? latency_from_rest_s_ : latency_.latency_s,
                latency_.gain > 0 ? "by readings that fall behind the next ones"
                                  : "readings of one resting pose agree");
  }
  if (const SpreadRow* look = subject_.effects->row(name).spread) {
    for (const FoundSpread& found : spreads_) {
      if (found.row != look) continue;
      const Estimate& first = found.fit.estimates.front();
      return told(found.fit.gain, first.key.c_str(), first.value, look->found);
    }
    return look->missing;
  }
  if (name == "pose_quantisation") {
    return told(
        study_.quantum_m > 0 ? pose_grid_gain() : 0, "step", study_.quantum_m,
        study_.quantum_m > 0 ? "the positions lie on this grid" : "the positions lie on no grid");
  }
  if (name == "motor_lag" && lag_.trials > 0) {
    return told(lag_.gain, "tau", lag_.tau_s, "by the logged paths");
  }
  return "cannot be seen in this log: one level and one duration make it another full speed";
}

// What is known so far, as a report.
DiagnosisResult DiagnosisRun::give_up(const std::string& stage, const Error& error) {
  Diagnosis& d = result_.diagnosis;
  const bool base = study_.whitener.empty();
  d.verdict = base ? Verdict::kUnusable : Verdict::kUnknown;
  d.effects.clear();
  d.sanity.insert(d.sanity.begin(),
                  {base ? "base_not_simulated" : "unfinished",
                   "While it was to " + stage + ": " + error.message + ".",
                   base ? "Give the config values at which the robot moves and comes to rest."
                        : "Bring [parameters] nearer to the robot; --leave-out NAME goes on "
                          "without an effect.",
                   base ? Severity::kUnusable : Severity::kDoubt});
  d.trials.clear();
  d.drives.clear();
  d.parameters.clear();
  d.residual.reset();
  say_what_was_left_out();
  tell(*subject_.effects, &d);
  result_.tuned = problem_.values;
  for (const auto& [row, value] : study_.base) result_.tuned[row] = value;
  result_.final_ = result_.tuned;
  result_.intervals.assign(problem_.values.size(), {1, 0});
  result_.fits.clear();
  return std::move(result_);
}

void DiagnosisRun::say_what_the_program_lacks() {
  if (!problem_.external) return;
  const std::span<const Effect> known = problem_.table().effects();
  std::string lacking;
  for (const Effect& effect : srv1_effects()) {
    const bool there = std::any_of(known.begin(), known.end(),
                                   [&](const Effect& e) { return e.name == effect.name; });
    if (!there) lacking += (lacking.empty() ? "" : ", ") + effect.name;
  }
  if (lacking.empty()) return;
  result_.diagnosis.cautions.push_back(
      "Not looked for, since the program does not take what they need: " + lacking +
      ". It may declare more inputs, or parameters of its own.");
}

void DiagnosisRun::say_what_was_left_out() {
  for (const auto& [what, why] : predictor_.left_out()) {
    result_.diagnosis.cautions.push_back("Left out, since it cannot be simulated: " + what + " (" +
                                         why + ").");
  }
}

}  // namespace gapfarm
