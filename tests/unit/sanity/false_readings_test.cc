// Readings that others contradict, or that are like no other.
#include <gmock/gmock.h>

#include <functional>
#include <set>

#include "tests/unit/sanity/drawn_drives.h"

namespace gapfarm::sanity_test {

TEST(FalseReadings, KnowsReadingsThatOthersContradict) {
  const Problem sound = chained_drives(600);
  EXPECT_EQ(impossible_trials(sound), std::vector<std::size_t>());
  const std::vector<std::size_t> rows = {6, 29, 103, 104, 251};  // 29: then a hand moved it
  const std::function<void(Trial*)> faults[] = {
      [](Trial* t) {
        t->X_WE = {0, 0, 0};
      },  // lost
      [](Trial* t) {
        t->X_WE = t->X_WE * Pose{0, 0, kPi};
      },  // back for front
      [](Trial* t) {
        t->X_WE = t->X_WE * Pose{-0.2, 0.45, 1};
      },  // another robot's
  };
  for (const auto& fault : faults) {
    Problem log = sound;
    for (const std::size_t row : rows) fault(&log.log.trials[row]);
    EXPECT_EQ(impossible_trials(log), rows);
    EXPECT_FALSE(any_unusable(check_sanity(log)));
  }
}

// A recorder that stuck: its ends repeat their starts, and the next start is where the robot went.
TEST(FalseReadings, KnowsEndsThatRepeatTheirStart) {
  Problem log = chained_drives(200);
  std::vector<std::size_t> rows;
  for (std::size_t i = 2; i < 200; i += 2) {
    if (i % 10 == 8) continue;  // a hand moves it next, or did before
    rows.push_back(i);
    log.log.trials[i].X_WE = log.log.trials[i].X_WS;
  }
  EXPECT_THAT(impossible_trials(log), testing::IsSupersetOf(rows));
  Problem parked = chained_drives(200);
  for (const std::size_t i : rows) {
    Trial& t = parked.log.trials[i];
    t.left = t.right = 0.0;
    t.X_WE = t.X_WS;
  }
  EXPECT_EQ(impossible_trials(parked), std::vector<std::size_t>());
}

TEST(FalseReadings, BelievesReadingsThatOthersConfirm) {
  Problem slipped = chained_drives(300);
  for (std::size_t i = 0; i < 300; ++i) {
    if (i % 30 != 6) continue;
    // From there on the robot is where its slip has led it.
    const Pose X_WE = slipped.log.trials[i].X_WE;
    const Pose to = X_WE * Pose{-0.08, 0.05, -0.9} * inverse(X_WE);
    for (std::size_t j = i; j % 10 != 0; ++j) {
      Trial& t = slipped.log.trials[j];
      if (j > i) t.X_WS = to * t.X_WS;
      t.X_WE = to * t.X_WE;
    }
  }
  EXPECT_EQ(impossible_trials(slipped), std::vector<std::size_t>());
  Problem late = chained_drives(300);
  for (std::size_t i = 6; i < 300; i += 30) {
    Trial& t = late.log.trials[i];
    t.X_WE = t.X_WS * exp(0.6 * log(between(t.X_WS, t.X_WE)));
  }
  EXPECT_EQ(impossible_trials(late), std::vector<std::size_t>());
}

// Two in a hundred rows that have another trial's command: their readings are right, and confirmed.
TEST(FalseReadings, KnowsCommandsOfOtherTrials) {
  for (Problem log : {chained_drives(600), drawn_drives(600)}) {
    std::vector<Trial>& trials = log.log.trials;
    std::set<std::size_t> exchanged;
    for (std::size_t i = 40; i < 600; i += 100) {
      std::size_t other = i + 1;
      while (*trials[other].left * *trials[i].left > 0 ||
             *trials[other].right * *trials[i].right > 0) {
        ++other;  // to one that leads elsewhere altogether
      }
      std::swap(trials[i].command, trials[other].command);
      std::swap(trials[i].left, trials[other].left);
      std::swap(trials[i].right, trials[other].right);
      std::swap(trials[i].duration_s, trials[other].duration_s);
      exchanged.insert({i, other});
    }
    // A turn of half a circle is on the way of another one.
    const std::vector<std::size_t> rows = impossible_trials(log);
    EXPECT_THAT(exchanged, testing::IsSupersetOf(rows));
    EXPECT_GE(rows.size() + 2, exchanged.size());
    EXPECT_EQ(first_name(log), "commands_exchanged");
  }
}

TEST(FalseReadings, LeavesOutWhatIsLikeNoOther) {
  Problem log = drawn_drives(600);  // a hand puts the robot in place before each: none confirms
  log.log.trials[77].X_WE = log.log.trials[77].X_WE * Pose{0, 0, kPi};
  EXPECT_EQ(impossible_trials(log), std::vector<std::size_t>{77});
  EXPECT_EQ(first_name(log), "false_readings");
}

}  // namespace gapfarm::sanity_test
