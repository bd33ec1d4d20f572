// One screen about a run.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "master/cli/console.h"
#include "master/store/run_status.h"

namespace gapfarm {

// A line of eight-level blocks, at most `width` of them, a blank where there is no value.  Longer
// series are cut into equal stretches and show the last value of each.  The scale leaves out the
// worst tenth of the values, so that a bad first generation does not flatten the rest.
std::string sparkline(const std::vector<std::optional<double>>& values, std::size_t width,
                      bool higher_is_better);

std::string status_screen(const RunStatus& status, const std::string& run, const Console& console);

}  // namespace gapfarm
