// Chunks of bags.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/result.h"

namespace gapfarm {

// `bytes` packed as `how` ("", none, bz2, lz4, zstd), which become `size` bytes.  Errors, without a
// place: an unknown packing, bytes that do not unpack to just that size, a size beyond 1 GiB or
// beyond what any packing reaches.
Result<std::string> decompress(std::string_view bytes, const std::string& how, std::uint64_t size);

}  // namespace gapfarm
