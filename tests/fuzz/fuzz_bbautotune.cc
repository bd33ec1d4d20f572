// The bbautotune importer: no crash, errors with places, every line read or named.
#include <algorithm>
#include <vector>

#include "common/trials/read.h"
#include "common/trials/text/trial_parser.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gapfarm;
  static const std::vector<std::string> commands = {"forward"};
  const std::string_view text = bytes_of(data, size);
  const auto log = parse_bbautotune(text, "f", "run", commands);
  if (!log.ok()) {
    promise_place(log.error().message, "f");
    return 0;
  }
  promise(!log->trials.empty(), "a log has trials");
  const auto lines = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')) + 1;
  promise(log->trials.size() + log->notes.size() <= lines, "a trial a line at most");
  const auto again = parse_trials(format_trials(*log), "g", commands);
  promise(again.ok(), again.ok() ? "" : again.error().message.c_str());
  return 0;
}
