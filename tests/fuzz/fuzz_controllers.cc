// Controller files: no crash, errors with places.
#include "master/io/robot_files/controllers.h"
#include "master/io/robot_files/understand.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gapfarm;
  const auto read = parse_controllers(bytes_of(data, size), "f");
  if (!read) {
    promise_place(read.error().message, "f");
    return 0;
  }
  promise(!read->drives.empty(), "a controller file has controllers");
  const auto robot = understand_controllers(read->drives);
  if (!robot) promise_place(robot.error().message, "f");
  return 0;
}
