// The diagnosis as one self-contained page: no network, its own scripts and styles only.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "master/diagnose/result/diagnosis.h"
#include "master/diagnose/result/parameter_row.h"

namespace gapfarm {

// The whole file, UTF-8.  It holds the diagnosis as JSON too (see script_safe() for how), plots it
// with scripts whose hashes its content security policy names, and reads as text without them.
// The same diagnosis gives the same bytes.
// `served`: by `gapfarm serve`.
std::string report_html(const Diagnosis& diagnosis, bool served = false);

enum class GapUnit { kNats, kMillimetres, kMilliradians };

struct GapPart {
  enum class Kind { kFloor, kUnnamed, kEffect };
  Kind kind = Kind::kFloor;
  std::string label;
  // In the split's unit.  Negative when adding the effect made held-out trials worse, which
  // lengthens the bar after, or when the final model does better than the floor: drawn as nothing.
  double amount = 0;
};

// tuned = floor + unexplained + every effect's part, exactly: an effect's part is how much the gap
// fell when it was added, in the order found, and the last one's reaches the final model.
struct GapSplit {
  GapUnit unit = GapUnit::kNats;
  double tuned = 0;
  double final_ = 0;
  std::vector<GapPart> parts;  // floor, unexplained, effects in order
};

// Where the steps of a unit were not measured for several effects, they share one part.
GapSplit split_gap(const Diagnosis& diagnosis, GapUnit unit);

// The section of the page.
std::string gap_split_html(const Diagnosis& diagnosis);

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

// How a page calls a column, and which word of the glossary (term()) says what it is.
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
