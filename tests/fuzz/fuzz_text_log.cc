// Text logs: no crash, errors with places, what is read has whole rows and can be imported.
#include "master/input/bags.h"
#include "master/input/to_runs.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gapfarm;

  const Result<Recording> read = parse_text_log(bytes_of(data, size), "f");
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
