// Sections of the report's page, as HTML.  Empty when the diagnosis has nothing for them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "master/diagnose/result/diagnosis.h"
#include "master/diagnose/result/parameter_row.h"

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

// A table of parameters before and after, and what to paste into a config.

// How a page calls a column, and which word of the glossary (glossary.h) says what it is.
struct TermColumn {
  std::string_view term, shown;
};
struct ParameterColumns {
  TermColumn before, after, interval;
};

// The section of the page: values with units, intervals, where they lie between their bounds with a
// warning at one, what makes up for what, and config_snippet() with a button that copies it.
// `none`: why there are no rows, where there are none.
std::string parameters_section(const std::vector<ParameterRow>& rows,
                               const std::vector<ParameterCorrelation>& correlations,
                               const ParameterColumns& columns, std::string_view none);

// [parameters] and [effects.NAME] as a config takes them (docs/configuration.md).  `intervals`: the
// rows' lo and hi are intervals of the values and stand beside them; else the rows' notes do.
std::string config_snippet(const std::vector<ParameterRow>& rows, bool intervals);

}  // namespace gapfarm
