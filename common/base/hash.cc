#include "common/base/hash.h"

#include <sodium.h>

#include <array>
#include <bit>
#include <cassert>

namespace gapfarm {
namespace {

constexpr std::size_t kBytes = 16;

}  // namespace

struct Hasher::State {
  crypto_generichash_state blake;
};

Hasher::Hasher() : state_(std::make_unique<State>()) {
  const int ready = sodium_init();
  assert(ready >= 0);
  (void)ready;
  crypto_generichash_init(&state_->blake, nullptr, 0, kBytes);
}

Hasher::~Hasher() = default;

Hasher& Hasher::add(std::string_view bytes) {
  add(static_cast<std::uint64_t>(bytes.size()));
  crypto_generichash_update(&state_->blake, reinterpret_cast<const unsigned char*>(bytes.data()),
                            bytes.size());
  return *this;
}

Hasher& Hasher::add(double value) { return add(std::bit_cast<std::uint64_t>(value)); }

Hasher& Hasher::add(std::uint64_t value) {
  std::array<unsigned char, 8> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<unsigned char>(value >> (8 * i));
  }
  crypto_generichash_update(&state_->blake, bytes.data(), bytes.size());
  return *this;
}

std::string Hasher::finish() {
  std::array<unsigned char, kBytes> digest{};
  crypto_generichash_final(&state_->blake, digest.data(), digest.size());
  std::array<char, 2 * kBytes + 1> text{};
  return sodium_bin2hex(text.data(), text.size(), digest.data(), digest.size());
}

std::string content_hash(std::string_view bytes) { return Hasher().add(bytes).finish(); }

}  // namespace gapfarm
