// The model reader: no crash, errors with places, models read back as they were written.
#include "common/config/model.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gapfarm;
  const auto model = parse_model(bytes_of(data, size), "f");
  if (!model.ok()) {
    promise_place(model.error().message, "f");
    return 0;
  }
  const std::string written = format_model(*model);
  const auto again = parse_model(written, "g");
  promise(again.ok(), again.ok() ? "" : again.error().message.c_str());
  promise(format_model(*again) == written, "models read back as they were written");
  return 0;
}
