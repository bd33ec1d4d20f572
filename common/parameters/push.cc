#include "common/parameters/push.h"

#include "common/base/constants.h"
#include "common/parameters/rows.h"

namespace gapfarm {
namespace {

// Of one of the config's pieces.
Parameter own_shape_factor(int piece) {
  const std::string number = std::to_string(piece);
  return rows::real("shape_factor_" + number, "-", 0, 1, 0,
                    "the same of the config's piece " + number + "; 0: shape_factor");
}

Parameter own_pressure(int piece) {
  const std::string number = std::to_string(piece);
  return rows::real("pressure_" + number, "-", 0, 10, 0,
                    "the same of the config's piece " + number + "; 0: pressure");
}

std::vector<Parameter> push_rows() {
  using namespace rows;  // NOLINT: what follows is rows
#define ROW(name, row) row,
#define SETTING(name, member, row) row,
  return {
#include "common/parameters/push_rows.inc"
  };
}

}  // namespace

const ParameterTable& push_table() {
  static const ParameterTable table(push_rows(), push_effects());
  return table;
}

bool rests_on_its_face(const ParameterValues& values) {
  const std::size_t row = row_of(Push::kModel);
  return push_table()[row].choices[static_cast<std::size_t>(values[row])] == "distributed";
}

}  // namespace gapfarm
