#include "master/diagnose/fit/intervals.h"

#include <cmath>

#include "master/diagnose/subject.h"

namespace gapfarm {
namespace {

double model_error(const EffectDiagnosis& effect, const Parameter& p, double value) {
  return p.key.ends_with(".direction") ? effect.direction_error_rad
                                       : effect.model_error * (value - p.nominal);
}

}  // namespace

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
