// Findings in one line.
#pragma once

#include <string>

#include "master/io/log_checks/finding.h"

namespace gapfarm {

// "left and right are exchanged": what a finding means, for a headline.
std::string finding_phrase(const SanityFinding& finding);

// "unusable", "doubt", "note".
const char* severity_name(Severity severity);

}  // namespace gapfarm
