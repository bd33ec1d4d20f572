// What a row of a recording says, by the map of its columns.
#pragma once

#include <vector>

#include "master/io/logs/column_map.h"

namespace gapfarm {

// {t, x, y, theta} out of the mapped columns; false where nothing was measured.
bool to_pose(const TableMap& map, std::vector<double>& values);

// The values at the time from which on they hold (poses: at which they were measured): of counts,
// and of what they changed by, a change a second from the row before up to this one.  `before`: of
// the same run, as it was; empty: there is none.  False where nothing can be said yet.
bool at_its_time(const TableMap& map, bool poses, std::vector<double>& before,
                 std::vector<double>& values);

}  // namespace gapfarm
