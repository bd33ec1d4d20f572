// The parameter table of scenario `racquetball`.
#pragma once

#include "common/parameters/table.h"

namespace gapfarm {

// Base rows in table order.  Lengths in m, as everywhere; the court is 20 m wide in each direction,
// like the one of the published paths.
enum class Racquetball : std::size_t {
#define ROW(name, row) name,
#define SETTING(name, member, row) name,
#include "common/parameters/racquetball_rows.inc"
  kCount
};
constexpr std::size_t row_of(Racquetball p) { return static_cast<std::size_t>(p); }

const ParameterTable& racquetball_table();

}  // namespace gapfarm
