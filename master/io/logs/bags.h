// Readers of the three kinds of bags.  All give the topics that serve ground robots as tables, and
// say what they left.  Errors: "FILE:BYTE: found ..., expected ...; remedy"; nothing is half-read.
#pragma once

#include <cstdint>
#include <fstream>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "master/io/logs/log_table.h"

namespace gapfarm {

class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual std::uint64_t size() const = 0;
  // Exactly `count` bytes at `offset` into `to`; false where the file ends before.
  virtual bool read(std::uint64_t offset, std::size_t count, std::string& to) = 0;
};

class FileSource : public ByteSource {
 public:
  static Result<FileSource> open(const std::string& path);
  std::uint64_t size() const override { return size_; }
  bool read(std::uint64_t offset, std::size_t count, std::string& to) override;

 private:
  FileSource() = default;
  std::ifstream file_;
  std::uint64_t size_ = 0;
};

// One a row of formats.inc; errors name `path`.
#define FORMAT(file, begins) \
  Result<Recording> read_##file(ByteSource& source, const std::string& path);
#include "master/io/logs/formats.inc"

// Any log, recognised by its content.
Result<Recording> read_recording(const std::string& path, bool skip_invalid = false);

// `bytes` packed as `how` ("", none, bz2, lz4, zstd), which become `size` bytes.  Errors, without a
// place: an unknown packing, bytes that do not unpack to just that size, a size beyond 1 GiB or
// beyond what any packing reaches.
Result<std::string> decompress(std::string_view bytes, const std::string& how, std::uint64_t size);

}  // namespace gapfarm
