// [residual] of a model.  Internal to common/config.
#pragma once

#include <string>

#include "common/config/model.h"
#include "common/config/toml_section.h"

namespace gapfarm {

void read_residual(TomlSection& top, Model& model);
// Empty where there is none.
std::string residual_section(const Model& model);
Status check_residual_of(const Model& model);

}  // namespace gapfarm
