#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/random/stream.h"
#include "master/diagnose/evidence/latency.h"
#include "master/diagnose/evidence/residuals.h"

namespace gapfarm::distribution_test {
namespace {

constexpr PoseNoise kNoise{0.0015, 0.008};

// Three of four trials start where the one before ended.
struct Chains {
  std::vector<ReadingGap> gaps;
  std::vector<Eigen::Vector3d> end_velocity;
};

Chains chains(std::uint64_t seed, double share, double latency_s, std::size_t trials = 600) {
  Stream stream({.run_seed = seed});
  Chains made;
  for (std::size_t i = 0; i < trials; ++i) {
    const double speed = 0.25 * (0.5 + 0.25 * static_cast<double>(i % 3));
    made.end_velocity.push_back(i % 2 == 0 ? Eigen::Vector3d(speed, 0, 0)
                                           : Eigen::Vector3d(0, 0, 8 * speed));
    if (i % 4 == 0) continue;
    ReadingGap g{i, i - 1, Eigen::Vector3d::Zero()};
    if (stream.bernoulli(share)) g.gap = latency_s * made.end_velocity[i - 1];
    for (int k = 0; k < 3; ++k) {
      g.gap[k] +=
          std::numbers::sqrt2 * (k < 2 ? kNoise.position_m : kNoise.heading_rad) * stream.normal();
    }
    made.gaps.push_back(g);
  }
  return made;
}

TEST(ReadingNoise, RecoversIt) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const PoseNoise noise = reading_noise(chains(seed, 0, 0).gaps, {});
    EXPECT_NEAR(noise.position_m / kNoise.position_m, 1, 0.1) << seed;
    EXPECT_NEAR(noise.heading_rad / kNoise.heading_rad, 1, 0.1) << seed;
  }
}

TEST(ReadingNoise, AFewLateReadingsHardlyWidenIt) {
  const PoseNoise noise = reading_noise(chains(1, 0.1, 0.1).gaps, {});
  EXPECT_NEAR(noise.position_m / kNoise.position_m, 1, 0.2);
  EXPECT_NEAR(noise.heading_rad / kNoise.heading_rad, 1, 0.3);
}

TEST(ReadingNoise, HoldsTheRoundingOfAGrid) {
  std::vector<ReadingGap> gaps = chains(1, 0, 0).gaps;
  for (ReadingGap& g : gaps) g.gap.head<2>() = 0.02 * (g.gap.head<2>() / 0.02).array().round();
  EXPECT_GE(reading_noise(gaps, {.step_m = 0.02}).position_m, 0.02 / std::sqrt(12.0));
  gaps = chains(1, 0, 0).gaps;
  for (ReadingGap& g : gaps) g.gap[2] = 0.1 * std::round(g.gap[2] / 0.1);
  EXPECT_GE(reading_noise(gaps, {.heading_step_rad = 0.1}).heading_rad, 0.1 / std::sqrt(12.0));
}

TEST(ReadingNoise, IsUnknownWithoutTwoReadingsOfAPose) {
  std::vector<ReadingGap> gaps = chains(1, 0, 0).gaps;
  gaps.resize(19);
  EXPECT_EQ(reading_noise(gaps, {}).position_m, 0);
  EXPECT_EQ(reading_noise(gaps, {}).heading_rad, 0);
  gaps = chains(1, 0, 0).gaps;
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    if (i % 10 != 0) gaps[i].gap.setZero();  // the log shares nine readings of ten
  }
  EXPECT_EQ(reading_noise(gaps, {.step_m = 0.01}).position_m, 0);
  EXPECT_EQ(reading_noise(gaps, {.step_m = 0.01}).heading_rad, 0);
}

TEST(FitLatency, FindsShareAndAge) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const Chains made = chains(seed, 0.3, 0.12);
    const LatencyFit fit = fit_latency(made.gaps, made.end_velocity, kNoise, 600);
    EXPECT_GT(fit.gain, 100) << seed;
    EXPECT_NEAR(fit.latency_s, 0.12, 0.015) << seed;
    EXPECT_NEAR(fit.share, 0.3, 0.1) << seed;
    ASSERT_EQ(fit.weights.size(), 600u);
    EXPECT_EQ(fit.weights[3], fit.share);  // no reading follows it
    for (const ReadingGap& g : made.gaps) {
      const bool late = (g.gap - 0.12 * made.end_velocity[g.previous]).norm() < 0.25 * g.gap.norm();
      if (late && g.gap.norm() > 0.1) {
        EXPECT_GT(fit.weights[g.previous], 0.9);
      }
    }
  }
}

TEST(FitLatency, FindsNoneInNoise) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Chains made = chains(seed, 0, 0);
    const PoseNoise noise = reading_noise(made.gaps, {});
    EXPECT_LT(fit_latency(made.gaps, made.end_velocity, noise, 600).gain, 8) << seed;
  }
}

// Some are far off either way: those that fall behind by chance are no late ones.
TEST(FitLatency, FindsNoneInReadingsWithTails) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Chains made = chains(seed, 0, 0);
    for (std::size_t i = 0; i < made.gaps.size(); i += 10) made.gaps[i].gap *= 4;
    const PoseNoise noise = reading_noise(made.gaps, {});
    EXPECT_LT(fit_latency(made.gaps, made.end_velocity, noise, 600).gain, 8) << seed;
  }
}

TEST(FitLatency, ReportsNothingWithoutNoiseOrGaps) {
  const Chains made = chains(1, 0.3, 0.12);
  EXPECT_EQ(fit_latency(made.gaps, made.end_velocity, {0, 0}, 600).gain, 0);
  const LatencyFit fit = fit_latency({}, made.end_velocity, kNoise, 600);
  EXPECT_EQ(fit.gain, 0);
  EXPECT_EQ(fit.weights, std::vector<double>(600, 0.0));
}

}  // namespace
}  // namespace gapfarm::distribution_test
