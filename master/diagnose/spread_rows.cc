#include "master/diagnose/spread_row.h"

namespace gapfarm {

extern const SpreadRow kUnsettledStart;

std::span<const SpreadRow* const> spread_rows() {
  static const std::vector<const SpreadRow*> rows = {&kUnsettledStart};
  return rows;
}

const SpreadRow* spread_row(std::string_view effect) {
  for (const SpreadRow* row : spread_rows()) {
    if (row->effect == effect) return row;
  }
  return nullptr;
}

}  // namespace gapfarm
