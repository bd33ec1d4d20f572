// Sections of the report's page, as HTML.  Empty when the diagnosis has nothing for them.
#pragma once

#include <string>
#include <vector>

#include "master/diagnose/result/diagnosis.h"

namespace gapfarm {

// Verdict, headline, what was found in words, and the three figures that matter.
std::string summary_section(const Diagnosis& diagnosis);

// What the sanity stage found; empty where nothing.
std::string sanity_section(const Diagnosis& diagnosis);

// Dependences of residuals, with buttons that show them in the plots; `file`: of its CSV.
std::string where_table(const std::vector<Where>& findings, const char* caption, const char* file);

std::string screening_section(const Diagnosis& diagnosis);
std::string shrinkage_section(const Diagnosis& diagnosis);
std::string next_section(const Diagnosis& diagnosis);
std::string cautions_section(const Diagnosis& diagnosis);
std::string provenance_section(const Diagnosis& diagnosis);

}  // namespace gapfarm
