// Which columns of a recording are what, in which units: guessed, or read from the user's TOML.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/recordings/run.h"
#include "master/io/logs/bags.h"

namespace gapfarm {

// A number n of the column is (sign scale / gear n + offset) of the unit.
struct MappedColumn {
  std::string role;    // t, x, y, theta, qx, ... of poses; t and channels of commands
  std::string column;  // as the recording names it
  std::string unit;    // one of known_units(); empty: the file's own, without one SI
  double scale = 1;    // with one and no unit the result is SI: 0.0018 m a pixel
  double offset = 0;   // in the unit
  double sign = 1;     // or -1: an axis or a motor that counts the other way
  double gear = 1;     // turns of a motor a turn of its wheel
  double wraps = 0;    // a counter begins anew at this many; 0: it never does
  bool rate = false;   // the column counts (an encoder's position): its change a second is meant
  bool increment = false;  // the column is what that count changed by since the row before
};

// Where one kind of rows comes from.
struct TableMap {
  std::string source;    // topic, or the end of a file's name; empty: the one table that has all
  std::string session;   // column that names the sessions; empty: all runs are of one
  std::string run;       // column that names the runs of each; empty: a file is one
  std::string keep;      // column that is not zero where a row counts; empty: all rows count
  std::string up = "z";  // poses: the world's upward axis; Motive's is y
  double wheel_radius_m = 0;  // turns rims' m/s into rad/s; 0: not stated
  bool increments = false;    // poses: each in the axes of the one before
  bool intervals = false;     // column "t" is dt: how long the stretch is that the row is about
  std::vector<MappedColumn> columns;

  const MappedColumn* find(std::string_view role) const;
  // The roles of an increment's noise (common/recordings/run.h); empty: it has none.
  std::span<const std::string> noise() const;
};

struct LogMap {
  TableMap poses, commands, wheels, gyro;  // no columns: the recording has none
  std::vector<std::string> notes;          // why a guess is what it is
  std::string no_heading;                  // the first table that has x and y and no heading
};

// The kinds of rows, as a map and its files call them.
struct RowKind {
  const char* name;
  TableMap LogMap::*map;
  std::vector<CommandRow> LoggedRun::*rows;  // null of poses, which are rows of their own kind
};
inline constexpr RowKind kRowKinds[] = {{"poses", &LogMap::poses, nullptr},
                                        {"commands", &LogMap::commands, &LoggedRun::commands},
                                        {"wheels", &LogMap::wheels, &LoggedRun::wheel_speeds},
                                        {"gyro", &LogMap::gyro, &LoggedRun::yaw_rates}};

// Factor to SI of a unit ("mm", "deg", "ns", "rpm", ...), 0 when nobody knows it.
double unit_factor(std::string_view unit);
std::span<const std::string> known_units();

// The best guess by names, types and ranges.  Kinds that were not found have no columns.
LogMap guess_map(const std::vector<Recording>& recordings);

// How columns of two sides are read: their MappedColumn's `rate` and `increment`, beside poses with
// TableMap::increments, and the share of the motions that they leave so (NaN: too few rows, or not
// of one table).
struct WheelReading {
  bool increments = false, rate = false, increment = false;
  double left = 0;
};

// As mapped, or as wheels explain a table's motions clearly better.
WheelReading best_reading(const LogTable& table, const TableMap& poses, const TableMap& wheels);
// Errors: the map has another.
Status check_reading(const LogTable& table, const LogMap& map);

// TOML of [poses], [commands], [wheels] and [gyro], for `--map`.
std::string format_map(const LogMap& map);
// Errors with file, line and column: unknown units, kinds without t, poses without x, y and a
// heading.
Result<LogMap> parse_map(std::string_view text, const std::string& file);

// {t, x, y, theta} out of the mapped columns, then those of an increment's noise; false where
// nothing was measured.
bool to_pose(const TableMap& map, std::vector<double>& values);

// The values at the time from which on they hold (poses: at which they were measured): of counts,
// and of what they changed by, a change a second from the row before up to this one.  `before`: of
// the same run, as it was; empty: there is none.  False where nothing can be said yet.
bool at_its_time(const TableMap& map, bool poses, std::vector<double>& before,
                 std::vector<double>& values);

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

// Whether these are no times of a clock, but how long each row lasts; `second`: s of one of them.
bool are_durations(const std::vector<double>& times, double second);

// Whether a column, of 50 rows or more, steps by more than half of its range.
bool seems_to_wrap(const LogTable& table, std::size_t column);

// Recordings and a map to the one format of runs (docs/formats.md).
struct ImportedRuns {
  RunLog log;
  double clock_start_s = 0;         // what was taken off every time of the recordings
  std::vector<std::string> report;  // what was taken and what was left, a sentence each
};

// Times in s from the first one, poses in m and rad about the world's upward axis, commands in SI.
// Rows without a number where one is needed, poses whose quaternion is none and times that go back
// are omitted and counted.  Errors: no rows of poses or commands where the map has them, a column
// that is not there, a clock that was set back, rims' speeds in m/s without a wheel radius.
Result<ImportedRuns> to_runs(const std::vector<Recording>& recordings, const LogMap& map);

// commands.csv, poses.csv, wheels.csv and gyro.csv (empty: there are none).
struct RunFiles {
  std::string commands, poses, wheels, gyro;
};
RunFiles format_runs(const RunLog& log);

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
