// URDFs: no crash, errors with places, and what is understood can be drawn.
#include "master/io/robot_files/understand.h"
#include "master/report/figures/figures.h"
#include "tests/fuzz/fuzz_target.h"

namespace gapfarm {
namespace {

void check(std::string_view text) {
  const auto model = parse_urdf(text, "f");
  if (!model) return promise_place(model.error().message, "f");
  const auto reading = understand_robot(*model, {});
  if (!reading) return promise_place(reading.error().message, "f");
  promise(reading->robot.wheels.size() == reading->sources.size(), "every wheel has its source");
  GroundRobot completed = reading->robot;
  if (!complete_robot(&completed)) return;
  promise(!draw_robot(*reading, completed).empty(), "a robot can be drawn");
  promise(!describe_robot_json(*reading, completed, "").empty(), "a robot can be reported");
}

}  // namespace
}  // namespace gapfarm

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  gapfarm::check(gapfarm::bytes_of(data, size));
  return 0;
}
