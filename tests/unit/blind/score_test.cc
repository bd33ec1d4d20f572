#include <gtest/gtest.h>
#include <stdlib.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "common/trials/files.h"
#include "master/diagnose/result/diagnosis_json.h"
#include "master/experiments/blind_check/blind_check.h"
#include "master/experiments/blind_check/tally.h"
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

Diagnosis reported_of(const JudgeRow& row) {
  Diagnosis diagnosis;
  for (const Verdict verdict :
       {Verdict::kEffect, Verdict::kNone, Verdict::kUnknown, Verdict::kEffectAndUnknown}) {
    if (row.verdict == verdict_name(verdict)) diagnosis.verdict = verdict;
  }
  for (const Named& n : row.named) {
    diagnosis.effects.emplace_back().name = n.name;
    diagnosis.effects.back().aliases = n.aliases;
  }
  return diagnosis;
}

TEST(Judge, KeepsTheRules) {
  for (const JudgeRow& row : judge_rows()) {
    EXPECT_EQ(judge(truth_of(row), reported_of(row)).right, row.right) << row.what;
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
    ASSERT_TRUE(write_file_atomically(folder / "d.json", to_json(reported_of(row))).ok());
    const std::string command = "python3 '" + scorer.string() + "' '" + (folder / "t.json") +
                                "' '" + (folder / "d.json") + "' >/dev/null 2>&1";
    EXPECT_EQ(std::system(command.c_str()) == 0, row.right) << row.what;
  }
}

Diagnosis reported_with(const std::string& effect, std::vector<Estimate> parameters) {
  Diagnosis diagnosis;
  diagnosis.verdict = Verdict::kEffect;
  diagnosis.effects.emplace_back().name = effect;
  diagnosis.effects.back().parameters = std::move(parameters);
  return diagnosis;
}

TEST(Coverage, ComparesAnglesOnTheCircle) {
  constexpr double kPi = std::numbers::pi;
  Truth truth;
  truth.kind = CaseKind::kSingle;
  truth.effects = {{"floor_tilt", {{"angle", 0.05}, {"direction", -kPi + 0.1}}, 5}};
  const auto covered = [&](double lo, double hi) {
    const auto all =
        coverage_of(truth, reported_with("floor_tilt", {{"angle", 0.05, 0.04, 0.06, "rad"},
                                                        {"direction", 0, lo, hi, "rad"}}));
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
  auto all = coverage_of(truth, reported_with("camera_seam", {{"offset_x", 0.01, 0.0, 0.02, "m"}}));
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
    return coverage_of(truth, reported_with("motor_asymmetry",
                                            {{"ratio", 0.05, 0.03, 0.07, "", 0.004, {}, sd}}))
        .front();
  };
  EXPECT_EQ(of(0.005).covered_by_fit, false);
  EXPECT_NEAR(*of(0.005).fit_over_bound, 1.25, 1e-12);
  EXPECT_EQ(of(0.0062).covered_by_fit, true);
  EXPECT_FALSE(of(std::nan("")).covered_by_fit);
}

TEST(MissedBelow, IsWhatTheLogCouldNotShow) {
  Diagnosis none;
  none.screening.resize(2);
  none.screening[0].effect = "floor_tilt";
  none.screening[0].detectable_from = {{"angle", 0.02}};
  none.screening[1].effect = "backlash";
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

TEST(Reported, AnUnusableLogOrFileIsAFailedCase) {
  const TemporaryFolder folder;
  Diagnosis diagnosis;
  const auto reported = [&](const std::string& text) {
    EXPECT_TRUE(write_file_atomically(folder / "diagnosis.json", text).ok());
    ChildEnd end;
    const bool is_read = read_reported(folder / "", end).has_value();
    EXPECT_EQ(is_read, end.text.empty());
    return end.text;
  };
  EXPECT_EQ(reported(to_json(diagnosis)), "");
  EXPECT_NE(reported(R"({"version": 1, "verdict": "maybe"})").find("maybe"), std::string::npos);
  diagnosis.verdict = Verdict::kUnusable;
  EXPECT_NE(reported(to_json(diagnosis)).find("unusable"), std::string::npos);
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
