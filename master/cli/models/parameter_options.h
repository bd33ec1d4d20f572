// Parameters on the command line.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/problem/problem.h"

namespace gapfarm {

// A value as tables and command lines have it: a number, a choice's name, true or false.
std::optional<double> value_of_text(const Parameter& row, const std::string& text);

// "battery_sag.rate=0.01", "robot=wheels" into the problem's values.  Errors: no such parameter, a
// value that it does not accept; they name the option.
Status apply_setting(const std::string& setting, Problem& problem,
                     const std::string& option = "--set");

// "KEY", with the table's range, or "KEY=LOWER,UPPER", as the problem's genes.  Errors as above, an
// empty range, a key twice; they name the option.
Status apply_genes(const std::vector<std::string>& genes, Problem& problem,
                   const std::string& option = "--genes");

}  // namespace gapfarm
