// What rows of an effect catalogue are written with.
#pragma once

#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "common/effects/catalogue.h"

namespace gapfarm::effect_rows {

inline EffectParameter real(const char* key, const char* unit, double neutral, double lower,
                            double upper, const char* summary) {
  return {key, unit, neutral, lower, upper, summary, {}};
}

// Any direction of the plane, or `most` to either side.
inline EffectParameter direction(const char* summary, double most = std::numbers::pi) {
  return real("direction", "rad", 0, -most, most, summary);
}

inline EffectParameter choice(const char* key, std::vector<std::string> choices,
                              const char* summary) {
  const auto last = static_cast<double>(choices.size() - 1);
  return {key, "-", 0, 0, last, summary, std::move(choices)};
}

inline Effect effect(EffectStage stage, const char* name, unsigned context, const char* summary,
                     std::vector<EffectParameter> parameters, std::size_t strengths) {
  return {name, stage, context, summary, std::move(parameters), strengths};
}
inline Effect drive(const char* name, unsigned context, const char* summary,
                    std::vector<EffectParameter> parameters, std::size_t strengths = 1) {
  return effect(EffectStage::kDrive, name, context, summary, std::move(parameters), strengths);
}
inline Effect floor(const char* name, unsigned context, const char* summary,
                    std::vector<EffectParameter> parameters, std::size_t strengths = 1) {
  return effect(EffectStage::kFloor, name, context, summary, std::move(parameters), strengths);
}
inline Effect camera(const char* name, unsigned context, const char* summary,
                     std::vector<EffectParameter> parameters, std::size_t strengths = 1) {
  return effect(EffectStage::kCamera, name, context, summary, std::move(parameters), strengths);
}

inline Effect in_spread(Effect effect) {
  effect.shows = EffectShows::kSpread;
  return effect;
}
inline Effect of_the_robot(Effect effect) {
  effect.of_the_robot = true;
  return effect;
}
inline Effect by_chance(Effect effect) {
  effect.shows = EffectShows::kChance;
  return effect;
}

}  // namespace gapfarm::effect_rows
