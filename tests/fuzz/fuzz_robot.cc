// Robot files: no crash, errors with places, and what is accepted reads back as it is written and
// has a table of parameters.
#include "common/parameters/ground.h"
#include "common/robot/robot.h"
#include "tests/fuzz/fuzz_target.h"

namespace gapfarm {
namespace {

void check(std::string_view text) {
  const auto robot = parse_robot(text, "f");
  if (!robot) return promise(robot.error().message.rfind("f:", 0) == 0, "errors name the file");
  const std::string written = format_robot(*robot);
  const auto again = parse_robot(written, "f");
  promise(again.ok(), "what is written can be read");
  promise(format_robot(*again) == written, "what is written reads back as the same robot");
  const GroundTable table(*robot);
  for (std::size_t row = 0; row < table.table().size(); ++row) {
    const Parameter& parameter = table.table()[row];
    promise(parameter.lower < parameter.upper, "bounds have room");
    promise(table.table().check(row, parameter.nominal).ok(), "nominals are within bounds");
  }
}

}  // namespace
}  // namespace gapfarm

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  gapfarm::check(gapfarm::bytes_of(data, size));
  return 0;
}
