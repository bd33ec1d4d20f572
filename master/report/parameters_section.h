// A table of parameters before and after, and what to paste into a config.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "master/diagnose/result/parameter_row.h"

namespace gapfarm {

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
