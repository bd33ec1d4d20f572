// Checks of logs of drives that were drawn from plain kinematics and then spoiled in one way.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>
#include <utility>

#include "common/external/protocol.h"
#include "master/io/log_checks/log_checks.h"
#include "tests/unit/sanity/drawn_drives.h"

namespace gapfarm::sanity_test {

Problem spoiled(Problem problem, const std::function<Pose(const Pose&)>& change) {
  for (Trial& t : problem.log.trials) {
    for (Pose* X : {&t.X_WS, &t.X_WE}) {
      *X = change(*X);
      X->theta = wrap_angle(X->theta);
    }
  }
  return problem;
}

TEST(Sanity, HasNoWarningsAboutASoundLog) {
  for (std::uint64_t seed : {1, 2, 3}) EXPECT_EQ(first_name(drawn_drives(200, {}, seed)), "");
}

TEST(Sanity, IsTheSameWhereverTheLogLiesAndHoweverItIsTurned) {
  const Problem log = drawn_drives(200);
  EXPECT_EQ(first_name(spoiled(log,
                               [](const Pose& X) {
                                 return Pose{X.x + 5000, X.y - 3000, X.theta};
                               })),
            "");
  EXPECT_EQ(first_name(spoiled(log, [](const Pose& X) { return Pose{0, 0, 2.1} * X; })), "");
}

TEST(Sanity, NamesTheSessionThatIsTheWrongWayRoundAlone) {
  Problem problem = drawn_drives(150);
  for (Trial& t : problem.log.trials) {
    if (t.session == "s2") std::swap(t.left, t.right);
  }
  const auto findings = check_sanity(problem);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].name, "sides_swapped");
  EXPECT_EQ(findings[0].text.find("In session s2 alone"), 0u) << findings[0].text;
}

TEST(Sanity, KnowsCommandsOfOtherTrials) {
  Problem problem = drawn_drives(150);
  const Problem other = drawn_drives(150, {}, 2);
  for (std::size_t i = 0; i < 150; ++i) {
    Trial& t = problem.log.trials[i];
    const Trial& from = other.log.trials[i];
    std::tie(t.command, t.left, t.right) = std::tie(from.command, from.left, from.right);
  }
  EXPECT_EQ(first_name(problem), "commands_unrelated");
}

TEST(Sanity, NamesWhatIsTheWrongWayRound) {
  const struct {
    const char* name;
    std::function<Pose(const Pose&)> change;
  } cases[] = {
      {"axis_mirrored",
       [](const Pose& X) {
         return Pose{X.x, -X.y, X.theta};
       }},
      {"axis_mirrored",
       [](const Pose& X) {
         return Pose{-X.x, X.y, X.theta};
       }},
      {"axes_swapped",
       [](const Pose& X) {
         return Pose{X.y, X.x, X.theta};
       }},
      {"heading_flipped",
       [](const Pose& X) {
         return Pose{X.x, X.y, -X.theta};
       }},
      {"heading_flipped",
       [](const Pose& X) {
         return Pose{X.x, X.y, kPi / 2 - X.theta};
       }},
      {"heading_turned",
       [](const Pose& X) {
         return Pose{X.x, X.y, X.theta + kPi};
       }},
      {"heading_turned",
       [](const Pose& X) {
         return Pose{X.x, X.y, X.theta - kPi / 2};
       }},
      {"sides_swapped",
       [](const Pose& X) {
         return Pose{X.x, -X.y, -X.theta};
       }},
      {"unit_error",
       [](const Pose& X) {
         return Pose{100 * X.x, 100 * X.y, X.theta};
       }},
      {"unit_error",
       [](const Pose& X) {
         return Pose{1000 * X.x, 1000 * X.y, X.theta};
       }},
      {"unit_error",
       [](const Pose& X) {
         return Pose{X.x, X.y, X.theta * kPi / 180};
       }},
  };
  for (std::uint64_t seed : {4, 5}) {
    for (const auto& c : cases) {
      EXPECT_EQ(first_name(spoiled(drawn_drives(150, {}, seed), c.change)), c.name);
    }
  }
}

TEST(Sanity, ReportsWhichRowsAreInAnotherUnit) {
  const struct {
    double times;
    const char* unit;
    std::function<bool(const Trial&, std::size_t)> is_in_it;
    const char* where;
  } cases[] = {
      {1000, "millimetres", [](const Trial& t, std::size_t) { return t.session == "s2"; },
       "session s2 alone"},
      {100, "centimetres", [](const Trial&, std::size_t i) { return i >= 60; }, "the first is"},
      {1 / 0.0254, "inches", [](const Trial&, std::size_t i) { return i % 3 != 0; },
       "the first is"},
      {1000, "millimetres", [](const Trial&, std::size_t i) { return i % 2 == 0; },
       "the first is"}};
  for (const auto& c : cases) {
    Problem problem = drawn_drives(150);
    for (std::size_t i = 0; i < 150; ++i) {
      Trial& t = problem.log.trials[i];
      if (!c.is_in_it(t, i)) continue;
      for (Pose* X : {&t.X_WS, &t.X_WE}) *X = {c.times * X->x, c.times * X->y, X->theta};
    }
    const auto findings = check_sanity(problem);
    ASSERT_FALSE(findings.empty());
    EXPECT_EQ(findings[0].name, "unit_error");
    EXPECT_EQ(findings[0].severity, Severity::kUnusable);
    EXPECT_NE(findings[0].text.find(c.unit), std::string::npos) << findings[0].text;
    EXPECT_NE(findings[0].text.find(c.where), std::string::npos) << findings[0].text;
    EXPECT_NE(findings[0].remedy.find("of no others"), std::string::npos);
  }
}

TEST(Sanity, ReportsWhichUnitAndWhichAxis) {
  const Problem log = drawn_drives(150);
  const auto text_of = [](const Problem& problem) {
    const SanityFinding f = check_sanity(problem).front();
    return f.text + " " + f.remedy;
  };
  const std::string cm = text_of(spoiled(log, [](const Pose& X) {
    return Pose{100 * X.x, 100 * X.y, X.theta};
  }));
  EXPECT_NE(cm.find("centimetres"), std::string::npos) << cm;
  const std::string x = text_of(spoiled(log, [](const Pose& X) {
    return Pose{-X.x, X.y, X.theta};
  }));
  EXPECT_NE(x.find("sign of x0 and x1"), std::string::npos) << x;
}

// Nobody knows how fast a program's robot may be, but wheels carry none at hundreds of m/s.
TEST(Sanity, ReportsUnitsOfAProgramsRobot) {
  Problem log = drawn_drives(150);
  log.scenario = "external";
  const auto program = make_external_program(
      {{"program"}, "."},
      R"({"gapfarm": 1, "parameters": [{"key": "v", "lower": 0, "upper": 9, "nominal": 1}]})",
      false);
  ASSERT_TRUE(program) << program.error().message;
  log.external = *program;
  log.values = log.table().nominal();
  EXPECT_EQ(first_name(log), "");
  const auto found = check_sanity(spoiled(log, [](const Pose& X) {
    return Pose{1000 * X.x, 1000 * X.y, X.theta};
  }));
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].name, "unit_error");
  EXPECT_THAT(found[0].text, testing::HasSubstr("millimetres"));
}

TEST(Sanity, SwappedCommandsAreSwappedSides) {
  Problem log = drawn_drives(150);
  for (Trial& t : log.log.trials) std::swap(t.left, t.right);
  EXPECT_EQ(first_name(log), "sides_swapped");
}

// Where turns are small, none at all agrees with most of what is seen, either way round.
TEST(Sanity, SmallTurnsReportTheirSense) {
  for (const double rate : {0.6, 0.9, 1.2}) {
    Problem log = drawn_drives(200, {0.25, rate});
    EXPECT_EQ(first_name(log), "") << rate;
    for (Trial& t : log.log.trials) std::swap(t.left, t.right);
    EXPECT_EQ(first_name(log), "sides_swapped") << rate;
  }
}

// Wild rows, a lens, an asymmetric motor: a diagnosis's business.
TEST(Sanity, HasNoWarningsAboutWhatTheCatalogueExplains) {
  Problem log = drawn_drives(300);
  for (std::size_t i = 0; i < 300; i += 100) log.log.trials[i].X_WE.theta = 1;
  const auto usable = [](const Problem& of) { return !any_unusable(check_sanity(of)); };
  EXPECT_TRUE(usable(log));
  EXPECT_TRUE(usable(spoiled(log, [](const Pose& X) { return Pose{X.x, 1.2 * X.y, X.theta}; })));
  EXPECT_TRUE(usable(spoiled(log, [](const Pose& X) { return Pose{X.x, X.y, X.theta + 0.2}; })));
}

TEST(Sanity, SetsAsideAFewImpossibleRows) {
  Problem log = drawn_drives(300);
  log.log.trials[7].X_WE.x += 40;
  log.log.trials[211].X_WE.y -= 3;
  EXPECT_EQ(impossible_trials(log), (std::vector<std::size_t>{7, 211}));
  const auto findings = check_sanity(log);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].name, "impossible_rows");
  EXPECT_FALSE(any_unusable(findings));
}

Problem with_ends_exchanged(Problem problem) {
  for (Trial& t : problem.log.trials) std::swap(t.X_WS, t.X_WE);
  return problem;
}

TEST(Sanity, KnowsBeforeAndAfterThatAreExchanged) {
  const Problem sound = chained_drives(200);
  EXPECT_EQ(first_name(sound), "");
  const auto findings = check_sanity(with_ends_exchanged(sound));
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings[0].name, "ends_swapped") << findings[0].text;
  EXPECT_EQ(findings[0].severity, Severity::kUnusable);
  EXPECT_NE(findings[0].remedy.find("x0 and x1"), std::string::npos) << findings[0].remedy;
}

// Motors that run backward do so from where the robot is; what nothing follows is not known.
TEST(Sanity, TakesNoMotorsThatRunBackwardForExchangedEnds) {
  Problem backward = chained_drives(200);
  for (Trial& t : backward.log.trials) t.left = -*t.left, t.right = -*t.right;
  EXPECT_EQ(first_name(backward), "direction_reversed");
  EXPECT_EQ(first_name(with_ends_exchanged(drawn_drives(200))), "direction_reversed");
}

TEST(Sanity, ReportsHeadingsInWholeDegrees) {
  const double degree = kPi / 180;
  const Problem log = spoiled(drawn_drives(200), [degree](const Pose& X) {
    return Pose{X.x, X.y, degree * std::round(X.theta / degree)};
  });
  EXPECT_EQ(first_name(log), "headings_rounded");
  EXPECT_THAT(check_sanity(log).front().text, testing::HasSubstr("(1 deg)"));
}

TEST(Sanity, WarningsWhatCannotReportAnything) {
  EXPECT_EQ(first_name(drawn_drives(39)), "too_few_trials");
  EXPECT_EQ(first_name(drawn_drives(1)), "too_few_trials");
  EXPECT_EQ(first_name(drawn_drives(40)), "");
  const Problem still = spoiled(drawn_drives(100), [](const Pose&) { return Pose{1, 1, 0.3}; });
  EXPECT_EQ(first_name(still), "no_motion");
  Problem idle = drawn_drives(100);
  for (Trial& t : idle.log.trials) t.left = t.right = 0.0;
  EXPECT_EQ(first_name(idle), "no_motion");
}

TEST(Sanity, WarningsCopiesAndClocksThatRunBackward) {
  Problem log = drawn_drives(100);
  Problem twice = log;
  for (Trial t : log.log.trials) {
    t.session += "b";
    twice.log.trials.push_back(t);
  }
  EXPECT_EQ(first_name(twice), "duplicates");
  for (std::size_t i = 100; i < 200; ++i) twice.log.trials[i].X_WE.x += 1e-6;
  EXPECT_THAT(check_sanity(twice).front().text, testing::HasSubstr("100 of 200 trials repeat"));
  for (Trial& t : log.log.trials) t.t_s = 1000 - *t.t_s;
  EXPECT_EQ(first_name(log), "clock_backward");
}

TEST(Sanity, ARobotThatTurnsFasterThanItsSidesAllowIsAnotherOne) {
  EXPECT_EQ(first_name(drawn_drives(150, {0.19, 2.5})), "robot_out_of_bounds");
  EXPECT_EQ(first_name(drawn_drives(150, {1.5, 2.5})), "robot_out_of_bounds");
}

Problem with_durations(Problem problem, const Robot& robot, double duration_s) {
  for (Trial& t : problem.log.trials) {
    const CommandSpec& c = *std::ranges::find(problem.commands, t.command, &CommandSpec::name);
    t.left = c.left, t.right = c.right, t.duration_s = duration_s;
    t.X_WE = t.X_WS * driven(robot, {"", *t.left, *t.right, duration_s});
  }
  return problem;
}

// All turns of one log by one angle, which is another one the other way round: how far arcs lead
// and how fast the robot can be distinguish the two, or nothing does.
TEST(Sanity, TakesNoLongTurnsForTurnsTheOtherWay) {
  const Robot robot{0.28, 2};
  for (const double duration_s : {1.0, 2.0, 4.0, 6.0, 8.0, 10.0}) {
    Problem log = with_durations(drawn_drives(200, robot), robot, duration_s);
    EXPECT_EQ(first_name(log), "") << duration_s;
    for (Trial& t : log.log.trials) std::swap(t.left, t.right);
    EXPECT_EQ(first_name(log), duration_s > 2 ? "" : "sides_swapped") << duration_s;
    const auto of_any_gauge = check_axes(drive_samples(log), {0.005, 30, 0.4, 0});
    if (duration_s == 1) {
      EXPECT_EQ(of_any_gauge.value_or(SanityFinding{}).name, "sides_swapped");
    }
    std::erase_if(log.log.trials, [](const Trial& t) { return t.command.starts_with("wide"); });
    EXPECT_EQ(first_name(log), duration_s > 1 ? "" : "sides_swapped") << duration_s;
  }
}

// No unit of length makes a robot turn faster.
TEST(Sanity, TakesNoDurationsInMinutesForLengthsInInches) {
  Problem log = drawn_drives(150);
  for (Trial& t : log.log.trials) *t.duration_s /= 60;
  const auto findings = check_sanity(log);
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings[0].name, "robot_out_of_bounds");
  EXPECT_THAT(findings[0].remedy, testing::HasSubstr("Durations or duties are too small"));
}

// One angle of turn only: 200 degrees one way may be 160 the other.
TEST(Sanity, DoesNotGuessWhichWayALongTurnWent) {
  Problem log = drawn_drives(200, {0.25, 5});
  std::erase_if(log.log.trials, [](const Trial& t) { return t.command.rfind("turn", 0) != 0; });
  for (Trial& t : log.log.trials) {
    const double sign = *t.right > 0 ? 1 : -1;
    t.left = -0.35 * sign, t.right = 0.35 * sign, t.duration_s = 1.0;
    t.X_WE = t.X_WS * driven({0.25, 5}, {"", *t.left, *t.right, 1});
  }
  EXPECT_EQ(first_name(log), "");
}

TEST(Sanity, EveryFindingHasAPhrase) {
  for (const char* name : {"axes_swapped", "unit_error", "too_few_trials", "base_on_bounds"}) {
    EXPECT_NE(finding_phrase({name, "", ""}), name);
  }
}

}  // namespace gapfarm::sanity_test
