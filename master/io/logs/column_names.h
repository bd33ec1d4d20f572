// What the names of columns say.
#pragma once

#include <string>
#include <vector>

#include "master/io/logs/bags.h"

namespace gapfarm {

// "*." in front: any path before.
using Aliases = std::vector<std::string>;

// "Vicon x [mm]" to "vicon.x"; paths and blanks become dots, units in brackets go.
std::string plain_name(const std::string& name);

// The first alias that a column has wins; empty: none has.
std::string column_of(const LogTable& table, const Aliases& aliases);

// Of a name, between what is no letter and no digit.
bool has_word(const std::string& name, const std::string& word);

// The unit in "v [km/h]" or "v (km/h)", where it is known.
std::string unit_in_name(const std::string& name);

// Two columns whose names differ by the side, left first; empty: there are none.
std::vector<std::string> sides_of(const LogTable& table);

// Adds a column for each two of which one has whole seconds and the other what goes beyond them, in
// ns, as builtin_interfaces/Time has: "header.stamp" of "header.stamp.sec" and
// "header.stamp.nanosec".  Not where there is one of that name.
void join_times(LogTable* table);

}  // namespace gapfarm
