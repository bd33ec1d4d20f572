// Configs: TOML files to typed settings (docs/configuration.md).
#pragma once

#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/config/settings.h"

namespace gapfarm {

// Keys that the file leaves out keep their defaults.  The error lists everything that is wrong, a
// line each: "file:line:column: sentence", with "did you mean" for unknown words.
Result<Config> parse_config(std::string_view text, const std::string& path);
// Looks among the shipped ones too (shipped_file).
Result<Config> read_config(const std::string& path);

// What evolving needs beyond a config that reads: at least one gene.
Status check_evolvable(const Config& config);

}  // namespace gapfarm
