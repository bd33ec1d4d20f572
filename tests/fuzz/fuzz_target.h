// What every fuzz target shares: one function, called with arbitrary bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace gapfarm {

inline std::string_view bytes_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

// Ends the program when a promise is broken, so that the fuzzer keeps the input.
inline void promise(bool kept, const char* what) {
  if (kept) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

// Every error says where: "file:line:column: ...".
inline void promise_place(const std::string& message, const std::string& file) {
  const std::string begin = file + ":";
  promise(message.compare(0, begin.size(), begin) == 0, message.c_str());
  const std::size_t line = begin.size();
  promise(line < message.size() && message[line] >= '1' && message[line] <= '9', message.c_str());
}

}  // namespace gapfarm
