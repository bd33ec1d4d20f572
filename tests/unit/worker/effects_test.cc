#include <gtest/gtest.h>

#include <cctype>
#include <cmath>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "common/effects/catalogue.h"
#include "common/parameters/table.h"
#include "common/random/stream.h"
#include "worker/effects/behaviour.h"

namespace gapfarm::effects_test {

const std::vector<std::span<const Effect>>& catalogues() {
  static const std::vector<std::span<const Effect>> all = {srv1_effects(), push_effects()};
  return all;
}

const auto kBehaviours = {drive_effects(), floor_effects(), camera_effects()};

const EffectBehaviour* behaviour_of(const std::string& name) {
  const EffectBehaviour* found = nullptr;
  for (const auto rows : kBehaviours) {
    for (const EffectBehaviour& b : rows) {
      if (b.name != name) continue;
      EXPECT_EQ(found, nullptr) << name << " is implemented twice";
      found = &b;
    }
  }
  return found;
}

TEST(EffectTable, HasOneImplementationForEveryEffectAndNoOther) {
  std::set<std::string> names;
  for (const auto& catalogue : catalogues()) {
    for (const Effect& effect : catalogue) {
      EXPECT_NE(behaviour_of(effect.name), nullptr) << effect.name;
      names.insert(effect.name);
    }
  }
  std::size_t rows = 0;
  for (const auto of_a_kind : kBehaviours) rows += of_a_kind.size();
  EXPECT_EQ(rows, names.size());
}

TEST(EffectTable, EffectsOfOneNameHaveTheSameParameters) {
  for (const Effect& a : srv1_effects()) {
    for (const Effect& b : push_effects()) {
      if (a.name != b.name) continue;
      EXPECT_EQ(a.strengths, b.strengths) << a.name;
      ASSERT_EQ(a.parameters.size(), b.parameters.size()) << a.name;
      for (std::size_t i = 0; i < a.parameters.size(); ++i) {
        EXPECT_EQ(a.parameters[i].key, b.parameters[i].key) << a.name;
        EXPECT_EQ(a.parameters[i].unit, b.parameters[i].unit) << a.name;
      }
    }
  }
}

// "floor_tilt" is tested by EffectSignature.FloorTilt...
TEST(EffectTable, EveryRowHasATestOfItsSignature) {
  std::set<std::string> names;
  const ::testing::UnitTest& all = *::testing::UnitTest::GetInstance();
  for (int s = 0; s < all.total_test_suite_count(); ++s) {
    const ::testing::TestSuite& suite = *all.GetTestSuite(s);
    if (std::string(suite.name()) != "EffectSignature") continue;
    for (int t = 0; t < suite.total_test_count(); ++t) names.insert(suite.GetTestInfo(t)->name());
  }
  for (const Effect& effect : srv1_effects()) {
    std::string camel;
    for (std::size_t i = 0; i < effect.name.size(); ++i) {
      const char c = effect.name[i];
      if (c == '_') continue;
      const bool first = i == 0 || effect.name[i - 1] == '_';
      camel += first ? static_cast<char>(std::toupper(c)) : c;
    }
    const auto at = names.lower_bound(camel);
    EXPECT_TRUE(at != names.end() && at->rfind(camel, 0) == 0) << effect.name;
  }
}

TEST(EffectTable, HooksBelongToTheEffectsStage) {
  for (const auto& catalogue : catalogues()) {
    for (const Effect& effect : catalogue) {
      const EffectBehaviour& b = *behaviour_of(effect.name);
      const bool camera = b.observe || b.reading || b.place || b.start_turns;
      EXPECT_EQ(camera, effect.stage == EffectStage::kCamera) << b.name;
      if (b.drive || b.branches || b.session_spread) {
        EXPECT_EQ(effect.stage, EffectStage::kDrive) << b.name;
      }
      if (b.floor || b.settings) {
        EXPECT_EQ(effect.stage, EffectStage::kFloor) << b.name;
      }
      EXPECT_TRUE(camera || b.drive || b.branches || b.floor || b.settings || b.push ||
                  b.session_spread)
          << b.name;
      EXPECT_EQ(b.observe != nullptr, b.recover != nullptr) << b.name;
      EXPECT_EQ(b.place != nullptr, b.unplace != nullptr) << b.name;
      EXPECT_EQ(b.branches != nullptr, b.draw != nullptr) << b.name;
      EXPECT_EQ(b.start_turns != nullptr, b.draw_start_turn != nullptr) << b.name;
    }
  }
}

TEST(EffectCatalogue, NeutralValuesLieWithinTheirBounds) {
  for (const Parameter& row : srv1_table().rows()) {
    EXPECT_LE(row.lower, row.nominal) << row.key;
    EXPECT_GE(row.upper, row.nominal) << row.key;
    EXPECT_FALSE(row.summary.empty()) << row.key;
  }
}

TEST(EffectCatalogue, StrengthsAloneDecideWhetherAnEffectIsNeutral) {
  const ParameterTable& table = srv1_table();
  for (std::size_t e = 0; e < table.effects().size(); ++e) {
    const Effect& effect = table.effects()[e];
    ParameterValues values = table.nominal();
    for (std::size_t i = effect.strengths; i < effect.parameters.size(); ++i) {
      values[table.effect_row(e) + i] = effect.parameters[i].upper;
    }
    EXPECT_FALSE(ActiveEffects(table, values).any()) << effect.name;
    values[table.effect_row(e)] = effect.parameters[0].upper;
    EXPECT_TRUE(ActiveEffects(table, values).any()) << effect.name;
  }
}

TEST(DriveEffects, BranchesAreADistributionWithTheDrawsMean) {
  ParameterValues values = srv1_table().nominal();
  values[srv1_table().row("slip_events.probability")] = 0.2;
  values[srv1_table().row("slip_events.loss")] = 0.6;
  const ActiveEffects effects(srv1_table(), values);
  double weight = 0, left = 0, right = 0;
  for (const DriveBranch& b : effects.branches()) {
    weight += b.weight;
    left += b.weight * b.left_gain;
    right += b.weight * b.right_gain;
  }
  EXPECT_NEAR(weight, 1, 1e-12);
  EXPECT_NEAR(left, 1 - 0.2 * 0.3, 1e-12);
  EXPECT_NEAR(right, left, 1e-12);
  Stream stream({1, Purpose::kTest, 0, 0, 0});
  double drawn = 0;
  constexpr int n = 100000;
  for (int i = 0; i < n; ++i) drawn += effects.draw(stream).left_gain / n;
  EXPECT_NEAR(drawn, left, 5 * 0.17 / std::sqrt(n));
}

TEST(DriveEffects, ActOnTheDriveAsTheCatalogueReports) {
  ParameterValues values = srv1_table().nominal();
  const auto set = [&](const char* key, double v) { values[srv1_table().row(key)] = v; };
  set("motor_asymmetry.ratio", 0.04);
  set("motor_deadband.duty", 0.1);
  set("motor_lag.tau", 0.05);
  set("timing_offset.offset", 0.03);
  set("battery_sag.rate", 0.01);
  set("backlash.travel", 0.004);
  Situation situation;
  situation.session_time_s = 120;
  situation.last_left = -1;
  situation.last_right = 1;
  DriveState drive;
  drive.left.duty = 0.5;
  drive.right.duty = 0.05;
  drive.duration_s = 1;
  ActiveEffects(srv1_table(), values).drive(situation, drive);
  EXPECT_NEAR(drive.right.gain / drive.left.gain, 1.04, 1e-12);
  EXPECT_NEAR((drive.right.gain + drive.left.gain) / 2, 0.98, 1e-12);  // two minutes of sag
  EXPECT_NEAR(drive.left.duty, 0.4, 1e-12);
  EXPECT_EQ(drive.right.duty, 0);
  EXPECT_NEAR(drive.left.lag_s, 0.05, 1e-12);
  EXPECT_NEAR(drive.duration_s, 1.03, 1e-12);
  EXPECT_NEAR(drive.left.dead_travel_m, 0.004, 1e-12);  // it reversed
  EXPECT_EQ(drive.right.dead_travel_m, 0);
}

}  // namespace gapfarm::effects_test
