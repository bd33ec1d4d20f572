// Readers of the three kinds of bags.  All give the topics that serve ground robots as tables, and
// say what they left.  Errors: "FILE:BYTE: found ..., expected ...; remedy"; nothing is half-read.
#pragma once

#include "master/io/logs/byte_source.h"
#include "master/io/logs/log_table.h"

namespace gapfarm {

// One a row of formats.inc; errors name `path`.
#define FORMAT(file, begins) \
  Result<Recording> read_##file(ByteSource& source, const std::string& path);
#include "master/io/logs/formats.inc"

// Any log, recognised by its content.
Result<Recording> read_recording(const std::string& path);

}  // namespace gapfarm
