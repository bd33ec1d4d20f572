#include "master/io/logs/row_order.h"

#include <utility>

#include "common/base/text.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

// What queues and networks hold up comes later by less, s.
constexpr double kLatest_s = 1;
// Of this many rows or more, a clock that stands still at a greater share of them is none.
constexpr std::size_t kFewestOfClock = 8;
constexpr double kMostRepeated = 0.75;

}  // namespace

void put_row(RowTally& tally, Stretch& stretch, std::vector<double> values,
             const std::string& source, std::size_t row) {
  const bool first = stretch.t_s.empty();
  const double last_s = first ? values.front() : stretch.t_s.back();
  if (!first && values.front() < stretch.above_s) ++tally.falls;
  stretch.above_s = values.front();
  const bool behind = values.front() < last_s;
  const bool alone = !std::exchange(stretch.behind, behind);
  if (behind) {
    ++tally.back;
    if (tally.set_back) return;
    if (alone) {
      tally.place = source + ": row " + std::to_string(row + 1) + formatted(" (%.3f s", values[0]) +
                    formatted(" after %.3f s)", last_s);
    }
    // Not where one row alone came late.
    tally.set_back = !alone && last_s - values.front() > kLatest_s;
    return;
  }
  const bool again = !first && values.front() == last_s;
  stretch.t_s.push_back(values.front());
  values.erase(values.begin());
  if (again && values != stretch.rows.back()) {
    ++tally.repeated;
    tally.source = source;
  }
  stretch.rows.push_back(std::move(values));
  ++tally.taken;
}

Status check_order(const RowTally& tally, const TableMap& map, const std::string& kind) {
  if (tally.set_back || tally.back > tally.taken) {
    return Error{tally.place + ": found " + std::to_string(tally.falls) + " of " +
                 std::to_string(tally.back + tally.taken) + " rows of " + kind +
                 " at times before the row above, expected the order of time; sort them, cut the "
                 "recording there, take another clock of it as t in the map, or name runs apart by "
                 "a column and write run = \"COLUMN\" in the map"};
  }
  if (tally.taken < kFewestOfClock ||
      static_cast<double>(tally.repeated) <= kMostRepeated * static_cast<double>(tally.taken)) {
    return {};
  }
  return Error{tally.source + ": found " + std::to_string(tally.repeated) + " of " +
               std::to_string(tally.taken) + " rows of " + kind +
               " at the time of the row before, expected column " +
               quoted_word(map.find("t")->column) +
               " to grow from row to row; take one that has the parts of seconds, too, as t in the "
               "map (of sec and nanosec that is the column without these in its name)"};
}

}  // namespace gapfarm
