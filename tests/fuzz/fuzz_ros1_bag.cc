// Bags: no crash, errors with places, what is read has whole rows and can be imported.
#include "tests/fuzz/memory_source.h"
#include "tests/fuzz/recording_promises.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gapfarm;
  MemorySource source(bytes_of(data, size));
  return promise_recording(read_ros1_bag(source, "f"));
}
