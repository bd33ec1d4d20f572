// Names that are not worth one beside those that came after them.
#include "common/base/ranges.h"
#include "master/ground/diagnose_ground.h"
#include "master/ground/search.h"
#include "tests/unit/ground/driven_log.h"

namespace gapfarm {
namespace {

std::vector<std::string> names_in(const GroundSearch& search) {
  return mapped(search.steps,
                [&](const GroundStep& step) { return search.catalogue[step.chosen].name; });
}

// Puts a name before the others, as if it had been found first.
void name_first(const std::string& name, const GroundNames& unnamed, const WindowFitter& fitter,
                GroundSearch* search) {
  const auto found = std::ranges::find(search->catalogue, name, &GroundHypothesis::name);
  ASSERT_NE(found, search->catalogue.end());
  GroundNames names = unnamed;
  names.steps = search->steps;
  names.steps.insert(names.steps.begin(), GroundStep{});
  names.steps.front().chosen = static_cast<std::size_t>(found - search->catalogue.begin());
  names.offers = search->offers;
  names.offers.insert(names.offers.begin(), std::vector<Offer>{});
  std::vector<std::size_t> hypotheses;
  for (GroundStep& step : names.steps) {
    Eigen::VectorXd values = names.fit.values;
    const auto rows = with_freed(names.fit.rows, search->catalogue[step.chosen], &values);
    names.fit = fitter.fit(rows, {}, values);
    hypotheses.push_back(step.chosen);
    names.chain.push_back(held_out_with(fitter, *search, hypotheses, names.fit));
    step.held_out = held_out_gain(search->windows, names.chain.back(), names.chain.front(), 1);
  }
  static_cast<GroundNames&>(*search) = std::move(names);
}

TEST(Stands, OnlyWhatIsWorthItsNameBesideTheOthers) {
  const GroundRobot robot = robot_of(kDifferential);
  const RunLog log =
      driven(robot, off_by({"left", "right", "separation", "lag", "marker_x", "marker_y"},
                           {1, 1, 1.06, 0.1, 0.02, 0.01}));
  GroundQuestion question;
  question.rows = kinematic_rows(robot);
  question.catalogue = ground_hypotheses(robot);
  const auto searched = search_ground(robot, log, question, {});
  ASSERT_TRUE(searched) << searched.error().message;
  GroundSearch search = *searched;
  const std::vector<std::string> right = {"wheel_separation"};
  ASSERT_EQ(names_in(search), right);
  const WindowFitter fitter(robot, search.windows);
  GroundNames unnamed;
  unnamed.fit = fitter.fit(held_rows(question.rows), {}, {});
  unnamed.chain = {search.chain.front()};
  const WindowFit alone = search.fit;
  name_first("clock_drift", unnamed, fitter, &search);
  ASSERT_EQ(search.steps.size(), 2u);
  drop_again(fitter, {}, unnamed, &search);
  EXPECT_EQ(names_in(search), right);
  EXPECT_EQ(search.chain.size(), 2u);
  EXPECT_NEAR(search.fit.objective, alone.objective, 0.01);
  EXPECT_NEAR(search.fit.values[row_index(search.fit.rows, "separation")], 1.06, 0.01);
}

// What a car's wheels lag by is no ramp of their speed, also within a well-kept file's tolerance:
// it alone explains all that poses as good as these leave.
TEST(Stands, ALagOfDrivenWheelsIsNoRamp) {
  const GroundRobot robot = robot_of(kTricycle);
  const auto found = diagnose_ground(robot, driven(robot, off_by({"drive_lag"}, {0.03})), {});
  ASSERT_TRUE(found) << found.error().message;
  const std::vector<NamedEffect>& effects = found->diagnosis.effects;
  ASSERT_EQ(effects.size(), 1u) << found->diagnosis.headline;
  EXPECT_EQ(effects.front().name, "motor_lag");
  const Estimate& tau = effects.front().parameters.front();
  EXPECT_LT(tau.lo, 0.03);
  EXPECT_GT(tau.hi, 0.03);
}

Diagnosis diagnosed(const GroundRobot& robot, const RunLog& log) {
  auto result = diagnose_ground(robot, log, {});
  EXPECT_TRUE(result.ok()) << result.error().message;
  return result->diagnosis;
}

RunLog with_noise(RunLog log, double m, double rad) {
  Stream stream({9, Purpose::kTest, 0, 0, 0});
  for (LoggedRun& run : log.runs) {
    for (PoseRow& row : run.poses) {
      row.X_WM.x += m * stream.normal();
      row.X_WM.y += m * stream.normal();
      row.X_WM.theta += rad * stream.normal();
    }
  }
  return log;
}

// A lag that moves within its tolerance is not written, so the delay beside it is for a robot that
// has none: with this file nothing is late any more.
TEST(DiagnoseGround, TheFileGetsWhatIsRightBesideItsOtherValues) {
  const GroundRobot robot = robot_of(kDifferential);
  const RunLog log =
      with_noise(driven(robot, off_by({"delay", "lag"}, {0.15, 0.125})), 0.002, 0.004);
  const auto found = diagnose_ground(robot, log, {});
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->diagnosis.effects.size(), 1u) << found->diagnosis.headline;
  const NamedEffect& delay = found->diagnosis.effects.front();
  EXPECT_EQ(delay.name, "command_delay");
  EXPECT_LT(delay.parameters[0].lo, 0.15);  // with the lag
  EXPECT_NEAR(delay.parameters[0].value, 0.175, 0.01);
  EXPECT_EQ(found->corrected.motors.lag_s, robot.motors.lag_s);
  const Diagnosis again = diagnosed(found->corrected, log);
  EXPECT_TRUE(again.effects.empty()) << again.headline;
}

// What closes less than is tolerated, and is little, needs no name, however sure a long log is.
TEST(DiagnoseGround, NamesNothingWhileTheGapIsTolerated) {
  const GroundRobot robot = robot_of(kDifferential);
  for (const double right : {1.004, 1.006, 1.02}) {
    const RunLog log = with_noise(driven(robot, off_by({"right"}, {right})), 0.01, 0.02);
    const Diagnosis d = diagnosed(robot, log);
    EXPECT_EQ(d.effects.empty(), right < 1.02) << right << ": " << d.headline;
    EXPECT_EQ(d.verdict, right < 1.02 ? Verdict::kNone : Verdict::kEffect) << right;
    EXPECT_FALSE(d.screening.empty()) << right;
  }
}

// One value that is off by what a well-kept file may be, but explains all that is missing, is
// named, and no more of them than it takes.
TEST(DiagnoseGround, NamesWhatAloneClosesTheGap) {
  const GroundRobot robot = robot_of(kDifferential);
  const Diagnosis wheel = diagnosed(robot, driven(robot, off_by({"right"}, {1.002})));
  ASSERT_EQ(wheel.effects.size(), 1u) << wheel.headline;
  ASSERT_EQ(wheel.effects[0].parameters.size(), 1u) << wheel.headline;
  EXPECT_NEAR(wheel.effects[0].parameters[0].value, 0.002, 3e-4);
  EXPECT_EQ(wheel.verdict, Verdict::kEffect);
  const GroundRobot tricycle = robot_of(kTricycle);
  const Diagnosis marker = diagnosed(tricycle, driven(tricycle, off_by({"marker_y"}, {0.01})));
  ASSERT_EQ(marker.effects.size(), 1u) << marker.headline;
  EXPECT_EQ(marker.effects[0].name, "marker_offset");
  EXPECT_NEAR(marker.effects[0].parameters[1].value, 0.01, 1e-3);
}

}  // namespace
}  // namespace gapfarm
