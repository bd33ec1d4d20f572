#include "master/diagnose/effect_diagnosis.h"

#include <algorithm>
#include <cmath>

#include "master/diagnose/subject.h"

namespace gapfarm {
namespace {

double model_error(const EffectDiagnosis& effect, const Parameter& p, double value) {
  return p.key.ends_with(".direction") ? effect.direction_error_rad
                                       : effect.model_error * (value - p.nominal);
}

}  // namespace

// A file a row.
#define ROW(name) extern const EffectDiagnosis name;
#include "master/diagnose/effects/rows.inc"
#undef ROW

const EffectDiagnoses& drive_effect_diagnoses() {
  static const EffectDiagnoses rows({
#define ROW(name) &name,
#include "master/diagnose/effects/rows.inc"
#undef ROW
  });
  return rows;
}

const EffectDiagnosis* EffectDiagnoses::find(std::string_view effect) const {
  const auto found = std::ranges::find(rows_, effect, &EffectDiagnosis::effect);
  return found == rows_.end() ? nullptr : *found;
}

std::size_t EffectDiagnoses::place_in_catalogue(std::string_view effect) const {
  const auto found = std::ranges::find(rows_, effect, &EffectDiagnosis::effect);
  return static_cast<std::size_t>(found - rows_.begin());
}

const EffectDiagnosis& EffectDiagnoses::row(std::string_view effect) const {
  static const EffectDiagnosis nothing = {.effect = ""};
  const EffectDiagnosis* found = find(effect);
  return found == nullptr ? nothing : *found;
}

const EffectDiagnosis& effect_diagnosis(std::string_view effect) {
  const EffectDiagnosis* driven = drive_effect_diagnoses().find(effect);
  return driven != nullptr ? *driven : push_effect_diagnoses().row(effect);
}

const WorldPlace* place_of(const EffectDiagnoses& effects, const Parameter& p) {
  const std::vector<WorldPlace>& places = effects.row(p.effect).places;
  const auto found = std::ranges::find_if(
      places, [&](const WorldPlace& place) { return p.key == p.effect + "." + place.key; });
  return found == places.end() ? nullptr : &*found;
}

EffectDiagnosis second_of_a_kind(EffectDiagnosis first, const char* effect, const char* sentence) {
  first.effect = effect;
  first.marks = nullptr;
  first.phrases = {sentence, first.phrases.parameters};
  return first;
}

void start_polar(const Polar& polar, const EffectStart& at, std::map<std::string, double>* values) {
  const Eigen::VectorXd& c = at.coefficients;
  const double strength = std::hypot(c[0], c[1]);
  (*values)[polar.strength] = polar.ratio ? std::exp(strength) : strength;
  (*values)[polar.direction] = std::atan2(c[1], c[0]) / polar.symmetry;
}

double error_beyond_fit(const Study& study, const ParameterTable& table, std::size_t row,
                        const Overrides& at, double gain) {
  const Parameter& p = table[row];
  const double value = at.at(row);
  const EffectDiagnosis& effect = study.subject->effects->row(p.effect);
  const double searched = effect.search_error == nullptr ? 0 : effect.search_error(p, value, gain);
  const double open = effect.ambiguity == nullptr ? 0 : effect.ambiguity(study, p, at);
  return std::hypot(model_error(effect, p, value), searched, open);
}

}  // namespace gapfarm
