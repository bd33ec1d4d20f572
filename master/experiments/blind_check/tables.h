// The blind check's result for people and for programs.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "master/experiments/blind_check/cases/design.h"
#include "master/experiments/blind_check/tally.h"

namespace gapfarm {

struct BlindReport {
  std::vector<std::pair<std::string, std::string>> provenance;  // label and value
  std::vector<ScoredCase> cases;
  std::vector<OutOfReach> out_of_reach;
};

// blind_check.json: provenance, rates with 95 % Wilson intervals, confusion matrix, cases.
std::string format_blind_json(const BlindReport& report);
// blind_check.md: the same as tables.
std::string format_blind_markdown(const BlindReport& report);
// The rates alone, for a terminal.
std::string format_blind_summary(const BlindReport& report);

// What would be made: every effect with its drawn parameters and size, and what is out of reach.
std::string format_design(const BlindDesign& design, const ParameterTable& table);

}  // namespace gapfarm
