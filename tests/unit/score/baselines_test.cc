#include "common/score/baselines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/random/stream.h"
#include "common/score/scale_mixture.h"
#include "common/trials/read.h"
#include "tests/unit/trials/shared_data.h"

namespace gapfarm::baselines_test {

using ::testing::HasSubstr;

const std::vector<CommandSpec> kCommands = {{"forward", 1, 1, 1}, {"turn_cw", 0.5, -0.5, 1}};

// Ends of both commands that vary by a t of 1 / `tail` degrees of freedom.
TrialLog drawn(int trials, double tail, std::uint64_t seed) {
  Stream stream({.purpose = Purpose::kTest, .birth_id = seed});
  TrialLog log;
  for (int i = 0; i < trials; ++i) {
    Trial t;
    t.session = "s" + std::to_string(i / 50);
    t.trial = i;
    t.command = kCommands[static_cast<std::size_t>(i % 2)].name;
    t.X_WS = {stream.uniform(-1, 1), stream.uniform(-1, 1), stream.uniform(-3, 3)};
    const double s = std::sqrt(draw_tail_scale(tail, stream));
    const double x = stream.normal(), y = stream.normal(), h = stream.normal();
    const Pose mean = i % 2 == 0 ? Pose{0.25, 0.01, 0.1} : Pose{0, 0, 3.1};
    t.X_WE = t.X_WS * Pose{mean.x + 0.01 * s * x, mean.y + 0.005 * s * y,
                           wrap_angle(mean.theta + 0.03 * s * h)};
    log.trials.push_back(t);
  }
  return log;
}

double mean_of(const BaselineScores& baseline) {
  double sum = 0;
  for (const auto& score : baseline.scores) sum += score.value();
  return sum / static_cast<double>(baseline.scores.size());
}

TEST(Baselines, ScoreGaussianMotionsAsTheirDensityDoes) {
  const auto scores = baseline_scores(drawn(1200, 0, 1), drawn(600, 0, 2), kCommands);
  ASSERT_TRUE(scores.ok());
  ASSERT_EQ(scores->size(), 2u);
  // -(3 log 2 pi + log det S + 3) / 2 on average; 600 trials show it to 0.05.
  const double best = -0.5 * (3 * std::log(2 * M_PI) + 3) - std::log(0.01 * 0.005 * 0.03);
  for (const BaselineScores& b : *scores) EXPECT_NEAR(mean_of(b), best, 0.12) << b.name;
}

TEST(Baselines, FollowHeavyTails) {
  const double tail = 0.5;
  const TrialLog test = drawn(600, tail, 4);
  const auto scores = baseline_scores(drawn(1200, tail, 3), test, kCommands);
  ASSERT_TRUE(scores.ok());
  const Eigen::Matrix3d S = Eigen::Vector3d(1e-4, 2.5e-5, 9e-4).asDiagonal();
  const TailedDensity truth({0, tail});
  double best = 0;
  for (std::size_t i = 0; i < test.trials.size(); ++i) {
    const Trial& t = test.trials[i];
    const Pose mean = i % 2 == 0 ? Pose{0.25, 0.01, 0.1} : Pose{0, 0, 3.1};
    const Pose d = between(t.X_WS, t.X_WE);
    const Eigen::Vector3d r(d.x - mean.x, d.y - mean.y, wrap_angle(d.theta - mean.theta));
    best += *truth.log_density(r, S, S, 0) / 600;
  }
  EXPECT_NEAR(mean_of((*scores)[1]), best, 0.1) << "one scale for all three components";
  EXPECT_GT(mean_of((*scores)[1]), mean_of((*scores)[0]) + 0.1);
}

TEST(Baselines, ReportNothingOfCommandsWithTooFewTrials) {
  TrialLog train = drawn(40, 0, 5);
  std::erase_if(train.trials,
                [n = 0](const Trial& t) mutable { return t.command == "turn_cw" && ++n > 5; });
  const auto scores = baseline_scores(train, drawn(20, 0, 6), kCommands);
  ASSERT_TRUE(scores.ok());
  for (const BaselineScores& b : *scores) {
    for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(b.scores[i].has_value(), i % 2 == 0) << b.name;
  }
  const std::vector<double> model(20, 5.0);
  const auto compared = compare_with_baselines(*scores, model);
  ASSERT_EQ(compared.size(), 2u);
  EXPECT_EQ(compared[0].trials, 10u);
  EXPECT_EQ(compared[0].model, 5);
}

TEST(Baselines, OfOtherFoldsDoNotKnowATrial) {
  TrialLog log = drawn(200, 0, 7);
  log.trials[10].X_WE.x += 0.5;
  const auto folds = session_folds(log);
  EXPECT_EQ(folds.back(), 3u) << "sessions";
  const auto held_out = crossfitted_baselines(log, kCommands, folds);
  const auto seen = crossfitted_baselines(log, kCommands, std::vector<std::size_t>(200, 0));
  ASSERT_TRUE(held_out.ok() && seen.ok());
  for (std::size_t b = 0; b < 2; ++b) {
    EXPECT_LT(mean_of((*held_out)[b]), mean_of((*seen)[b]));
    EXPECT_LT(*(*held_out)[b].scores[10], *(*seen)[b].scores[10]);
  }
  for (Trial& t : log.trials) t.session = "one";
  const auto parts = session_folds(log);
  EXPECT_EQ(parts.front(), 0u);
  EXPECT_EQ(parts.back(), 4u);
}

TEST(Baselines, ThatAreNotBeatenAreReported) {
  const std::vector<std::optional<double>> many(kLeastBaselineTrials, 6.0);
  std::vector<std::optional<double>> few = many;  // one decides nothing, nor do seven
  few.front().reset();
  const std::vector<BaselineScores> baselines = {{"constant motion", many}, {"mined motion", few}};
  const auto better = compare_with_baselines(baselines, std::vector<double>(many.size(), 7));
  ASSERT_EQ(better.size(), 1u);
  EXPECT_EQ(better[0].trials, kLeastBaselineTrials);
  EXPECT_EQ(baseline_sentence(better, "the model").find("does not beat"), std::string::npos);
  const auto worse = compare_with_baselines(baselines, std::vector<double>(many.size(), 5.5));
  EXPECT_THAT(baseline_sentence(worse, "the model"),
              HasSubstr("the model does not beat constant motion:"));
  EXPECT_EQ(baseline_sentence({}, "the model"), "");
}

TEST(Baselines, NameAnUnknownCommand) {
  const std::vector<CommandSpec> others = {{"forward", 1, 1, 1}};
  EXPECT_FALSE(baseline_scores(drawn(20, 0, 8), drawn(20, 0, 9), others).ok());
}

// Half of a real log predicts the other, both ways; the figures are an independent program's.
TEST(Baselines, ConstantMotionOfTheRealForwardLog) {
  const auto data = shared_data("srv1_forward");
  if (!data) GTEST_SKIP() << "the log is not at hand";
  const std::vector<std::string> files = files_in(*data, ".dat");
  std::vector<std::string> halves[2];
  for (std::size_t i = 0; i < files.size(); ++i) halves[i % 2].push_back(files[i]);
  const std::vector<std::string> names = {"forward", "turn_cw"};
  const auto a = read_trial_files(halves[0], names), b = read_trial_files(halves[1], names);
  ASSERT_TRUE(a.ok() && b.ok());
  ASSERT_EQ(a->trials.size(), 363u);
  EXPECT_NEAR(mean_of(baseline_scores(*a, *b, kCommands)->front()), 6.323, 0.005);
  EXPECT_NEAR(mean_of(baseline_scores(*b, *a, kCommands)->front()), 6.492, 0.005);
}

}  // namespace gapfarm::baselines_test
