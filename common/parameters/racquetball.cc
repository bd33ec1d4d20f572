#include "common/parameters/racquetball.h"

#include "common/base/constants.h"
#include "common/parameters/rows.h"

namespace gapfarm {
namespace {

std::vector<Parameter> racquetball_rows() {
  using namespace rows;  // NOLINT: what follows is rows
#define ROW(name, row) row,
#define SETTING(name, member, row) row,
  return {
#include "common/parameters/racquetball_rows.inc"
  };
}

}  // namespace

const ParameterTable& racquetball_table() {
  static const ParameterTable table(racquetball_rows(), {});
  return table;
}

}  // namespace gapfarm
