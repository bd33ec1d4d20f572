// Effects, logs and sizes, driven by the planar engine.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <cmath>
#include <filesystem>

#include "common/effects/catalogue.h"
#include "common/trials/files.h"
#include "common/trials/read.h"
#include "tests/planar/planar_engine.h"
#include "tests/truths/cases.h"

namespace gapfarm::truths {
namespace {

const Noise kNoise = {0.012, 0.01, 0.0015, 0.008};
constexpr PlanSize kSmall = {2, 12, 4, 2};

Cause caused(const std::string& effect, const Values& values) {
  return {&effect_row(effect), values};
}

TrialLog log_of(const std::vector<Cause>& causes, const Noise& noise = {}, std::uint64_t seed = 3) {
  return drive_log(planar_engine(), {}, draw_plan(kSmall, seed), causes, noise, seed);
}

TEST(Truths, EveryEffectOfTheCatalogueIsThereWithItsParameters) {
  for (const Effect& effect : srv1_effects()) {
    const EffectRow& row = effect_row(effect.name);
    EXPECT_TRUE(row.in_catalogue);
    const Values values = row.draw(0.5, 2, Stream({1}));
    EXPECT_EQ(values.size(), effect.parameters.size()) << effect.name;
    for (const Parameter& p : effect.parameters) {
      ASSERT_TRUE(values.contains(p.key)) << effect.name << " " << p.key;
      EXPECT_GE(values.at(p.key), p.lower) << effect.name << " " << p.key;
      const double upper = p.choices.empty() ? p.upper : 1;
      EXPECT_LE(values.at(p.key), upper) << effect.name << " " << p.key;
    }
  }
}

TEST(Truths, StrengthAloneChangesWithStrength) {
  for (const EffectRow& row : effect_rows()) {
    EXPECT_EQ(row.draw(0.2, 2, Stream({7})), row.draw(0.2, 2, Stream({7}))) << row.name;
    EXPECT_NE(row.draw(0.2, 2, Stream({7})), row.draw(0.4, 2, Stream({7}))) << row.name;
  }
  const Values weak = effect_row("friction_patch").draw(0.2, 2, Stream({7}));
  const Values strong = effect_row("friction_patch").draw(0.4, 2, Stream({7}));
  EXPECT_EQ(weak.at("x"), strong.at("x"));
  EXPECT_EQ(weak.at("radius"), strong.at("radius"));
}

TEST(Truths, ASeedIsALog) {
  const Cause slips = caused("slip_events", {{"probability", 0.3}, {"loss", 0.8}});
  EXPECT_EQ(format_trials(log_of({slips}, kNoise)), format_trials(log_of({slips}, kNoise)));
  EXPECT_NE(format_trials(log_of({slips}, kNoise)), format_trials(log_of({slips}, kNoise, 4)));
}

TEST(Truths, APartOfAPlanMeetsTheSameLuck) {
  const auto plan = draw_plan(kSmall, 3);
  const std::vector<PlannedDrive> chain(plan.begin() + 8, plan.begin() + 12);
  const Cause slips = caused("slip_events", {{"probability", 0.5}, {"loss", 0.8}});
  const TrialLog all = drive_log(planar_engine(), {}, plan, {slips}, kNoise, 3);
  const TrialLog part = drive_log(planar_engine(), {}, chain, {slips}, kNoise, 3);
  for (std::size_t i = 0; i < chain.size(); ++i) {
    EXPECT_EQ(part.trials[i].X_WE, all.trials[8 + i].X_WE);
  }
}

TEST(Truths, WithoutNoiseADriveStartsWhereTheOneBeforeEnded) {
  const TrialLog log = log_of({});
  for (std::size_t i = 1; i < log.trials.size(); ++i) {
    if (log.trials[i].trial % 4 == 0) continue;
    EXPECT_EQ(log.trials[i].X_WS, log.trials[i - 1].X_WE);
  }
}

TEST(Truths, CamerasMoveWhatIsLoggedAndNotTheRobot) {
  const TrialLog plain = log_of({});
  const TrialLog turned = log_of({caused("heading_offset", {{"angle", 0.1}})});
  const TrialLog stretched = log_of({caused("camera_aspect", {{"ratio", 1.21}})});
  const TrialLog marked = log_of({caused("marker_offset", {{"x", 0.02}, {"y", 0}})});
  for (std::size_t i = 0; i < plain.trials.size(); ++i) {
    const Pose& X = plain.trials[i].X_WE;
    EXPECT_NEAR(wrap_angle(turned.trials[i].X_WE.theta - X.theta), 0.1, 1e-12);
    EXPECT_EQ(turned.trials[i].X_WE.x, X.x);
    EXPECT_NEAR(stretched.trials[i].X_WE.y, 1.1 * X.y, 1e-12);
    EXPECT_NEAR(stretched.trials[i].X_WE.x, X.x / 1.1, 1e-12);
    EXPECT_NEAR(std::hypot(marked.trials[i].X_WE.x - X.x, marked.trials[i].X_WE.y - X.y), 0.02,
                1e-12);
  }
}

TEST(Truths, BacklashTakesWayFromReversalsAlone) {
  const auto plan = draw_plan(kSmall, 3);
  const TrialLog plain = log_of({});
  const TrialLog loose = log_of({caused("backlash", {{"travel", 0.01}})});
  for (std::size_t i = 0; i < plan.size(); ++i) {
    const bool reversed =
        !plan[i].commanded.moved && (plan[i].left * plan[i].commanded.last_left < 0 ||
                                     plan[i].right * plan[i].commanded.last_right < 0);
    const Pose a = between(plain.trials[i].X_WS, plain.trials[i].X_WE);
    const Pose b = between(loose.trials[i].X_WS, loose.trials[i].X_WE);
    const double differ = (Eigen::Vector3d(a.x - b.x, a.y - b.y, a.theta - b.theta)).norm();
    EXPECT_EQ(differ > 1e-3, reversed) << i;
    EXPECT_EQ(differ > 1e-9, reversed) << i;
  }
}

TEST(Truths, AStaleReadingIsAPoseOfThePath) {
  const TrialLog plain = log_of({});
  const TrialLog stale = log_of({caused("pose_latency", {{"share", 1}, {"latency", 0.3}})});
  for (std::size_t i = 0; i < plain.trials.size(); ++i) {
    EXPECT_EQ(stale.trials[i].X_WS, plain.trials[i].X_WS);
    EXPECT_NE(stale.trials[i].X_WE, plain.trials[i].X_WE);
  }
}

TEST(Truths, AnEffectIsMadeAsLargeAsWanted) {
  const auto plan = draw_plan({3, 24, 4, 2}, 3);
  const Baseline baseline(planar_engine(), {}, plan, kNoise);
  EXPECT_NEAR(baseline.size_of({}, 3), 1, 1e-6);
  for (const char* name : {"motor_asymmetry", "camera_seam"}) {
    const Sized sized = sized_cause(baseline, effect_row(name), 5, 2, 3);
    EXPECT_TRUE(sized.reached) << name;
    EXPECT_NEAR(sized.size, 5, 0.1) << name;
  }
  // Motors that brake as slowly as they start end where others do.
  EXPECT_FALSE(sized_cause(baseline, effect_row("motor_lag"), 5, 2, 3).reached);
}

TEST(Truths, CasesAreWrittenWithTheirTruths) {
  char name[] = "/tmp/gapfarm_truths_XXXXXX";
  ASSERT_NE(mkdtemp(name), nullptr);
  CaseSettings settings;
  settings.counts = {1, 1, 0, 1};
  settings.plan = {3, 8, 4, 2};
  settings.effects = {"heading_offset", "camera_shear"};
  settings.out = name;
  const Result<Made> made = make_cases(planar_engine(), settings);
  ASSERT_TRUE(made.ok());
  EXPECT_EQ(made->cases, 3u);
  const char* const expected[] = {"\"none\"", "\"effect\"", "\"unknown\""};
  for (int i = 0; i < 3; ++i) {
    const std::string id = "case00" + std::to_string(i + 1);
    EXPECT_TRUE(std::filesystem::exists(settings.out + "/cases/" + id + "/trials.csv"));
    const auto truth = read_text_file(settings.out + "/truth/" + id + ".json");
    ASSERT_TRUE(truth.ok());
    EXPECT_NE(truth->find(expected[i]), std::string::npos) << *truth;
  }
  std::filesystem::remove_all(name);
}

}  // namespace
}  // namespace gapfarm::truths
