// Counter-based random streams (Philox4x64-10 of Random123; Salmon et al., SC 2011).
//
// A stream is named by its key and by nothing else, so any draw can be made again anywhere.  Own
// distributions: those of the standard library differ between implementations.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace gapfarm {

// What a stream is for.  Two purposes never share draws, even under equal numbers.
enum class Purpose : std::uint64_t {
  kEvolution = 1,   // the optimiser's own draws
  kEvaluation = 2,  // drive noise of an evaluation's replicates
  kSimulation = 3,  // `simulate`: plan, drive and pose noise
  kStatistics = 4,  // bootstrap, permutation, Fast-MCD subsets
  kScheduling = 5,  // shuffled dispatch, back-off
  kTest = 6,
};

struct StreamKey {
  std::uint64_t run_seed = 0;
  Purpose purpose = Purpose::kTest;
  std::uint64_t generation = 0;
  std::uint64_t birth_id = 0;
  std::uint64_t replicate = 0;
};

class Stream {
 public:
  explicit Stream(const StreamKey& key);

  std::uint64_t bits();
  // Uniform in [0, 1), 53 bits.
  double uniform();
  double uniform(double lower, double upper);
  // Standard normal, by Box and Muller.
  double normal();
  // Uniform in [0, n).  REQUIRES: n > 0.
  std::uint64_t below(std::uint64_t n);
  bool bernoulli(double probability);
  // A permutation of 0..n-1 (Fisher and Yates).
  std::vector<std::size_t> permutation(std::size_t n);

 private:
  std::array<std::uint64_t, 2> key_{};
  std::array<std::uint64_t, 4> counter_{};
  std::array<std::uint64_t, 4> block_{};
  unsigned used_ = 4;
  double spare_normal_ = 0;
  bool has_spare_ = false;
};

}  // namespace gapfarm
