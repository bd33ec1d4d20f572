// A bag's bytes in memory.
#pragma once

#include <string>
#include <string_view>

#include "master/io/logs/bags.h"

namespace gapfarm {

class MemorySource : public ByteSource {
 public:
  explicit MemorySource(std::string_view bytes) : bytes_(bytes) {}
  std::uint64_t size() const override { return bytes_.size(); }
  bool read(std::uint64_t offset, std::size_t count, std::string& to) override {
    if (offset > bytes_.size() || bytes_.size() - offset < count) return false;
    to.assign(bytes_.substr(offset, count));
    return true;
  }

 private:
  std::string_view bytes_;
};

}  // namespace gapfarm
