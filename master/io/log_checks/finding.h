// What is wrong with a log or with its fit to a config, as a person would question it.
#pragma once

#include <string>
#include <vector>

#include "common/base/ranges.h"

namespace gapfarm {

enum class Severity {
  kNote,      // worth knowing; a diagnosis goes on
  kWarning,   // nothing is named because of it
  kUnusable,  // whatever a diagnosis reported would be about this and not about the robot
};

struct SanityFinding {
  std::string name;    // "unit_error", "axes_swapped", ...: docs/diagnosis.md lists them
  std::string text;    // the evidence, one or two sentences with figures
  std::string remedy;  // what to do, one sentence
  Severity severity = Severity::kUnusable;
  // Effects of the catalogue's kind: what a file or log has the wrong way round, rather than what
  // it lacks.  Those that would explain the evidence as well stand in `or_else`.
  bool names_an_effect = false;
  std::vector<std::string> or_else = {};
};

// Of logs of drives and of pushes alike.
inline constexpr const char* kEndsSwapped = "ends_swapped";
inline constexpr const char* kExchangeEnds = "Exchange x0 and x1, y0 and y1, theta0 and theta1.";

inline bool any_unusable(const std::vector<SanityFinding>& findings) {
  return contains(findings, Severity::kUnusable, &SanityFinding::severity);
}

// "left and right are exchanged": what a finding means, for a headline.
std::string finding_phrase(const SanityFinding& finding);

// "unusable", "doubt", "note".
const char* severity_name(Severity severity);

}  // namespace gapfarm
