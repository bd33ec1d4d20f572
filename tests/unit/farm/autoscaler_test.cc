#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "master/farm/sites/fleet.h"
#include "tests/bench/fleet_simulation.h"

namespace gapfarm::autoscaler_test {

std::vector<FleetJob> jobs(unsigned count, JobState state, double since_s, bool joined = true,
                           bool idle = false) {
  std::vector<FleetJob> all;
  for (unsigned i = 0; i < count; ++i) {
    all.push_back({std::to_string(i), state, "n" + std::to_string(i), since_s, joined, idle});
  }
  return all;
}

FleetLimits up_to(unsigned most) {
  FleetLimits limits;
  limits.max_workers = most;
  return limits;
}

TEST(Autoscaler, FillsAnEmptyFarmAtOnceAndNeverBeyondMax) {
  FleetMemory memory;
  const FleetDecision first = decide({1000, true, {}, {}}, up_to(200), 0, &memory);
  EXPECT_EQ(first.submit, 200u);
  const auto standing = jobs(200, JobState::kQueued, 0);
  EXPECT_EQ(decide({1000, true, standing, {}}, up_to(200), 15, &memory).submit, 0u);
}

TEST(Autoscaler, AsksForNoMoreThanThereAreTasksAndForMinAtLeast) {
  FleetMemory memory;
  FleetLimits limits = up_to(200);
  limits.min_workers = 3;
  limits.workers_per_job = 2;
  EXPECT_EQ(decide({0, true, {}, {}}, limits, 0, &memory).submit, 2u);
  EXPECT_EQ(decide({41, true, jobs(2, JobState::kRunning, 0), {}}, limits, 15, &memory).submit,
            19u);
  limits.max_workers = 7;  // no half of a job
  FleetMemory other;
  EXPECT_EQ(decide({41, true, {}, {}}, limits, 0, &other).submit, 3u);
}

TEST(Autoscaler, ReplacesWhatEnded) {
  FleetMemory memory;
  decide({100, true, jobs(4, JobState::kRunning, 0), {}}, up_to(4), 0, &memory);
  const std::vector<EndedJob> ended = {{"3", "n3", true, false}};
  EXPECT_EQ(
      decide({100, true, jobs(3, JobState::kRunning, 0), ended}, up_to(4), 900, &memory).submit,
      1u);
}

TEST(Autoscaler, PreEmptionIsNoFailure) {
  FleetMemory memory;
  for (int k = 0; k < 50; ++k) {
    const std::vector<EndedJob> ended = {{"x", "n1", true, false}};
    EXPECT_EQ(decide({100, true, {}, ended}, up_to(1), 20.0 * k, &memory).submit, 1u);
  }
}

TEST(Autoscaler, DrainsWhenTheQueueIsShortForAWhileAndSparesWhoWorks) {
  FleetMemory memory;
  auto standing = jobs(10, JobState::kRunning, 0, true, true);
  for (int i = 0; i < 4; ++i) standing[static_cast<std::size_t>(i)].idle = false;
  decide({10, true, standing, {}}, up_to(10), 100, &memory);
  // A pause between two generations takes nobody away.
  EXPECT_TRUE(decide({0, true, standing, {}}, up_to(10), 115, &memory).cancel.empty());
  decide({4, true, standing, {}}, up_to(10), 120, &memory);
  const auto gone = decide({4, true, standing, {}}, up_to(10), 146, &memory).cancel;
  EXPECT_EQ(gone.size(), 6u);
  for (const std::string& id : gone) EXPECT_GE(std::stoi(id), 4);
  // Who waits in the cluster's queue goes before whoever runs.
  FleetMemory other;
  auto mixed = jobs(2, JobState::kRunning, 0, true, true);
  mixed.push_back({"q", JobState::kQueued, "", 5, false, false});
  EXPECT_EQ(decide({2, true, mixed, {}}, up_to(10), 200, &other).cancel,
            std::vector<std::string>{"q"});
}

TEST(Autoscaler, WithoutMasterOrListNothingChanges) {
  FleetMemory memory;
  decide({100, true, jobs(2, JobState::kRunning, 0), {}}, up_to(10), 0, &memory);
  const auto away = decide({{}, true, jobs(2, JobState::kRunning, 0), {}}, up_to(10), 9, &memory);
  EXPECT_EQ(away.submit, 0u);
  EXPECT_FALSE(away.why.empty());
  EXPECT_EQ(decide({100, false, jobs(2, JobState::kRunning, 0), {}}, up_to(10), 9, &memory).submit,
            0u);
}

TEST(Autoscaler, FindsTheSitesLimitByFewRefusalsAndTriesAgainLater) {
  FleetMemory memory;
  const FleetLimits limits = up_to(200);
  unsigned standing = 0, refusals = 0;
  double now = 0;
  for (; now < 300; now += 15) {
    const auto decision =
        decide({1000, true, jobs(standing, JobState::kRunning, 0), {}}, limits, now, &memory);
    if (decision.submit == 0) {
      EXPECT_FALSE(decision.why.empty());
      continue;
    }
    if (standing + decision.submit > 4) {
      ++refusals;
      memory.note_site_limit(decision.submit, standing, limits, now);
    } else {
      memory.note_accepted(decision.submit, standing);
      standing += decision.submit;
    }
  }
  EXPECT_EQ(standing, 4u);
  EXPECT_EQ(memory.site_limit(), 4u);
  EXPECT_LE(refusals, 9u);
  EXPECT_EQ(
      decide({1000, true, jobs(4, JobState::kRunning, 0), {}}, limits, now + 600, &memory).submit,
      1u);
}

// HTCondor's schedd counts jobs for a while that it lists no more.
TEST(Autoscaler, OneRefusalOfFewerJobsThanOnceStoodIsNoLimit) {
  FleetMemory memory;
  const FleetLimits limits = up_to(4);
  memory.note_accepted(4, 0);
  memory.note_site_limit(1, 0, limits, 100);
  EXPECT_EQ(memory.site_limit(), std::nullopt);
  EXPECT_EQ(decide({100, true, {}, {}}, limits, 101, &memory).submit, 0u);
  EXPECT_EQ(decide({100, true, {}, {}}, limits, 131, &memory).submit, 4u);
  memory.note_accepted(1, 0);
  memory.note_site_limit(3, 1, limits, 140);
  EXPECT_EQ(memory.site_limit(), std::nullopt);
  // Refused again, for what else this user runs, that is the limit.
  memory.note_site_limit(3, 1, limits, 180);
  EXPECT_EQ(memory.site_limit(), 3u);
}

TEST(Autoscaler, ABadNodeIsAvoidedTwiceAsLongEveryTime) {
  FleetMemory memory;
  const FleetLimits limits = up_to(2);
  const auto good = jobs(1, JobState::kRunning, 0);
  double now = 0, last_wait = 15;
  for (int k = 0; k < 5; ++k) {
    const std::vector<EndedJob> ended = {{"b", "bad", false, false}};
    auto decision = decide({100, true, good, ended}, limits, now, &memory);
    EXPECT_EQ(decision.avoid, std::vector<std::string>{"bad"});
    if (k < 2) {
      EXPECT_EQ(decision.submit, 1u) << "the others go on";
    }
    double wait = 0;
    while (!decision.avoid.empty()) {
      now += 1;
      wait += 1;
      decision = decide({100, true, good, {}}, limits, now, &memory);
    }
    EXPECT_NEAR(wait, 2 * last_wait, 1);
    last_wait = wait;
  }
  // One that joins there makes up for it.
  const std::vector<FleetJob> back = {{"c", JobState::kRunning, "bad", now + 1, true, false}};
  decide({100, true, back, {}}, limits, now + 2, &memory);
  const std::vector<EndedJob> ended = {{"b", "bad", false, false}};
  decide({100, true, good, ended}, limits, now + 3, &memory);
  EXPECT_TRUE(decide({100, true, good, {}}, limits, now + 34, &memory).avoid.empty());
}

TEST(Autoscaler, WhereNoNodeCanBeAvoidedTheSiteWaits) {
  FleetMemory memory;
  FleetLimits limits = up_to(2);
  limits.avoids_nodes = false;
  const std::vector<EndedJob> ended = {{"b", "", false, false}};
  const auto decision = decide({100, true, {}, ended}, limits, 0, &memory);
  EXPECT_EQ(decision.submit, 0u);
  EXPECT_NE(decision.why.find("30 s"), std::string::npos) << decision.why;
  EXPECT_EQ(decide({100, true, {}, {}}, limits, 31, &memory).submit, 2u);
}

TEST(Autoscaler, TenThousandWorkersCostLittleMoreThanAnOracle) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const FleetScenario scenario = large_fleet(seed);
    const FleetOutcome outcome = simulate_fleet(scenario);
    // Who keeps all that the site allows from the first moment to the last.
    FleetScenario kept = scenario;
    kept.limits.idle_s = 1e9;
    kept.limits.max_workers = std::min<unsigned>(10000, 8 * scenario.site_limit);
    const double kept_span_s = simulate_fleet(kept).span_s;
    std::printf("seed %d: cost over oracle %.3f, span %.0f s (all workers all the time: %.0f s)\n",
                static_cast<int>(seed), outcome.paid_s / outcome.oracle_s, outcome.span_s,
                kept_span_s);
    std::printf(
        "  %u jobs, %u submissions, %u refused, %u pre-empted, %u on bad nodes, at most %u "
        "workers, idle after the last task %.0f s\n",
        outcome.jobs, outcome.submissions, outcome.refusals, outcome.preempted, outcome.quick_ends,
        outcome.most_workers, outcome.idle_after_s);
    EXPECT_GT(outcome.span_s, 0);
    EXPECT_LE(outcome.most_workers, std::min(scenario.limits.max_workers, 8 * scenario.site_limit));
    EXPECT_LE(outcome.paid_s, 1.15 * outcome.oracle_s);
    EXPECT_LE(outcome.span_s, 1.15 * kept_span_s);
    EXPECT_LT(outcome.idle_after_s, 60);
    EXPECT_LT(outcome.refusals, 100u);
    // A site's limit that is not known yet is found by bisection, which here takes a look a step.
    if (8 * scenario.site_limit < scenario.limits.max_workers) continue;
    const auto full = std::find_if(
        outcome.moments.begin(), outcome.moments.end(),
        [&](const FleetMoment& moment) { return moment.queued + moment.running >= 10000; });
    ASSERT_NE(full, outcome.moments.end());
    std::printf("  from none to all within %.0f s, looks every %.0f s\n", full->at_s,
                scenario.look_interval_s);
    EXPECT_LE(full->at_s, 2 * scenario.look_interval_s);
  }
}

}  // namespace gapfarm::autoscaler_test
