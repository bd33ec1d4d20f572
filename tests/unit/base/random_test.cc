#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "common/random/stream.h"

namespace gapfarm::random_test {

TEST(Stream, IsNamedByItsKeyAlone) {
  const StreamKey key{7, Purpose::kTest, 1, 2, 3};
  Stream a(key);
  Stream b(key);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(a.bits(), b.bits());
}

TEST(Stream, KeysThatDifferInOneFieldDifferInTheirFirstDraw) {
  const StreamKey base{7, Purpose::kTest, 1, 2, 3};
  std::set<std::uint64_t> first{Stream(base).bits()};
  for (const StreamKey& key :
       {StreamKey{8, Purpose::kTest, 1, 2, 3}, StreamKey{7, Purpose::kEvolution, 1, 2, 3},
        StreamKey{7, Purpose::kTest, 2, 2, 3}, StreamKey{7, Purpose::kTest, 1, 3, 3},
        StreamKey{7, Purpose::kTest, 1, 2, 4}}) {
    first.insert(Stream(key).bits());
  }
  EXPECT_EQ(first.size(), 6u);
}

// Moments of 200,000 draws lie within five standard errors of the distribution's own.
TEST(Stream, MomentsOfItsDistributions) {
  Stream stream({1, Purpose::kTest, 0, 0, 0});
  constexpr int n = 200000;
  double uniform = 0, normal = 0, square = 0, fourth = 0;
  for (int i = 0; i < n; ++i) {
    uniform += stream.uniform();
    const double z = stream.normal();
    normal += z;
    square += z * z;
    fourth += z * z * z * z;
  }
  EXPECT_NEAR(uniform / n, 0.5, 5 * std::sqrt(1.0 / 12 / n));
  EXPECT_NEAR(normal / n, 0, 5 * std::sqrt(1.0 / n));
  EXPECT_NEAR(square / n, 1, 5 * std::sqrt(2.0 / n));
  EXPECT_NEAR(fourth / n, 3, 5 * std::sqrt(96.0 / n));
}

TEST(Stream, PermutationsHoldEveryIndexOnce) {
  Stream stream({1, Purpose::kTest, 0, 0, 0});
  const auto order = stream.permutation(100);
  EXPECT_EQ(std::set<std::size_t>(order.begin(), order.end()).size(), 100u);
  EXPECT_TRUE(stream.permutation(0).empty());
}

}  // namespace gapfarm::random_test
