// One screen about a run or another long command.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "master/command/console.h"
#include "master/store/command_record.h"
#include "master/store/run_status.h"

namespace gapfarm {

// A line of eight-level blocks, at most `width` of them, a blank where there is no value.  Longer
// series are cut into equal stretches and show the last value of each.  The scale omits the
// worst tenth of the values, so that a bad first generation does not flatten the rest.
std::string sparkline(const std::vector<std::optional<double>>& values, std::size_t width,
                      bool higher_is_better);

std::string status_screen(const RunStatus& status, const std::string& run, const Console& console);

// One about a diagnosis, a comparison or a study in `folder`.
std::string command_screen(const CommandRecord& record, const std::string& folder,
                           double now_unix_s, const Console& console);

}  // namespace gapfarm
