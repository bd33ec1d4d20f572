// Text logs: no crash, errors with places, what is read has whole rows and can be imported.
#include "master/io/logs/bags.h"
#include "tests/fuzz/recording_promises.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gapfarm;
  return promise_recording(parse_text_log(bytes_of(data, size), "f"));
}
