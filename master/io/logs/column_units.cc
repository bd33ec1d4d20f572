#include <algorithm>
#include <cmath>
#include <string>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/math/statistics.h"
#include "common/trials/text/csv.h"
#include "master/io/logs/column_map.h"

namespace gapfarm {
namespace {

// Of a clock more steps lead on, runs' beginnings and a few rows in disorder aside.
constexpr double kLeastLeadOn = 0.75;
constexpr double kLeastGrowth = 0.5;  // the same over the sum of all steps, whatever their sign
// What rows last: the longest, s, and how uneven they are, over their middle or below it.
constexpr double kLongestRow_s = 10;
constexpr double kMostUneven = 10;

// The map's unit, else the file's or the name's where the map does not say what one of the column
// is.
Result<std::string> unit_of(const LogTable& table, const MappedColumn& c) {
  if (!c.unit.empty() || c.scale != 1) return c.unit;
  std::string own = table.unit_of(c.column);
  if (own.empty()) own = unit_in_name(c.column);
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

bool has_number(const LogTable& table, const std::string& column) {
  const std::size_t at = *table.find(column);
  return std::ranges::any_of(indices(table.rows()),
                             [&](std::size_t r) { return std::isfinite(table.at(r, at)); });
}

}  // namespace

Result<SiLine> si_line(const LogTable& table, const TableMap& map, const MappedColumn& c,
                       bool poses) {
  ASSIGN_OR_RETURN(const std::string unit, unit_of(table, c));
  double factor = unit_factor(unit);
  const bool length = unit == "m" || unit == "cm" || unit == "mm";
  const bool speed = unit.ends_with("/s") && unit.find("m/") != unit.npos;
  const bool rim = !poses && (speed || (c.rate && length)) && c.role != "v" && c.role != "vy";
  if (rim && map.wheel_radius_m <= 0) {
    return Error{table.source + ":1: found column " + quoted_word(c.column) + " in " + unit +
                 ", expected the wheels' radius too; print the map (--print-map), add "
                 "wheel_radius = 0.05 (m) to it and give it by --map"};
  }
  if (rim) factor /= map.wheel_radius_m;
  return SiLine{c.sign * c.scale / c.gear * factor, c.offset * factor};
}

bool has_all(const LogTable& table, const TableMap& map) {
  return std::ranges::all_of(
      map.columns, [&](const MappedColumn& c) { return table.find(c.column).has_value(); });
}

Error no_rows(const std::vector<Recording>& recordings, const TableMap& map,
              const std::string& kind) {
  std::string there;
  std::vector<std::string> columns;
  for (const Recording& recording : recordings) {
    for (const LogTable& table : recording.tables) {
      append(columns, table.columns);
      append(columns, table.titles);
      for (const MappedColumn& c : map.columns) {
        if (!has_all(table, map) || has_number(table, c.column)) continue;
        return Error{table.source + ":1: found no number in column " + quoted_word(c.column) +
                     ", expected " + c.role + " of the " + kind +
                     (c.role == "t" ? " as seconds, or as 2026-01-31T12:00:00.5Z" : "")};
      }
      if (there.size() > 600) continue;
      there += (there.empty() ? "" : "; ") + table.source + ": " + joined(table.columns, ", ");
    }
  }
  for (const MappedColumn& c : map.columns) {
    if (contains(columns, c.column)) continue;
    const std::string near = nearest_word(c.column, columns);
    return Error{
        recordings.front().file + ":1: found no column " + quoted_word(c.column) +
        " in any table, expected it as " + c.role + " of [" + kind + "]" +
        (near.empty() ? "; there is " + there : "; did you mean " + quoted_word(near) + "?")};
  }
  return Error{recordings.front().file + ":1: found no " + kind +
               " in any table, expected the columns of [" + kind + "] of the map" +
               (map.source.empty() ? "" : " in " + map.source) + "; there is " + there};
}

double counted_on(double wraps, double before, double count) {
  if (!(wraps > 0) || !std::isfinite(before)) return count;
  return before + std::remainder(count - before, wraps);
}

bool are_durations(const std::vector<double>& times, double second) {
  double lead_on = 0, steps = 0;
  for (std::size_t i = 1; i < times.size(); ++i) {
    lead_on += times[i] > times[i - 1] ? 1 : 0;
    steps += std::abs(times[i] - times[i - 1]);
  }
  if (lead_on >= kLeastLeadOn * (static_cast<double>(times.size()) - 1)) return false;
  if (times.back() - times.front() > kLeastGrowth * steps) return false;
  const double middle = median(times);
  const auto [least, most] = std::ranges::minmax(times);
  return least > middle / kMostUneven && most < middle * kMostUneven &&
         most * second <= kLongestRow_s;
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
