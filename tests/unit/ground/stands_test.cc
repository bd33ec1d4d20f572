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
    step.before = names.chain.back();
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

}  // namespace
}  // namespace gapfarm
