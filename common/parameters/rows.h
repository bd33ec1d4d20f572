// What rows of a parameter table are written with.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "common/parameters/table.h"

namespace gapfarm::rows {

inline constexpr ParameterScale kLog = ParameterScale::kLog;

inline Parameter real(std::string key, const char* unit, double lower, double upper, double nominal,
                      std::string summary, ParameterScale scale = ParameterScale::kLinear) {
  return {std::move(key), unit,    ParameterKind::kReal, scale, lower,
          upper,          nominal, std::move(summary)};
}

inline Parameter integer(const char* key, const char* unit, double lower, double upper,
                         double nominal, const char* summary,
                         ParameterScale scale = ParameterScale::kLinear) {
  return {key, unit, ParameterKind::kInteger, scale, lower, upper, nominal, summary};
}

inline Parameter boolean(const char* key, bool nominal, const char* summary) {
  const double value = nominal ? 1 : 0;
  return {key, "-", ParameterKind::kBoolean, ParameterScale::kLinear, 0, 1, value, summary};
}

// The first choice is the nominal one.
inline Parameter choice(const char* key, std::vector<std::string> choices, const char* summary) {
  const auto last = static_cast<double>(choices.size() - 1);
  return {key, "-",     ParameterKind::kChoice, ParameterScale::kLinear, 0, last,
          0,   summary, std::move(choices)};
}

}  // namespace gapfarm::rows
