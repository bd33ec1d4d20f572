// Pushes of a piece that goes straight before the finger, logged with one thing wrong.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <numbers>

#include "common/parameters/table.h"
#include "common/random/stream.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm::push_checks_test {

constexpr double kPi = std::numbers::pi;

// From its left side, by 5 cm; nothing of it is symmetric.
Problem pushed(double by_m = 0.05) {
  Problem problem;
  problem.scenario = "push";
  problem.values = problem.table().nominal();
  const double finger_m = problem.values[row_of(Push::kFingerRadius)];
  Piece piece;
  piece.name = "wedge";
  piece.corners = {{-0.03, -0.03}, {0.09, -0.03}, {-0.03, 0.05}};
  problem.pieces = {piece};
  Stream stream({.run_seed = 3});
  for (int i = 0; i < 20; ++i) {
    Trial t;
    t.session = "s";
    t.trial = i;
    t.command = piece.name;
    t.X_WS = {stream.uniform(-1, 1), stream.uniform(-1, 1), stream.uniform(-3, 3)};
    t.X_WE = t.X_WS * Pose{by_m, 0, 0};
    for (double way_m = -0.02; way_m < by_m + 0.001; way_m += 0.01) {
      const Eigen::Vector2d tip = transform(t.X_WS, {-0.03 - finger_m + way_m, 0});
      t.tip.push_back({way_m + 0.02, tip.x(), tip.y()});
    }
    problem.log.trials.push_back(t);
  }
  return problem;
}

// The same from other places of that side, of which the middle alone turns the piece the other way.
Problem pushed_from(const std::function<double(int)>& aside_m) {
  Problem problem = pushed();
  for (Trial& t : problem.log.trials) {
    const double aside = aside_m(t.trial);
    t.X_WE = t.X_WS * (std::abs(aside) > 0.01 ? Pose{0.05, 0, -1.5} : Pose{0.07, 0, 1.2});
    for (TipSample& tip : t.tip) {
      tip.x -= aside * std::sin(t.X_WS.theta);
      tip.y += aside * std::cos(t.X_WS.theta);
    }
  }
  return problem;
}

std::string named(const Problem& problem) {
  std::vector<SanityFinding> findings;
  check_pushes(problem, &findings);
  return findings.empty() ? "" : findings.front().name;
}

std::vector<std::size_t> impossible_trials(const Problem& problem) {
  std::vector<std::size_t> rows;
  check_sanity(problem, &rows);
  return rows;
}

TEST(PushChecks, PushesFromElsewhereEndElsewhere) {
  const auto anywhere = [](int i) { return i == 7 ? 0 : i % 2 == 0 ? 0.045 : -0.025; };
  EXPECT_EQ(impossible_trials(pushed_from(anywhere)), std::vector<std::size_t>());
  // One push again and again has no reason to end there.
  const auto same = [](int i) { return i == 7 ? 0 : 0.012; };
  EXPECT_EQ(impossible_trials(pushed_from(same)), std::vector<std::size_t>{7});
}

TEST(PushChecks, LeaveOutPiecesThatTheTrackerHasLost) {
  Problem log = pushed();
  EXPECT_EQ(impossible_trials(log), std::vector<std::size_t>());
  const std::vector<std::size_t> lost = {3, 4, 11};
  for (const std::size_t row : lost) log.log.trials[row].X_WE = {2, 2, 0};
  EXPECT_EQ(impossible_trials(log), lost);
}

TEST(PushChecks, NameTheSamplesThatTheFingerJumpsTo) {
  Problem log = pushed();
  Trial &middle = log.log.trials[7], &end = log.log.trials[12];
  middle.tip_file = "m/tips.csv";
  middle.tip[3].x = 5;
  middle.tip[3].line = 61;
  end.tip.back() = {end.tip.back().t_s, 4, 4};
  EXPECT_EQ(impossible_trials(log), (std::vector<std::size_t>{7, 12}));
  const auto findings = check_sanity(log);
  const auto jumps = std::ranges::find(findings, "tip_jumps", &SanityFinding::name);
  ASSERT_NE(jumps, findings.end());
  EXPECT_NE(jumps->text.find("m/tips.csv:61, session s, trial 7, x = 5 m"), std::string::npos)
      << jumps->text;
  EXPECT_NE(jumps->remedy.find("2 in all"), std::string::npos) << jumps->remedy;
}

TEST(PushChecks, NameHowPosesDoNotFitTheFingersWay) {
  EXPECT_EQ(named(pushed()), "");
  const struct {
    const char* name;
    std::function<Pose(const Pose&)> change;
  } cases[] = {{"heading_flipped",
                [](const Pose& X) {
                  return Pose{X.x, X.y, -X.theta};
                }},
               {"heading_turned",
                [](const Pose& X) {
                  return Pose{X.x, X.y, X.theta + kPi / 2};
                }},
               {"axis_mirrored",
                [](const Pose& X) {
                  return Pose{X.x, -X.y, X.theta};
                }},
               {"axis_mirrored",
                [](const Pose& X) {
                  return Pose{X.x, -X.y, -X.theta};
                }},
               {"axes_swapped", [](const Pose& X) {
                  return Pose{X.y, X.x, X.theta};
                }}};
  for (const auto& c : cases) {
    Problem problem = pushed();
    for (Trial& t : problem.log.trials) {
      t.X_WS = c.change(t.X_WS);
      t.X_WE = c.change(t.X_WE);
    }
    EXPECT_EQ(named(problem), c.name);
  }
}

TEST(PushChecks, NameEndsThatAreExchanged) {
  // By more than its own length the finger ends in neither outline.
  for (const double by_m : {0.05, 0.2}) {
    Problem problem = pushed(by_m);
    EXPECT_EQ(named(problem), "") << by_m;
    for (Trial& t : problem.log.trials) std::swap(t.X_WS, t.X_WE);
    EXPECT_EQ(named(problem), "ends_swapped") << by_m;
  }
}

// A camera's frame whose y points down mirrors pieces and finger alike.
TEST(PushChecks, NameAFrameThatIsMirroredAsAWhole) {
  Problem problem = pushed();
  for (Trial& t : problem.log.trials) {
    for (TipSample& s : t.tip) {  // near one end of the side
      s.x -= 0.045 * std::sin(t.X_WS.theta);
      s.y = -(s.y + 0.045 * std::cos(t.X_WS.theta));
    }
    for (Pose* X : {&t.X_WS, &t.X_WE}) X->y = -X->y, X->theta = -X->theta;
  }
  std::vector<SanityFinding> findings;
  check_pushes(problem, &findings);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].name, "axis_mirrored");
  EXPECT_EQ(findings[0].remedy, "Negate y and theta of the pieces and y of the finger.");
}

TEST(PushChecks, NamePiecesWhoseNamesAreExchanged) {
  Problem problem = pushed();
  problem.pieces.push_back(
      {.name = "box", .corners = {{-0.06, -0.03}, {0, -0.03}, {0, 0.03}, {-0.06, 0.03}}});
  for (std::size_t i = 0; i < problem.log.trials.size(); i += 2) {
    Trial& t = problem.log.trials[i];
    t.command = "box";
    for (TipSample& s : t.tip) {
      s.x -= 0.03 * std::cos(t.X_WS.theta);
      s.y -= 0.03 * std::sin(t.X_WS.theta);
    }
  }
  EXPECT_EQ(named(problem), "");
  for (Trial& t : problem.log.trials) t.command = t.command == "box" ? "wedge" : "box";
  EXPECT_EQ(named(problem), "pieces_swapped");
}

// From 2 cm off the piece the finger goes away from it, or nowhere; a few such pushes are fine.
TEST(PushChecks, RefusePiecesThatMoveUntouched) {
  for (const double sense : {-1.0, 0.0}) {
    for (const std::size_t count : {3, 20}) {
      Problem problem = pushed();
      for (std::size_t i = 0; i < count; ++i) {
        std::vector<TipSample>& tip = problem.log.trials[i].tip;
        const TipSample from = tip.front();
        for (TipSample& s : tip) {
          s.x = from.x + sense * (s.x - from.x);
          s.y = from.y + sense * (s.y - from.y);
        }
      }
      std::vector<SanityFinding> findings;
      check_pushes(problem, &findings);
      if (count == 3) {
        EXPECT_FALSE(any_unusable(findings)) << findings[0].text;
        continue;
      }
      ASSERT_EQ(findings.size(), 1u);
      EXPECT_EQ(findings[0].name, "untouched");
      EXPECT_EQ(findings[0].severity, Severity::kUnusable);
      EXPECT_EQ(findings[0].text.find("20 of 20 pieces"), 0u) << findings[0].text;
      EXPECT_EQ(findings[0].text.find("do not move at all") != std::string::npos, sense == 0);
    }
  }
}

// Pieces, finger or both in another unit are named as what they are; a finger elsewhere is no unit.
TEST(PushChecks, NameTheUnitInWhichFingerAndPiecesMeet) {
  const auto finding = [](double pieces, double tip, double shift) {
    Problem problem = pushed();
    for (Trial& t : problem.log.trials) {
      for (Pose* X : {&t.X_WS, &t.X_WE}) X->x *= pieces, X->y *= pieces;
      for (TipSample& s : t.tip) s.x = tip * s.x + shift, s.y *= tip;
    }
    std::vector<SanityFinding> findings;
    check_pushes(problem, &findings);
    return findings.empty() ? SanityFinding{} : findings.front();
  };
  for (const double units : {1000.0, 100.0, 1 / 0.0254, 1 / 0.3048}) {
    const std::string by = " by " + few_digits(1 / units) + ".";
    EXPECT_EQ(finding(units, units, 0).remedy, "Multiply the positions of pieces and finger" + by);
    EXPECT_EQ(finding(units, 1, 0).remedy, "Multiply the positions of pieces" + by);
    EXPECT_EQ(finding(1, units, 0).remedy, "Multiply the positions of finger" + by);
  }
  for (const double shift_m : {0.5, 4.0, 40.0}) {
    EXPECT_EQ(finding(1, 1, shift_m).name, "frames_apart") << shift_m;
  }
}

// A row that repeats its start although the finger went through there, and another piece's end.
TEST(PushChecks, EndsThatTheirFingersExcludeAreFalse) {
  Problem problem = pushed();
  EXPECT_TRUE(against_their_fingers(problem).empty());
  problem.log.trials[4].X_WE = problem.log.trials[4].X_WS;
  problem.log.trials[9].X_WE.x += 0.25;
  EXPECT_EQ(against_their_fingers(problem), (std::vector<std::size_t>{4, 9}));
  std::vector<std::size_t> omitted;
  check_sanity(problem, &omitted);
  EXPECT_EQ(omitted, (std::vector<std::size_t>{4, 9}));
}

// Two rows that have each other's poses: neither finger comes near, and both pieces move.
TEST(PushChecks, PiecesThatMoveFarFromTheirFingersAreFalse) {
  Problem problem = pushed();
  for (const std::size_t i : {4, 9}) {
    for (Pose* X : {&problem.log.trials[i].X_WS, &problem.log.trials[i].X_WE}) X->y += 1;
  }
  EXPECT_EQ(against_their_fingers(problem), (std::vector<std::size_t>{4, 9}));
  problem.log.trials[4].X_WE = problem.log.trials[4].X_WS;  // a miss is none
  EXPECT_EQ(against_their_fingers(problem), (std::vector<std::size_t>{9}));
}

TEST(PushChecks, NoteAnotherPiece) {
  Problem problem = pushed();
  for (Eigen::Vector2d& corner : problem.pieces[0].corners) corner *= 1.5;
  EXPECT_EQ(named(problem), "frames_apart");
}

}  // namespace gapfarm::push_checks_test
