// How an effect is reported.
#pragma once

#include <numbers>
#include <vector>

namespace gapfarm {

inline constexpr double kDegrees = 180 / std::numbers::pi;  // of a radian

// How a parameter is reported: the words around its value in a unit that people use.
struct ShownParameter {
  const char* key;
  double factor;
  const char* unit;
};

struct EffectPhrases {
  // %1, %2, ...: the tellings' values with their intervals; %a: a seam's axis.  Null: none.
  const char* sentence = nullptr;
  std::vector<ShownParameter> parameters = {};
};

// On one line.  %: the size of the parameter; @: the choice of the effect that is no number ("y").
struct ShortPhrases {
  const char* key;  // whose size is reported
  double factor;
  const char* unit;
  const char* cause;
  const char* opposite;  // where the value is negative; null: the same
  const char* remedy;
  const char* toward = nullptr;  // key of a direction that is reported, too
};

}  // namespace gapfarm
