// diagnosis.json (docs/formats.md): written for other programs, read back by `gapfarm report`.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/json/json.h"
#include "master/diagnose/result/diagnosis.h"

namespace gapfarm {

// The whole file, UTF-8.  Numbers are written so that they read back to the same bits; one that is
// not finite becomes null, and bytes that are not UTF-8 become U+FFFD.
std::string to_json(const Diagnosis& diagnosis);

// Reads what to_json() wrote.  Fields it does not know are ignored, so later versions may add some;
// null reads as NaN.  Errors name the field, what was found and what was expected.
Result<Diagnosis> parse_diagnosis(std::string_view text);

Json summary_json(const Diagnosis& diagnosis);

// [{"name", "severity", "text", "remedy"}, ...]
Json sanity_json(const std::vector<SanityFinding>& findings);

// {"columns": ["session", ...], "rows": [[...], ...]}: a table, since there are many trials.
// `digits` significant digits a number; 0: as many as it takes to read back the same bits.
Json trials_json(const Diagnosis& diagnosis, int digits = 0);

// The inverse of trials_json().
Result<std::vector<DiagnosedTrial>> parse_trials(const Json& table,
                                                 const std::vector<ShownCovariate>& shown);

Json parameters_json(const std::vector<ParameterRow>& rows);
Json drives_json(const std::vector<ShownDrive>& drives);

}  // namespace gapfarm
