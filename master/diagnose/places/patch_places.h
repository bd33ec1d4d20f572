// Patches as an effect's values.
#pragma once

#include <map>
#include <string>

#include "common/parameters/table.h"
#include "master/diagnose/fit/signatures.h"
#include "master/diagnose/places/patch.h"

namespace gapfarm {

inline constexpr char kPatchEffect[] = "friction_patch";

// The disc that a signature of the effect is of, and its parameters.
Patch patch_of(const Signature& signature);
std::map<std::string, double> patch_values(const Patch& patch);

// EffectDiagnosis::search_error of a patch.
double patch_search_error(const Parameter& p, double value, double gain);

}  // namespace gapfarm
