#include "common/random/stream.h"

#include <Random123/philox.h>

#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/base/ranges.h"

namespace gapfarm {

// The key holds the seed and the purpose; the upper counter words hold the rest, and the lowest
// counter word counts blocks, so streams cannot overlap.
Stream::Stream(const StreamKey& key)
    : key_{key.run_seed, static_cast<std::uint64_t>(key.purpose)},
      counter_{0, key.generation, key.birth_id, key.replicate} {}

std::uint64_t Stream::bits() {
  if (used_ == block_.size()) {
    using Philox = r123::Philox4x64;
    const Philox::ctr_type counter{{counter_[0], counter_[1], counter_[2], counter_[3]}};
    const Philox::key_type key{{key_[0], key_[1]}};
    const Philox::ctr_type block = Philox()(counter, key);
    for (std::size_t i = 0; i < block_.size(); ++i) block_[i] = block[i];
    ++counter_[0];
    used_ = 0;
  }
  return block_[used_++];
}

double Stream::uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }

double Stream::uniform(double lower, double upper) { return lower + (upper - lower) * uniform(); }

double Stream::normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_normal_;
  }
  const double radius = std::sqrt(-2 * std::log(1 - uniform()));  // 1 - u is in (0, 1]
  const double angle = 2 * std::numbers::pi * uniform();
  spare_normal_ = radius * std::sin(angle);
  has_spare_ = true;
  return radius * std::cos(angle);
}

std::uint64_t Stream::below(std::uint64_t n) {
  assert(n > 0);
  const std::uint64_t reject_below = (0 - n) % n;  // keeps the modulo unbiased
  std::uint64_t draw = bits();
  while (draw < reject_below) draw = bits();
  return draw % n;
}

bool Stream::bernoulli(double probability) { return uniform() < probability; }

std::vector<std::size_t> Stream::permutation(std::size_t n) {
  std::vector<std::size_t> order = indices(n);
  for (std::size_t i = n; i > 1; --i) std::swap(order[i - 1], order[below(i)]);
  return order;
}

}  // namespace gapfarm
