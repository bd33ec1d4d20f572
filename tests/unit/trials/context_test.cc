#include "common/trials/context.h"

#include <gtest/gtest.h>

#include "common/random/stream.h"

namespace gapfarm::context_test {

Trial trial_of(const std::string& session, std::int64_t number, const Pose& start,
               const Pose& end) {
  Trial trial;
  trial.session = session;
  trial.trial = number;
  trial.command = "forward";
  trial.X_WS = start;
  trial.X_WE = end;
  return trial;
}

std::vector<DrivenCommand> same_command(const TrialLog& log, DrivenCommand command) {
  return std::vector<DrivenCommand>(log.trials.size(), command);
}

// Runs of `chain` trials in a 2 m arena, every pose measured anew with the given noise.
TrialLog chained_log(int trials, int chain, double sigma_m, double sigma_rad, std::uint64_t seed) {
  Stream stream({seed, Purpose::kTest, 0, 0, 0});
  const auto measured = [&](const Pose& X) {
    return Pose{X.x + sigma_m * stream.normal(), X.y + sigma_m * stream.normal(),
                wrap_angle(X.theta + sigma_rad * stream.normal())};
  };
  TrialLog log;
  Pose X;
  for (int i = 0; i < trials; ++i) {
    if (i % chain == 0) {
      X = {stream.uniform(0, 2), stream.uniform(0, 2), stream.uniform(-3.1, 3.1)};
    }
    const Pose end = X * Pose{0.25, 0, 0.1};
    log.trials.push_back(trial_of("s", i, measured(X), measured(end)));
    X = end;
  }
  return log;
}

TEST(TrialContext, FollowsTheSessionNotTheFile) {
  TrialLog log;
  log.trials = {trial_of("a", 0, {}, {}), trial_of("b", 0, {}, {}), trial_of("a", 1, {}, {}),
                trial_of("a", 2, {}, {})};
  log.trials[2].t_s = 30;
  const std::vector<DrivenCommand> commands = {{1, -1, 2}, {0, 0, 1}, {0, 0.5, 1}, {1, 1, 1}};
  const auto contexts = trial_contexts(log, commands);
  EXPECT_FALSE(contexts[0].previous || contexts[1].previous);
  EXPECT_EQ(contexts[2].previous, 0u);
  EXPECT_EQ(contexts[3].previous, 2u);
  EXPECT_TRUE(contexts[0].moved && contexts[1].moved);
  EXPECT_FALSE(contexts[2].moved || contexts[3].moved);
  EXPECT_EQ(contexts[3].place_in_run, 2);
  EXPECT_EQ(contexts[0].last_left, 0);
  EXPECT_EQ(contexts[2].last_left, 1);
  EXPECT_EQ(contexts[2].last_right, -1);
  EXPECT_EQ(contexts[3].last_left, 1) << "a duty of zero leaves the last direction";
  EXPECT_EQ(contexts[3].last_right, 1);
  EXPECT_EQ(contexts[2].session_time_s, 30);
  EXPECT_EQ(contexts[3].session_time_s, 30 + 1 + kAssumedPause_s);
}

TEST(TrialContext, ReportsMovesFromNoiseAtEveryNoiseLevel) {
  for (const int chain : {2, 4, 10}) {
    for (const double sigma_m : {0.0, 1e-4, 0.002, 0.005}) {
      for (const double sigma_rad : {0.0, 0.01, 0.03}) {
        const TrialLog log = chained_log(400, chain, sigma_m, sigma_rad, 5);
        const auto contexts = trial_contexts(log, same_command(log, {1, 1, 1}));
        int wrong = 0;
        for (int i = 0; i < 400; ++i) {
          const TrialContext& context = contexts[static_cast<std::size_t>(i)];
          wrong += context.moved != (i % chain == 0) ? 1 : 0;
        }
        EXPECT_EQ(wrong, 0) << "chain " << chain << " sigma " << sigma_m << " m " << sigma_rad;
      }
    }
  }
}

// Seen in `gapfarm blind-check configs/srv1.toml --sizes clear --nulls 0 --left-out 0 --seed 41`,
// case 14: a step of 22 mm passed for a hand, and starts after it for unsettled ones.
TEST(TrialContext, ReportsNoMovesFromRounding) {
  for (const double step_m : {0.01, 0.0219, 0.03}) {
    TrialLog log = chained_log(400, 10, 0.001, 0.01, 5);
    for (Trial& t : log.trials) {
      for (Pose* X : {&t.X_WS, &t.X_WE}) {
        X->x = step_m * std::round(X->x / step_m);
        X->y = step_m * std::round(X->y / step_m);
      }
    }
    const auto contexts = trial_contexts(log, same_command(log, {1, 1, 1}));
    int moves = 0;
    for (std::size_t i = 0; i < 400; ++i) moves += i % 10 != 0 && contexts[i].moved;
    EXPECT_EQ(moves, 0) << step_m;
  }
}

TEST(TrialContext, AMoveBeforeEveryTrialIsSeenToo) {
  const TrialLog log = chained_log(300, 1, 0.002, 0.01, 6);
  const auto contexts = trial_contexts(log, same_command(log, {1, 1, 1}));
  int seen = 0;
  for (const TrialContext& context : contexts) seen += context.moved ? 1 : 0;
  EXPECT_GE(seen, 299);
}

// A log that writes one measurement as end and start alike has no noise to learn from.
TEST(TrialContext, ToleranceStaysWithinItsLimits) {
  const MoveTolerance shared = estimate_move_tolerance(chained_log(100, 5, 0, 0, 7));
  EXPECT_EQ(shared.distance_m, 0.02);
  EXPECT_EQ(shared.heading_rad, 0.1);
  const MoveTolerance wild = estimate_move_tolerance(chained_log(100, 1, 0, 0, 8));
  EXPECT_EQ(wild.distance_m, 0.05);
  EXPECT_EQ(wild.heading_rad, 0.35);
  const MoveTolerance none = estimate_move_tolerance({});
  EXPECT_EQ(none.distance_m, 0.05);
}

}  // namespace gapfarm::context_test
