// The values that models are left with.

#include <algorithm>
#include <cmath>

#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/conclusions/report_parts.h"
#include "master/diagnose/steps/step_parts.h"

namespace gapfarm::steps {
namespace {

// Of what widens the distribution, into values of base and effects.
void set_spreads(const DiagnosisRequest& of, const Refit& refit, Overrides* at) {
  const Explanation& named = refit.judged.named;
  const auto set = [&](const std::string& key, double value) {
    (*at)[of.table().row(key)] = value;
  };
  NoiseEstimate noise = refit.noise ? *refit.noise : refit.nested.back().study.predictive_noise();
  if (named.grid_m > 0) {
    // The readings' noise was measured with the rounding in it.
    const double rounding2 = named.grid_m * named.grid_m / 12;
    set("pose_quantisation.step", named.grid_m);
    noise.pose.position_m =
        std::sqrt(std::max(0.0, noise.pose.position_m * noise.pose.position_m - rounding2));
  }
  noise.pose.position_m = std::max(1e-5, noise.pose.position_m);
  noise.pose.heading_rad = std::max(1e-5, noise.pose.heading_rad);
  for (const Signature& s : named.first) {
    for (const auto& [key, value] : s.fixed) set(key, value);
  }
  for (const FoundSpread& found : named.spreads) {
    for (const Estimate& e : found.fit.estimates) {
      set(std::string(found.row->effect) + "." + e.key, e.value);
    }
  }
  if (named.lag.gain > 0) set("motor_lag.tau", named.lag.tau_s);
  if (named.slip.gain > 0) {
    set("slip_events.probability", std::clamp(named.slip.probability, 0.0, 0.5));
    set("slip_events.loss", std::clamp(named.slip.loss, 0.0, 1.0));
    noise.drive_common = named.slip.noise.drive_common;
    noise.drive_side = named.slip.noise.drive_side;
    // Without events in it the fitted speed has made up for those that were not omitted.
    if (const auto& speed = named.study().drive.speed) {
      (*at)[*speed] /= 1 - mean_loss_of_slips(named);
    }
  }
  set_noise(of, noise, at);
}

ParameterValues within_table(const DiagnosisRequest& of, const Overrides& at,
                             std::vector<std::string>* cautions) {
  ParameterValues values = of.problem.values;
  for (const auto& [row, value] : at) {
    const Parameter& p = of.table()[row];
    values[row] = std::clamp(value, p.lower, p.upper);
    if (values[row] == value) continue;
    const std::string claim = p.key + " would be " + plain_number(value) +
                              ", which is beyond its bounds: the models have " +
                              of.table().format(row, values[row]) + ".";
    if (std::find(cautions->begin(), cautions->end(), claim) == cautions->end()) {
      cautions->push_back(claim);
    }
  }
  return values;
}

}  // namespace

void set_noise(const DiagnosisRequest& of, const NoiseEstimate& noise, Overrides* at) {
  const DiagnosisSubject& subject = of.subject;
  const auto set = [&](const NoiseRow& to, double value) { (*at)[to.row] = value * to.unit; };
  set(subject.drive_common, noise.drive_common);
  set(subject.drive_side, noise.drive_side);
  set(subject.pose_position, noise.pose.position_m);
  set(subject.pose_heading, noise.pose.heading_rad);
  if (subject.drive_tail) set(*subject.drive_tail, noise.tails.drive);
  if (subject.pose_tail) set(*subject.pose_tail, noise.tails.reading);
}

void fill_values(const DiagnosisRequest& of, const Refit& refit, DiagnosisResult* result) {
  const NestedFit &base = refit.nested.front(), &last = refit.nested.back();
  Overrides tuned = base.fit.at, final_ = refit.final_fit ? refit.final_fit->at : last.fit.at;
  set_noise(of, base.study.predictive_noise(), &tuned);
  set_spreads(of, refit, &final_);
  result->tuned = within_table(of, tuned, &result->diagnosis.cautions);
  result->final_ = within_table(of, final_, &result->diagnosis.cautions);
  result->intervals.assign(of.problem.values.size(), {1, 0});
  for (const NamedEffect& effect : result->diagnosis.effects) {
    for (const Estimate& e : effect.parameters) {
      const std::size_t row = of.table().row(effect.name + "." + e.key);
      const Parameter& p = of.table()[row];
      const double frame = of.frame_of(p.key, last.fit.at);
      if (!(e.lo < e.hi)) continue;
      result->intervals[row] = {std::max(e.lo - frame, p.lower), std::min(e.hi - frame, p.upper)};
    }
  }
}

}  // namespace gapfarm::steps
