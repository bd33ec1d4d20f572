// What holds of every recording, whatever it was read from.
#pragma once

#include "master/io/logs/column_map.h"
#include "tests/fuzz/fuzz_target.h"

namespace gapfarm {

// Errors name the file `f`; what was read has whole rows and a map that reads back, and can be
// imported or refused.  Returns what a fuzz target does.
inline int promise_recording(const Result<Recording>& read) {
  if (!read) {
    promise_place(read.error().message, "f");
    return 0;
  }
  for (const LogTable& table : read->tables) {
    promise(table.rows() * table.columns.size() == table.values.size(), "rows are whole");
  }
  const LogMap map = guess_map({*read});
  const std::string text = format_map(map);
  const Result<LogMap> again = parse_map(text, "m");
  promise(again.ok(), again.ok() ? "" : again.error().message.c_str());
  promise(format_map(*again) == text, "maps read back as they were written");
  const Result<ImportedRuns> runs = to_runs({*read}, map);
  if (runs) format_runs(runs->log);
  return 0;
}

}  // namespace gapfarm
