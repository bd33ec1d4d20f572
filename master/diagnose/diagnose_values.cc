// The values that models are left with.

#include <algorithm>
#include <cmath>

#include "master/diagnose/diagnose_steps.h"
#include "master/diagnose/findings.h"

namespace gapfarm {

void DiagnosisRun::set_noise(const NoiseEstimate& noise, Overrides* at) const {
  const auto set = [&](const NoiseRow& to, double value) { (*at)[to.row] = value * to.unit; };
  set(subject_.drive_common, noise.drive_common);
  set(subject_.drive_side, noise.drive_side);
  set(subject_.pose_position, noise.pose.position_m);
  set(subject_.pose_heading, noise.pose.heading_rad);
  if (subject_.drive_tail) set(*subject_.drive_tail, noise.tails.drive);
  if (subject_.pose_tail) set(*subject_.pose_tail, noise.tails.reading);
}

// Of a side's speed, over the trials that the fits learned from.  An event's loss is uniform below
// the greatest; the trials left out are taken for the worst of those with an event on either side.
double DiagnosisRun::mean_loss_of_slips() const {
  const double either = slip_.probability * (2 - slip_.probability);
  const double left_out =
      static_cast<double>(std::count(study_.ignored.begin(), study_.ignored.end(), true));
  const double most =
      1 - std::min(1.0, left_out / std::max(1.0, either * static_cast<double>(study_.size())));
  return std::clamp(slip_.probability * most * slip_.loss * most / 2, 0.0, 0.5);
}

void DiagnosisRun::spread_effects(Overrides* at) const {
  const auto set = [&](const char* key, double value) { (*at)[problem_.table().row(key)] = value; };
  NoiseEstimate noise =
      residual_noise_ ? *residual_noise_ : nested_studies_.back().predictive_noise();
  if (study_.quantum_m > 0) {
    // The readings' noise was measured with the rounding in it.
    const double rounding2 = study_.quantum_m * study_.quantum_m / 12;
    set("pose_quantisation.step", study_.quantum_m);
    noise.pose.position_m =
        std::sqrt(std::max(0.0, noise.pose.position_m * noise.pose.position_m - rounding2));
  }
  noise.pose.position_m = std::max(1e-5, noise.pose.position_m);
  noise.pose.heading_rad = std::max(1e-5, noise.pose.heading_rad);
  for (const Signature& s : first_) {
    for (const auto& [key, value] : s.fixed) set(key.c_str(), value);
  }
  for (const FoundSpread& found : spreads_) {
    for (const Estimate& e : found.fit.estimates) {
      set((std::string(found.row->effect) + "." + e.key).c_str(), e.value);
    }
  }
  if (lag_.gain > 0) set("motor_lag.tau", lag_.tau_s);
  if (slip_.gain > 0) {
    set("slip_events.probability", std::clamp(slip_.probability, 0.0, 0.5));
    set("slip_events.loss", std::clamp(slip_.loss, 0.0, 1.0));
    noise.drive_common = slip_.noise.drive_common;
    noise.drive_side = slip_.noise.drive_side;
    // Without events in it the fitted speed has made up for those that were not left out.
    if (study_.drive.speed) (*at)[*study_.drive.speed] /= 1 - mean_loss_of_slips();
  }
  set_noise(noise, at);
}

// A model holds what the table accepts; what a log asks beyond that is said.
double DiagnosisRun::within_table(std::size_t row, double value) {
  const Parameter& p = problem_.table()[row];
  const double kept = std::clamp(value, p.lower, p.upper);
  if (kept != value) {
    auto& cautions = result_.diagnosis.cautions;
    const std::string said = p.key + " would be " + plain_number(value) +
                             ", which is beyond its bounds: the models have " +
                             problem_.table().format(row, kept) + ".";
    if (std::find(cautions.begin(), cautions.end(), said) == cautions.end()) {
      cautions.push_back(said);
    }
  }
  return kept;
}

void DiagnosisRun::fill_values() {
  const auto values_at = [&](Overrides at, bool with_effects) {
    if (with_effects) {
      spread_effects(&at);
    } else {
      set_noise(nested_studies_.front().predictive_noise(), &at);
    }
    ParameterValues values = problem_.values;
    for (const auto& [row, value] : at) values[row] = within_table(row, value);
    return values;
  };
  result_.tuned = values_at(nested_.front().at, false);
  result_.final_ = values_at(final_fit_ ? final_fit_->at : nested_.back().at, true);
  result_.intervals.assign(problem_.values.size(), {1, 0});
  for (const NamedEffect& effect : result_.diagnosis.effects) {
    for (const Estimate& e : effect.parameters) {
      const std::size_t row = problem_.table().row(effect.name + "." + e.key);
      const Parameter& p = problem_.table()[row];
      const double frame = frame_of(p.key, nested_.back().at);
      if (!(e.lo < e.hi)) continue;
      result_.intervals[row] = {std::max(e.lo - frame, p.lower), std::min(e.hi - frame, p.upper)};
    }
  }
}

}  // namespace gapfarm
