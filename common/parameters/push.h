// Base rows of scenario `push`.
#pragma once

#include "common/parameters/table.h"

namespace gapfarm {

// In table order; `values[row_of(Push::kGroundFriction)]` is the friction of piece and table.
enum class Push : std::size_t {
#define ROW(name, row) name,
#define SETTING(name, member, row) name,
#include "common/parameters/push_rows.inc"
  kCount
};
constexpr std::size_t row_of(Push p) { return static_cast<std::size_t>(p); }
// Pieces that can have a shape factor or a pressure of their own.
inline constexpr std::size_t kOwnShapeFactors = 8;

const ParameterTable& push_table();

// Whether `model` carries pieces on their whole face, so that `pressure` takes the place of
// `shape_factor`.
bool rests_on_its_face(const ParameterValues& values);

}  // namespace gapfarm
