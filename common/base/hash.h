// Content hashes.  BLAKE2b from libsodium; 128 bits are plenty to keep problems and runs distinct.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace gapfarm {

// 32 lower-case hex digits of BLAKE2b-128 over `bytes`.
std::string content_hash(std::string_view bytes);

// The same hash fed in pieces.  Doubles are hashed by their bits, so -0.0 and 0.0 differ.
class Hasher {
 public:
  Hasher();
  ~Hasher();
  Hasher& operator=(Hasher&&) = delete;

  Hasher& add(std::string_view bytes);  // hashes the length too
  Hasher& add(double value);
  Hasher& add(std::uint64_t value);

  // 32 lower-case hex digits.  The hasher may not be used afterwards.
  std::string finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace gapfarm
