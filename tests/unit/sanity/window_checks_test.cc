// Windows of runs held against a program that knows where its robot goes, as logged and spoiled.
#include "master/io/log_checks/window_checks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "common/random/stream.h"

namespace gapfarm::window_checks_test {

using Spoil = std::function<Pose(const Pose&)>;

// What a check of a hundred windows names; the program's robot is off by `scale` of the motion.
std::string named(const Spoil& spoil, double scale = 1) {
  Stream stream(StreamKey{7, Purpose::kEvaluation, 0, 0, 0});
  const auto draw = [&](double least, double most) {
    return least + (most - least) * stream.uniform();
  };
  TrialLog log;
  std::vector<Pose> ends;
  for (int i = 0; i < 100; ++i) {
    const Pose start{draw(-3, 3), draw(-3, 3), draw(-3, 3)};
    const Twist motion{draw(0.2, 0.6), 0, draw(-0.2, 1)};
    Trial trial;
    trial.X_WS = spoil(start);
    const Pose noise{draw(-0.01, 0.01), draw(-0.01, 0.01), draw(-0.02, 0.02)};
    trial.X_WE = spoil(start * exp(motion) * noise);
    log.trials.push_back(trial);
    ends.push_back(trial.X_WS * exp(Twist(scale * motion)));
  }
  std::vector<SanityFinding> findings;
  check_windows(log, ends, &findings);
  return findings.empty() ? "" : findings.front().name;
}

TEST(WindowChecks, NameWhatIsTheWrongWayRound) {
  EXPECT_EQ(named([](Pose X) { return Pose{1000 * X.x, 1000 * X.y, X.theta}; }), "unit_error");
  EXPECT_EQ(named([](Pose X) { return Pose{100 * X.x, 100 * X.y, X.theta}; }), "unit_error");
  EXPECT_EQ(named([](Pose X) { return Pose{-X.x, X.y, M_PI - X.theta}; }), "sides_swapped");
  EXPECT_EQ(named([](Pose X) { return Pose{X.x, X.y, -X.theta}; }), "heading_flipped");
  EXPECT_EQ(named([](Pose X) { return Pose{X.x, -X.y, X.theta}; }), "axis_mirrored");
  EXPECT_EQ(named([](Pose X) { return Pose{-X.x, X.y, X.theta}; }), "axis_mirrored");
  EXPECT_EQ(named([](Pose X) { return Pose{X.y, X.x, X.theta}; }), "axes_swapped");
  EXPECT_EQ(named([](Pose X) { return Pose{X.x, X.y, X.theta + M_PI / 2}; }), "heading_turned");
  EXPECT_EQ(named([](Pose X) { return Pose{X.x, X.y, X.theta + M_PI}; }), "heading_turned");
}

TEST(WindowChecks, AskNothingOfALogElsewhereNorOfAProgramThatIsNotTunedYet) {
  const auto turned = [](Pose X) { return Pose{5000, -3000, 2} * X; };
  EXPECT_EQ(named([](Pose X) { return X; }), "");
  EXPECT_EQ(named(turned), "");
  for (const double scale : {0.3, 0.7, 1.3, 3.0}) EXPECT_EQ(named(turned, scale), "") << scale;
}

}  // namespace gapfarm::window_checks_test
