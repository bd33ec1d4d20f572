// Configs: TOML files to typed settings (docs/configuration.md).
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/config/settings.h"

namespace gapfarm {

using ProgramStarter = std::function<Result<std::string>(const ExternalCommand&)>;
// An error: whoever only reads starts nothing.
Result<std::string> start_no_program(const ExternalCommand& command);
// Starts it, reads its first line and ends it.
Result<std::string> start_program(const ExternalCommand& command);

// Keys that the file omits keep their defaults.  The error lists everything that is wrong, a
// line each: "file:line:column: sentence", with "did you mean" for unknown words.
// `start` starts the simulator that scenario `external` names, and returns how it introduces
// itself.
Result<Config> parse_config(std::string_view text, const std::string& path,
                            const ProgramStarter& start = start_no_program);
// The same where the problem is known: robot and program are its own, no robot's file is read and
// nothing is started.
Result<Config> parse_config_of(const Problem& known, std::string_view text,
                               const std::string& path);
// Looks among the shipped ones too (shipped_file).
Result<Config> read_config(const std::string& path);

// What evolving needs beyond a config that reads: at least one gene.
Status check_evolvable(const Config& config);

// An error where the scenario is `objective`, for what needs trials or motions; `path` names it.
Status check_moves(const std::string& scenario, const std::string& path);

}  // namespace gapfarm
