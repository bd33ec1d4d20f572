#include "master/io/logs/column_units.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "common/base/suggest.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

// The map's unit, else the file's where the map does not say what one of the column is.
Result<std::string> unit_of(const LogTable& table, const MappedColumn& c) {
  if (!c.unit.empty() || c.scale != 1) return c.unit;
  const std::string own = table.unit_of(c.column);
  const bool none = own.empty() || own == "-";
  if (none || unit_factor(own) != 0) return none ? "" : own;
  const std::string role = c.role + " = { column = \"" + c.column + "\", ";
  return text_error(table.source, table.units[*table.find(c.column)].place,
                    "unit " + quoted_word(own) + " of column " + quoted_word(c.column),
                    "one of s, ms, m, mm, rad, deg, rad/s, rpm, ... (docs/formats.md)" +
                        suggestion(own, known_units()),
                    "say in the map what one of it is in SI: " + role + "scale = 0.001 }, or " +
                        role + "unit = \"...\" }");
}

}  // namespace

Result<SiLine> si_line(const LogTable& table, const TableMap& map, const MappedColumn& c,
                       bool poses) {
  const Result<std::string> unit = unit_of(table, c);
  if (!unit) return unit.error();
  double factor = unit_factor(*unit);
  const bool length = *unit == "m" || *unit == "cm" || *unit == "mm";
  const bool speed = unit->ends_with("/s") && unit->find("m/") != unit->npos;
  const bool rim = !poses && (speed || (c.rate && length)) && c.role != "v" && c.role != "vy";
  if (rim && map.wheel_radius_m <= 0) {
    return Error{table.source + ":1: found column " + quoted_word(c.column) + " in " + *unit +
                 ", expected the wheels' radius too; print the map (--print-map), add "
                 "wheel_radius = 0.05 (m) to it and give it by --map"};
  }
  if (rim) factor /= map.wheel_radius_m;
  return SiLine{c.sign * c.scale / c.gear * factor, c.offset * factor};
}

double counted_on(double wraps, double before, double count) {
  if (!(wraps > 0) || !std::isfinite(before)) return count;
  return before + std::remainder(count - before, wraps);
}

bool seems_to_wrap(const LogTable& table, std::size_t column) {
  constexpr std::size_t kFewestRows = 50;
  double least = INFINITY, most = -INFINITY, step = 0;
  for (std::size_t r = 0; r < table.rows(); ++r) {
    const double count = table.at(r, column);
    if (!std::isfinite(count)) continue;
    least = std::min(least, count);
    most = std::max(most, count);
    if (r > 0 && std::isfinite(table.at(r - 1, column))) {
      step = std::max(step, std::abs(count - table.at(r - 1, column)));
    }
  }
  return table.rows() >= kFewestRows && step > (most - least) / 2;
}

}  // namespace gapfarm
