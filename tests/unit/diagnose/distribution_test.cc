#include "master/diagnose/distribution.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/random/stream.h"
#include "master/diagnose/latency.h"

namespace gapfarm {
namespace {

constexpr PoseNoise kNoise{0.0015, 0.008};

double rounded(double value, double step) {
  return step > 0 ? step * std::round(value / step) : value;
}

// Readings spread over the arena, rounded to `step` and then printed to 1e-5 m as a log is.
std::vector<Trial> readings(std::uint64_t seed, double step, std::size_t trials, double shift = 0) {
  Stream stream({.run_seed = seed});
  const auto coordinate = [&] {
    return rounded(shift + rounded(stream.uniform(0.3, 1.7), step), 1e-5);
  };
  std::vector<Trial> all(trials);
  for (Trial& t : all) {
    t.X_WS = {coordinate(), coordinate(), 0};
    t.X_WE = {coordinate(), coordinate(), 0};
  }
  return all;
}

TEST(QuantisationStep, FindsGrids) {
  // The last is no whole number of the file's digits.
  for (double step : {0.01, 0.005, 0.002, 0.0005, 0.022 / 3}) {
    EXPECT_NEAR(quantisation_step(readings(1, step, 600)), step, 1e-3 * step);
    EXPECT_NEAR(quantisation_step(readings(2, step, 100)), step, 1e-3 * step);
  }
}

TEST(QuantisationStep, FindsAGridThatDoesNotStartAtZero) {
  EXPECT_NEAR(quantisation_step(readings(1, 0.01, 600, 0.0037)), 0.01, 1e-5);
}

TEST(QuantisationStep, FindsAGridWithAFewReadingsOffIt) {
  std::vector<Trial> trials = readings(1, 0.01, 600);
  for (std::size_t i = 0; i < trials.size(); i += 60) {
    trials[i].X_WE.x += 0.00123;
    trials[i].X_WE.y += 0.00123;
  }
  EXPECT_NEAR(quantisation_step(trials), 0.01, 1e-5);
}

TEST(QuantisationStep, FindsWholeCentimetresWhereTheEndsAreFew) {
  Stream stream({.run_seed = 3});
  std::vector<Trial> trials(60);
  for (Trial& t : trials) {
    t.X_WE = {rounded(0.25 + 0.02 * stream.normal(), 0.01), rounded(0.02 * stream.normal(), 0.01),
              0};
  }
  EXPECT_NEAR(quantisation_step(trials), 0.01, 1e-5);
}

TEST(QuantisationStep, FindsNoneInContinuousData) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    EXPECT_EQ(quantisation_step(readings(seed, 0, 600)), 0) << seed;
    EXPECT_EQ(quantisation_step(readings(seed, 0, 40)), 0) << seed;
  }
}

TEST(QuantisationStep, TheDigitsOfTheFileAreNoGrid) {
  EXPECT_EQ(quantisation_step(readings(1, 1e-4, 600)), 0);
}

TEST(QuantisationStep, StartsPutOnMarksAreNoGrid) {
  std::vector<Trial> trials = readings(1, 0, 600);
  for (Trial& t : trials) t.X_WS = {rounded(t.X_WS.x, 0.1), rounded(t.X_WS.y, 0.1), 0};
  EXPECT_EQ(quantisation_step(trials), 0);
}

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
    const PoseNoise noise = reading_noise(chains(seed, 0, 0).gaps, 0);
    EXPECT_NEAR(noise.position_m / kNoise.position_m, 1, 0.1) << seed;
    EXPECT_NEAR(noise.heading_rad / kNoise.heading_rad, 1, 0.1) << seed;
  }
}

TEST(ReadingNoise, AFewLateReadingsHardlyWidenIt) {
  const PoseNoise noise = reading_noise(chains(1, 0.1, 0.1).gaps, 0);
  EXPECT_NEAR(noise.position_m / kNoise.position_m, 1, 0.2);
  EXPECT_NEAR(noise.heading_rad / kNoise.heading_rad, 1, 0.3);
}

TEST(ReadingNoise, HoldsTheRoundingOfAGrid) {
  std::vector<ReadingGap> gaps = chains(1, 0, 0).gaps;
  for (ReadingGap& g : gaps) g.gap.head<2>() = 0.02 * (g.gap.head<2>() / 0.02).array().round();
  EXPECT_GE(reading_noise(gaps, 0.02).position_m, 0.02 / std::sqrt(12.0));
}

TEST(ReadingNoise, IsUnknownWithoutTwoReadingsOfAPose) {
  std::vector<ReadingGap> gaps = chains(1, 0, 0).gaps;
  gaps.resize(19);
  EXPECT_EQ(reading_noise(gaps, 0).position_m, 0);
  EXPECT_EQ(reading_noise(gaps, 0).heading_rad, 0);
  gaps = chains(1, 0, 0).gaps;
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    if (i % 10 != 0) gaps[i].gap.setZero();  // the log shares nine readings of ten
  }
  EXPECT_EQ(reading_noise(gaps, 0.01).position_m, 0);
  EXPECT_EQ(reading_noise(gaps, 0.01).heading_rad, 0);
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
    const PoseNoise noise = reading_noise(made.gaps, 0);
    EXPECT_LT(fit_latency(made.gaps, made.end_velocity, noise, 600).gain, 8) << seed;
  }
}

TEST(FitLatency, SaysNothingWithoutNoiseOrGaps) {
  const Chains made = chains(1, 0.3, 0.12);
  EXPECT_EQ(fit_latency(made.gaps, made.end_velocity, {0, 0}, 600).gain, 0);
  const LatencyFit fit = fit_latency({}, made.end_velocity, kNoise, 600);
  EXPECT_EQ(fit.gain, 0);
  EXPECT_EQ(fit.weights, std::vector<double>(600, 0.0));
}

}  // namespace
}  // namespace gapfarm
