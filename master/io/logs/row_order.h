// The rows of an import, each run's in the order of time.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "master/io/logs/column_map.h"

namespace gapfarm {

// Rows of one kind, of one run; values in SI, one a role after t.
struct Stretch {
  std::size_t place = 0;  // among the stretches of its kind and recording, as they appear
  double above_s = 0;     // the time of the row before
  std::vector<double> t_s;
  std::vector<std::vector<double>> rows;
  bool behind = false;  // the time of the row before this one goes back
};
using RunKey = std::pair<std::string, std::string>;  // a session and a run in it
using Stretches = std::map<RunKey, Stretch>;

struct RowTally {
  std::size_t taken = 0, blank = 0, back = 0, dropped = 0;
  std::size_t falls = 0;     // of those that go back: at times before the row above
  std::size_t repeated = 0;  // of other values than the row before, at its time
  std::string place;         // where times go back, for an error
  std::string source;        // where a time is repeated
  bool set_back = false;
};

// Takes row `row` of `source`, {t, values ...}, unless its time goes back.
void put_row(RowTally& tally, Stretch& stretch, std::vector<double> values,
             const std::string& source, std::size_t row);

// Errors: several runs in one, a clock that was set back, rows in no order, times of which nearly
// all are those of the row before.  `kind`: of the rows, as RowKind has it.
Status check_order(const RowTally& tally, const TableMap& map, const std::string& kind);

}  // namespace gapfarm
