// A diagnosis as the outside sees it (diagnosis.json): what the blind check judges.
#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"

namespace gapfarm {

struct SaidParameter {
  std::string key;
  double value = 0;
  double lo = 0;  // 90 % interval
  double hi = 0;
};

struct SaidEffect {
  std::string name;
  std::vector<std::string> aliases;
  double confidence = 0;
  std::vector<SaidParameter> parameters;
  double closed = 0;  // share of the explainable gap
};

struct Said {
  std::string verdict;  // "effect", "none", "unknown", "effect+unknown"
  std::vector<SaidEffect> effects;
};

// Parameters without numbers and an absent `closed` (as NaN) are let pass: they cost coverage, not
// the case.  Errors: not JSON, no known verdict, an effect without a name.
Result<Said> parse_said(const std::string& text, const std::string& file);

}  // namespace gapfarm
