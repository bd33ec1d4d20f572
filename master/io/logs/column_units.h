// What a recording's column is in SI.
#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"
#include "master/io/logs/column_map.h"
#include "master/io/logs/log_table.h"

namespace gapfarm {

// A number n of the column is slope n + offset.
struct SiLine {
  double slope, offset;
};

// Speeds of rims become those of wheels.  Errors: a unit that nobody knows, a rim's speed without
// the wheels' radius.
Result<SiLine> si_line(const LogTable& table, const TableMap& map, const MappedColumn& c,
                       bool poses);

bool has_all(const LogTable& table, const TableMap& map);

// Why no table gave rows of a kind ("poses"): a column without a number, or one that no table has.
Error no_rows(const std::vector<Recording>& recordings, const TableMap& map,
              const std::string& kind);

// What a counter that begins anew at `wraps` (0: never) would count by now without that, having
// counted to `before`; NaN: nothing yet.  REQUIRES: fewer than half of them a row.
double counted_on(double wraps, double before, double count);

// Whether a column, of 50 rows or more, steps by more than half of its range.
bool seems_to_wrap(const LogTable& table, std::size_t column);

}  // namespace gapfarm
