#include "master/experiments/blind_check/score.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>

#include "common/trials/files.h"
#include "tests/unit/blind/worker_farm.h"

namespace gapfarm::score_test {

struct Named {
  std::string name;
  std::vector<std::string> aliases;
};

struct JudgeRow {
  const char* what;
  CaseKind kind;
  std::vector<std::string> truth;
  std::string verdict;
  std::vector<Named> named;
  bool right;
};

const std::vector<JudgeRow>& judge_rows() {
  using enum CaseKind;
  static const std::vector<JudgeRow> rows = {
      {"null called none", kNull, {}, "none", {}, true},
      {"null called unknown", kNull, {}, "unknown", {}, false},
      {"null with an effect", kNull, {}, "effect", {{"battery_sag", {}}}, false},
      {"none that names", kNull, {}, "none", {{"battery_sag", {}}}, false},
      {"outside called unknown", kOutside, {"crosstalk"}, "unknown", {}, true},
      {"outside, effect+unknown naming nothing",
       kOutside,
       {"crosstalk"},
       "effect+unknown",
       {},
       true},
      {"outside, effect+unknown naming",
       kOutside,
       {"crosstalk"},
       "effect+unknown",
       {{"backlash", {}}},
       false},
      {"outside called none", kOutside, {"crosstalk"}, "none", {}, false},
      {"single by name", kSingle, {"backlash"}, "effect", {{"backlash", {}}}, true},
      {"single, effect+unknown", kSingle, {"backlash"}, "effect+unknown", {{"backlash", {}}}, true},
      {"single by alias", kSingle, {"backlash"}, "effect", {{"motor_lag", {"backlash"}}}, true},
      {"single by third alias",
       kSingle,
       {"backlash"},
       "effect",
       {{"motor_lag", {"a", "b", "backlash"}}},
       true},
      {"single by fourth alias",
       kSingle,
       {"backlash"},
       "effect",
       {{"motor_lag", {"a", "b", "c", "backlash"}}},
       false},
      {"named itself with four aliases",
       kSingle,
       {"backlash"},
       "effect",
       {{"backlash", {"a", "b", "c", "d"}}},
       false},
      {"single called none", kSingle, {"backlash"}, "none", {}, false},
      {"single called unknown", kSingle, {"backlash"}, "unknown", {}, false},
      {"effect that names nothing", kSingle, {"backlash"}, "effect", {}, false},
      {"single, another too",
       kSingle,
       {"backlash"},
       "effect",
       {{"backlash", {}}, {"motor_lag", {}}},
       false},
      {"single, second named",
       kSingle,
       {"backlash"},
       "effect",
       {{"motor_lag", {}}, {"backlash", {}}},
       false},
      {"pair by name",
       kPair,
       {"backlash", "motor_lag"},
       "effect",
       {{"motor_lag", {}}, {"backlash", {}}},
       true},
      {"pair, one by alias",
       kPair,
       {"backlash", "motor_lag"},
       "effect",
       {{"battery_sag", {"motor_lag"}}, {"backlash", {}}},
       true},
      {"pair, one missed",
       kPair,
       {"backlash", "motor_lag"},
       "effect+unknown",
       {{"backlash", {}}},
       false},
      {"pair, one family cannot stand for both",
       kPair,
       {"backlash", "motor_lag"},
       "effect",
       {{"backlash", {"motor_lag"}}},
       false},
      {"pair and another",
       kPair,
       {"backlash", "motor_lag"},
       "effect",
       {{"backlash", {}}, {"motor_lag", {}}, {"floor_nap", {}}},
       false},
  };
  return rows;
}

Truth truth_of(const JudgeRow& row) {
  Truth truth;
  truth.id = "case001";
  truth.kind = row.kind;
  for (const std::string& name : row.truth) truth.effects.push_back({name, {}, 5});
  return truth;
}

std::string reported_text(const JudgeRow& row) {
  nlohmann::json effects = nlohmann::json::array();
  for (const Named& n : row.named) effects.push_back({{"name", n.name}, {"aliases", n.aliases}});
  return nlohmann::json{{"verdict", row.verdict}, {"effects", effects}}.dump();
}

TEST(Judge, KeepsTheRules) {
  for (const JudgeRow& row : judge_rows()) {
    const auto reported = parse_reported(reported_text(row), "diagnosis.json");
    ASSERT_TRUE(reported.ok()) << row.what;
    EXPECT_EQ(judge(truth_of(row), *reported).right, row.right) << row.what;
  }
}

// The scorer that the diagnosis is judged by elsewhere, where it can be had.
TEST(Judge, AgreesWithTheReferenceScorer) {
  const char* set = std::getenv("GAPFARM_SHARED");
  const std::filesystem::path shared =
      set ? set : std::filesystem::path(GAPFARM_SOURCE_DIR) / "../shared";
  const std::filesystem::path scorer = shared / "tools/score_diagnosis.py";
  if (!std::filesystem::exists(scorer) || std::system("python3 -c '' >/dev/null 2>&1") != 0) return;
  const TemporaryFolder folder;
  for (const JudgeRow& row : judge_rows()) {
    ASSERT_TRUE(write_file_atomically(folder / "t.json", format_truth(truth_of(row))).ok());
    ASSERT_TRUE(write_file_atomically(folder / "d.json", reported_text(row)).ok());
    const std::string command = "python3 '" + scorer.string() + "' '" + (folder / "t.json") +
                                "' '" + (folder / "d.json") + "' >/dev/null 2>&1";
    EXPECT_EQ(std::system(command.c_str()) == 0, row.right) << row.what;
  }
}

Reported reported_with(const std::string& effect, std::vector<ReportedParameter> parameters) {
  return {"effect", {{effect, {}, 1, std::move(parameters), 0.8}}};
}

TEST(Coverage, ComparesAnglesOnTheCircle) {
  constexpr double kPi = std::numbers::pi;
  Truth truth;
  truth.kind = CaseKind::kSingle;
  truth.effects = {{"floor_tilt", {{"angle", 0.05}, {"direction", -kPi + 0.1}}, 5}};
  const auto covered = [&](double lo, double hi) {
    const auto all = coverage_of(truth, reported_with("floor_tilt", {{"angle", 0.05, 0.04, 0.06},
                                                                     {"direction", 0, lo, hi}}));
    EXPECT_EQ(all.size(), 2u);
    EXPECT_TRUE(all[0].covered);
    EXPECT_TRUE(all[0].is_strength);
    EXPECT_FALSE(all[1].is_strength);
    return all[1].covered;
  };
  EXPECT_TRUE(covered(-kPi, -kPi + 0.2));
  EXPECT_TRUE(covered(kPi - 0.2, kPi + 0.2));  // the same place, a turn on
  EXPECT_FALSE(covered(kPi - 0.2, kPi));
  EXPECT_FALSE(covered(-0.2, 0.2));
}

TEST(Coverage, CountsMissingIntervalsAndSkipsWhatMeansNothing) {
  Truth truth;
  truth.kind = CaseKind::kSingle;
  truth.effects = {{"camera_seam",
                    {{"offset_x", 0.01},
                     {"offset_y", 0},
                     {"slope_x", 0},
                     {"slope_y", 0},
                     {"position", 1},
                     {"axis", 1}},
                    5}};
  auto all = coverage_of(truth, reported_with("camera_seam", {{"offset_x", 0.01, 0.0, 0.02}}));
  EXPECT_EQ(all.size(), 5u);  // no interval of a choice
  EXPECT_TRUE(all[0].covered);
  EXPECT_FALSE(all[1].covered);
  EXPECT_TRUE(std::isnan(all[1].lo));
  truth.effects = {{"floor_tilt", {{"angle", 0}, {"direction", 1}}, 1}};
  EXPECT_EQ(coverage_of(truth, reported_with("floor_tilt", {})).size(), 1u);
  EXPECT_TRUE(coverage_of(truth, reported_with("floor_nap", {})).empty());
}

// What a simulation may be off by widens the interval of a diagnosis, not that of its fit.
TEST(Coverage, CountsFitsByThemselves) {
  Truth truth;
  truth.kind = CaseKind::kSingle;
  truth.effects = {{"motor_asymmetry", {{"ratio", 0.06}}, 5}};
  const auto of = [&](double sd) {
    return coverage_of(truth,
                       reported_with("motor_asymmetry", {{"ratio", 0.05, 0.03, 0.07, sd, 0.004}}))
        .front();
  };
  EXPECT_EQ(of(0.005).covered_by_fit, false);
  EXPECT_NEAR(*of(0.005).fit_over_bound, 1.25, 1e-12);
  EXPECT_EQ(of(0.0062).covered_by_fit, true);
  EXPECT_FALSE(of(std::nan("")).covered_by_fit);
}

TEST(MissedBelow, IsWhatTheLogCouldNotShow) {
  const Reported none = *parse_reported(R"({"verdict": "none", "screening": [
          {"effect": "floor_tilt", "detectable_from": {"angle": 0.02}}, {"effect": "backlash"}]})",
                                        "d");
  Truth truth;
  truth.kind = CaseKind::kSingle;
  truth.effects = {{"floor_tilt", {{"angle", 0.01}, {"direction", 1}}, 5}};
  EXPECT_EQ(missed_below(truth, none), true);
  truth.effects[0].parameters["angle"] = 0.03;
  EXPECT_EQ(missed_below(truth, none), false);
  EXPECT_EQ(missed_below(truth, reported_with("floor_tilt", {})), std::nullopt);
  truth.effects = {{"backlash", {{"travel", 1}}, 5}};
  EXPECT_EQ(missed_below(truth, none), std::nullopt);  // of which nothing is known
}

TEST(Wilson, MatchesTheClosedForm) {
  const Interval half = wilson_interval({50, 100});
  EXPECT_NEAR(half.lower, 0.4038, 1e-4);
  EXPECT_NEAR(half.upper, 0.5962, 1e-4);
  const Interval all = wilson_interval({60, 60});
  EXPECT_NEAR(all.lower, 60 / (60 + 1.959964 * 1.959964), 1e-9);
  EXPECT_EQ(all.upper, 1);
  EXPECT_EQ(wilson_interval({0, 10}).lower, 0);
  EXPECT_EQ(wilson_interval({}).upper, 1);
}

TEST(Reported, NamesWhatIsWrong) {
  EXPECT_FALSE(parse_reported("[]", "d").ok());
  EXPECT_FALSE(parse_reported(R"({"verdict": "maybe"})", "d").ok());
  EXPECT_FALSE(parse_reported(R"({"verdict": "effect", "effects": [{}]})", "d").ok());
  const auto reported = parse_reported(R"({"verdict": "effect", "effects": [{"name": "backlash",
      "parameters": {"travel": {"value": 1, "lo": 0, "hi": 2}, "odd": {"value": "x"}}}]})",
                                       "d");
  ASSERT_TRUE(reported.ok());
  EXPECT_EQ(reported->effects[0].parameters.size(), 1u);
  EXPECT_TRUE(std::isnan(promised_shrinkage(*reported)));
}

TEST(Truths, ReadBackToTheBit) {
  Truth truth;
  truth.id = "case007";
  truth.kind = CaseKind::kOutside;
  truth.level = "clear";
  truth.effects = {{"camera_seam", {{"axis", 1}, {"offset_x", 0.1 + 0.2}}, 4.999}};
  truth.excluded = "camera_seam";
  truth.robot = {{"mass", 1.0 / 3}};
  truth.seed = ~std::uint64_t{0};
  const auto back = parse_truth(format_truth(truth), "t", "");
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(format_truth(*back), format_truth(truth));
  EXPECT_EQ(back->effects[0].parameters.at("offset_x"), 0.1 + 0.2);
}

TEST(Truths, OfOthersMayUseText) {
  const auto truth = parse_truth(
      R"({"effects": {"camera_seam": {"axis": "y", "offset_x": 0.1}}, "answer": "effect"})", "t",
      "case3");
  ASSERT_TRUE(truth.ok());
  EXPECT_EQ(truth->id, "case3");
  EXPECT_EQ(truth->kind, CaseKind::kSingle);
  EXPECT_EQ(truth->effects[0].parameters.at("axis"), 1);
  EXPECT_FALSE(parse_truth(R"({"effects": {}, "answer": "effect"})", "t", "").ok());
  EXPECT_FALSE(parse_truth(R"({"effects": [], "answer": "none"})", "t", "").ok());
}

}  // namespace gapfarm::score_test
