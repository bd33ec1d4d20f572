#include <gtest/gtest.h>

#include "master/evolve/evolve.h"

namespace gapfarm::time_left_test {

EvolutionSettings to_generation(std::uint64_t generations) {
  EvolutionSettings settings;
  settings.generations = generations;
  return settings;
}

TEST(TimeLeft, IsUnknownUntilSomethingIsDone) {
  EXPECT_FALSE(time_left_s(to_generation(10), {}).has_value());
  Pace pace;
  pace.wall_here_s = 5;
  EXPECT_FALSE(time_left_s(to_generation(10), pace).has_value());
}

TEST(TimeLeft, CountsTheGenerationInWork) {
  Pace pace;
  pace.share = 0.5;
  pace.wall_here_s = 30;
  EXPECT_DOUBLE_EQ(time_left_s(to_generation(10), pace).value(), 9.5 * 60);
  pace.generation = pace.generations_here = 4;
  EXPECT_DOUBLE_EQ(time_left_s(to_generation(10), pace).value(), 5.5 * 30 / 4.5);
}

TEST(TimeLeft, OfAResumedRunGoesByThePresentMaster) {
  Pace pace;
  pace.generation = 50;
  pace.wall_s = 5000;
  pace.generations_here = 2;
  pace.wall_here_s = 20;
  EXPECT_DOUBLE_EQ(time_left_s(to_generation(60), pace).value(), 100);
}

TEST(TimeLeft, IsUntilTheFirstConditionThatCanBeForeseen) {
  EvolutionSettings settings = to_generation(100);
  Pace pace;
  pace.generation = pace.generations_here = 10;
  pace.evaluations = pace.evaluations_here = 400;
  pace.wall_s = pace.wall_here_s = 100;
  EXPECT_DOUBLE_EQ(time_left_s(settings, pace).value(), 900);
  settings.evaluations = 1000;
  EXPECT_DOUBLE_EQ(time_left_s(settings, pace).value(), 150);
  settings.time_s = 120;
  EXPECT_DOUBLE_EQ(time_left_s(settings, pace).value(), 20);
  settings.time_s = 90;
  EXPECT_EQ(time_left_s(settings, pace).value(), 0);
}

}  // namespace gapfarm::time_left_test
