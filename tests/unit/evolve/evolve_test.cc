#include "master/evolve/evolve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/evolve/members_digest.h"
#include "tests/unit/evolve/toy_problems.h"

namespace gapfarm::evolve_test {

// Scores by a toy; each generation takes 2 s of the fake clock.
class ToyBackend {
 public:
  ToyBackend(const ToyRun& run, double& clock) : run_(run), clock_(clock) {}
  Status operator()(std::vector<Candidate> candidates, const TakeScore& take) {
    clock_ += 2;
    if (on_call) on_call();
    if (fail) return Error{"no worker can be had"};
    if (lose_one) candidates.pop_back();
    for (std::size_t place = 0; place < candidates.size(); ++place) {
      ASSIGN_OR_RETURN(const auto more, take(place, run_.score(candidates[place])));
      candidates.insert(candidates.end(), more.begin(), more.end());
    }
    return {};
  }
  std::function<void()> on_call;
  bool fail = false;
  bool lose_one = false;

 private:
  const ToyRun& run_;
  double& clock_;
};

class KeepingSink {
 public:
  Status operator()(const GenerationRecord& record) {
    if (record.generation == refuse) return Error{"disk full"};
    records.push_back(record);
    return {};
  }
  std::vector<GenerationRecord> records;
  std::uint64_t refuse = 0;
};

std::vector<std::string> digests(const std::vector<GenerationRecord>& records) {
  std::vector<std::string> found;
  for (const GenerationRecord& record : records) {
    found.push_back(members_digest(record.generation, record.members));
  }
  return found;
}

class EvolveTest : public testing::Test {
 protected:
  explicit EvolveTest() : backend_(run_, now_) {
    options_.settings = run_.setup().settings;
    options_.settings.generations = 12;
    options_.fitness = FitnessKind::kEnergyScore;
  }
  Result<EvolveSummary> go() {
    return evolve(run_.optimiser(), std::ref(backend_), std::ref(sink_), clock_, options_,
                  [this] { return stop_; });
  }

  ToyRun run_{sphere(3), EvolutionSettings{}, 1};
  double now_ = 100;
  EvolveClock clock_ = [this] { return now_; };
  ToyBackend backend_;
  KeepingSink sink_;
  EvolveOptions options_;
  bool stop_ = false;
};

TEST_F(EvolveTest, StopsAfterItsGenerations) {
  const EvolveSummary summary = go().value();
  EXPECT_EQ(summary.reason, StopReason::kGenerations);
  EXPECT_EQ(summary.text, "completed 12 of 12 generations");
  EXPECT_EQ(summary.generations, 12U);
  EXPECT_EQ(sink_.records.size(), 12U);
  EXPECT_EQ(summary.wall_s, 24);
  EXPECT_EQ(summary.best->standing.cost, run_.optimiser().best().standing.cost);
}

TEST_F(EvolveTest, StopsAtItsEvaluations) {
  options_.settings.evaluations = 100;
  const EvolveSummary summary = go().value();
  EXPECT_EQ(summary.reason, StopReason::kEvaluations);
  EXPECT_GE(summary.evaluations, 100U);
  EXPECT_LT(summary.evaluations, 140U);
}

TEST_F(EvolveTest, StopsAtItsTimeIncludingWhatWasSpentBefore) {
  options_.settings.time_s = 20;
  options_.spent_s = 13;
  const EvolveSummary summary = go().value();
  EXPECT_EQ(summary.reason, StopReason::kTime);
  EXPECT_EQ(summary.generations, 4U);  // 13 + 4 * 2 >= 20
}

TEST_F(EvolveTest, CountsTheTimeThatPreparedIt) {
  options_.settings.time_s = 4;
  options_.began_s = now_ - 5;
  const EvolveSummary summary = go().value();
  EXPECT_EQ(summary.generations, 1U) << "a run has one, however long it was prepared";
  EXPECT_EQ(summary.wall_s, 7);
  EXPECT_EQ(sink_.records.front().wall_s, 7);
}

TEST_F(EvolveTest, StopsAtItsTargetInTheFitnesssOwnSense) {
  options_.settings.target_fitness = 0.5;
  options_.settings.generations = 1000;
  EvolveSummary summary = go().value();
  EXPECT_EQ(summary.reason, StopReason::kTargetFitness);
  EXPECT_LE(summary.best->standing.cost, 0.5);
  EXPECT_THAT(summary.text, testing::HasSubstr("the target was 0.5"));

  // For a log score of -cost the same target is -0.5.
  ToyRun other(sphere(3), EvolutionSettings{}, 1);
  options_.fitness = FitnessKind::kLogScore;
  options_.settings.target_fitness = -0.5;
  EXPECT_EQ(evolve(other.optimiser(), std::ref(backend_), std::ref(sink_), clock_, options_)
                .value()
                .generations,
            summary.generations);
}

TEST_F(EvolveTest, StopsAtStagnation) {
  run_.scorer = [](const Candidate&) { return Score{v1::OK, 1}; };
  options_.settings.stagnation_generations = 3;
  const EvolveSummary summary = go().value();
  EXPECT_EQ(summary.reason, StopReason::kStagnation);
  EXPECT_EQ(summary.generations, 4U);
}

TEST_F(EvolveTest, StopsOnRequestAfterACommittedGeneration) {
  int calls = 0;
  backend_.on_call = [&] { stop_ = ++calls == 3; };
  const EvolveSummary summary = go().value();
  EXPECT_EQ(summary.reason, StopReason::kRequested);
  EXPECT_EQ(summary.generations, 3U);
  EXPECT_EQ(sink_.records.size(), 3U);
}

TEST_F(EvolveTest, ARequestThatInterruptsAGenerationDropsIt) {
  int calls = 0;
  backend_.on_call = [&] { stop_ = backend_.fail = ++calls == 3; };
  const EvolveSummary summary = go().value();
  EXPECT_EQ(summary.reason, StopReason::kRequested);
  EXPECT_EQ(summary.generations, 2U);
  EXPECT_EQ(sink_.records.size(), 2U);
}

TEST_F(EvolveTest, ErrorsEndTheRun) {
  backend_.fail = true;
  EXPECT_EQ(go().error().message, "no worker can be had");
  backend_.fail = false;
  backend_.lose_one = true;
  EXPECT_EQ(go().error().message, "asked for 40 scores, but got 39");
  backend_.lose_one = false;
  sink_.refuse = 2;
  EXPECT_EQ(go().error().message, "disk full");
  EXPECT_EQ(sink_.records.size(), 1U);
}

TEST_F(EvolveTest, ResumingFromAnyGenerationGivesTheSameDigests) {
  ASSERT_TRUE(go());
  const std::vector<GenerationRecord> records = sink_.records;
  for (const GenerationRecord& from : records) {
    auto optimiser = restore_optimiser(run_.setup(), from.optimiser_state).value();
    KeepingSink rest;
    ASSERT_TRUE(evolve(*optimiser, std::ref(backend_), std::ref(rest), clock_, options_));
    EXPECT_EQ(
        digests(rest.records),
        digests({records.begin() + static_cast<std::ptrdiff_t>(from.generation), records.end()}));
  }
}

TEST_F(EvolveTest, DigestsIgnoreTimeAndShowSeedsApart) {
  ASSERT_TRUE(go());
  const std::vector<std::string> whole = digests(sink_.records);
  ToyRun same(sphere(3), EvolutionSettings{}, 1), other(sphere(3), EvolutionSettings{}, 2);
  backend_.on_call = [&] { now_ += 5; };
  KeepingSink of_same, of_other;
  ASSERT_TRUE(evolve(same.optimiser(), std::ref(backend_), std::ref(of_same), clock_, options_));
  ASSERT_TRUE(evolve(other.optimiser(), std::ref(backend_), std::ref(of_other), clock_, options_));
  EXPECT_EQ(digests(of_same.records), whole);
  EXPECT_NE(digests(of_other.records).back(), whole.back());
}

TEST_F(EvolveTest, RecordsReportWhatHappened) {
  ASSERT_TRUE(go().ok());
  std::uint64_t expected = 1;
  for (const GenerationRecord& record : sink_.records) {
    EXPECT_EQ(record.generation, expected++);
    EXPECT_EQ(record.wall_s, 2);
    EXPECT_GE(record.diversity, 0);
    EXPECT_LE(record.diversity, 1);
    EXPECT_FALSE(record.operator_probabilities.empty());
  }
  EXPECT_GT(sink_.records.front().diversity, sink_.records.back().diversity);
  EXPECT_EQ(sink_.records.back().evaluations, run_.optimiser().evaluations());
}

TEST_F(EvolveTest, AGenerationOfFailuresReachesNoTarget) {
  run_.scorer = [](const Candidate&) { return Score{v1::DIVERGED, 0}; };
  options_.settings.target_fitness = 5;
  EXPECT_EQ(go().value().reason, StopReason::kGenerations);
}

}  // namespace gapfarm::evolve_test
