// A diagnosis as the outside sees it (diagnosis.json): what the blind check judges.
#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"

namespace gapfarm {

struct ReportedParameter {
  std::string key;
  double value = 0;
  double lo = 0;  // 90 % interval
  double hi = 0;
};

struct ReportedEffect {
  std::string name;
  std::vector<std::string> aliases;
  double confidence = 0;
  std::vector<ReportedParameter> parameters;
  double closed = 0;  // share of the explainable gap
};

struct Reported {
  std::string verdict;  // "effect", "none", "unknown", "effect+unknown"
  std::vector<ReportedEffect> effects;
};

// Parameters without numbers and an absent `closed` (as NaN) are let pass: they cost coverage, not
// the case.  Errors: not JSON, no known verdict, an effect without a name.
Result<Reported> parse_reported(const std::string& text, const std::string& file);

}  // namespace gapfarm
