#include "master/diagnose/effect_diagnosis.h"

#include <algorithm>
#include <cmath>

#include "common/math/laws.h"
#include "master/diagnose/subject.h"

namespace gapfarm {
namespace {

// A size is off by a factor: whatever it is, an effect that is there keeps its sign.
IntervalSides model_error(const EffectDiagnosis& effect, const Parameter& p, double value) {
  if (p.key.ends_with(".direction")) {
    return {kNormal90 * effect.direction_error_rad, kNormal90 * effect.direction_error_rad};
  }
  const auto own = std::ranges::find_if(effect.searched, [&](const SearchedSize& size) {
    return size.model_error > 0 && p.key == p.effect + "." + size.key;
  });
  const double error = own == effect.searched.end() ? effect.model_error : own->model_error;
  const double size = value - p.nominal, factor = std::pow(1 + error, kNormal90);
  const IntervalSides grown = {std::abs(size) * (1 - 1 / factor), std::abs(size) * (factor - 1)};
  return size < 0 ? IntervalSides{grown.above, grown.below} : grown;
}

}  // namespace

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

IntervalSides interval_sides(const Study& study, const ParameterTable& table, std::size_t row,
                             const Overrides& at, double gain, double fitted) {
  const Parameter& p = table[row];
  const double value = at.at(row);
  const EffectDiagnosis& effect = study.subject->effects->row(p.effect);
  const double searched = effect.search_error == nullptr ? 0 : effect.search_error(p, value, gain);
  const double open = effect.ambiguity == nullptr ? 0 : effect.ambiguity(study, p, at);
  const double rest = kNormal90 * std::hypot(fitted, searched, open);
  // A place is no size: how far it is from the world's origin makes it no less sure.
  const bool is_place = place_of(*study.subject->effects, p) != nullptr;
  const IntervalSides model = is_place ? IntervalSides() : model_error(effect, p, value);
  return {std::hypot(rest, model.below), std::hypot(rest, model.above)};
}

}  // namespace gapfarm
