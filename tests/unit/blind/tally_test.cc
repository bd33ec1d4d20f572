#include "master/experiments/blind_check/tally.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace gapfarm::tally_test {

using ::testing::HasSubstr;

Truth truth_of(const std::string& id, CaseKind kind, std::vector<std::string> effects) {
  Truth truth;
  truth.id = id;
  truth.kind = kind;
  truth.level = kind == CaseKind::kNull ? "" : "clear";
  for (const std::string& name : effects) truth.effects.push_back({name, {}, 5});
  return truth;
}

Diagnosis with_verdict(Verdict verdict) {
  Diagnosis diagnosis;
  diagnosis.verdict = verdict;
  return diagnosis;
}

Diagnosis naming(const std::string& name) {
  Diagnosis diagnosis = with_verdict(Verdict::kEffect);
  NamedEffect& effect = diagnosis.effects.emplace_back();
  effect.name = name;
  effect.aliases = {"motor_lag"};
  effect.parameters = {{"travel", 1, 0.5, 1.5, "rad"}};
  effect.closed = 0.9;
  return diagnosis;
}

std::vector<ScoredCase> some_cases() {
  std::vector<ScoredCase> cases;
  Truth single = truth_of("case001", CaseKind::kSingle, {"backlash"});
  single.effects[0].parameters["travel"] = 1.2;
  cases.push_back(score_case(single, {}, naming("backlash")));
  cases.back().realised = 0.85;
  cases.push_back(
      score_case(truth_of("case002", CaseKind::kSingle, {"motor_lag"}), {}, naming("backlash")));
  cases.back().realised = 0.5;
  cases.push_back(
      score_case(truth_of("case003", CaseKind::kNull, {}), {}, with_verdict(Verdict::kNone)));
  cases.push_back(score_case(truth_of("case004", CaseKind::kNull, {}), {}, naming("backlash")));
  cases.push_back(score_case(truth_of("case005", CaseKind::kOutside, {"crosstalk"}), {},
                             with_verdict(Verdict::kUnknown)));
  ChildEnd crash{ChildState::kCrashed, 11, 1, "was killed by signal 11"};
  cases.push_back(score_case(truth_of("case006", CaseKind::kSingle, {"backlash"}), crash, {}));
  ScoredCase foreign =
      score_case(truth_of("case007", CaseKind::kNull, {}), {}, with_verdict(Verdict::kNone));
  foreign.has_truth = false;
  cases.push_back(foreign);
  return cases;
}

TEST(Tally, CountsEveryCaseOnce) {
  const Tally sum = tally(some_cases());
  EXPECT_EQ(sum.right.total, 6u);
  EXPECT_EQ(sum.right.hits, 4u);
  EXPECT_EQ(sum.failed.hits, 1u);
  EXPECT_EQ(sum.null_none.hits, 1u);
  EXPECT_EQ(sum.false_alarms.hits, 1u);
  EXPECT_EQ(sum.outside_unknown.hits, 1u);
  EXPECT_EQ(sum.singles_right.at("clear").hits, 2u);
  EXPECT_EQ(sum.singles_right.at("clear").total, 3u);
  EXPECT_EQ(sum.singles_first.at("clear").hits, 1u);
  EXPECT_EQ(sum.covered.hits, 1u);
  EXPECT_EQ(sum.covered.total, 1u);
  EXPECT_EQ(sum.strengths_covered.total, 1u);
  EXPECT_EQ(sum.places_covered.total, 0u);
  EXPECT_EQ(sum.promise_kept.hits, 1u);
  EXPECT_EQ(sum.promise_kept.total, 2u);
  EXPECT_EQ(sum.confusion.at("backlash").at("failed"), 1u);
  EXPECT_EQ(sum.confusion.at("motor_lag").at("backlash"), 1u);
  EXPECT_EQ(sum.confusion.at("outside").at("unknown"), 1u);
}

TEST(Tally, HalfIsClosedByTheModelAsItIsUsed) {
  EXPECT_TRUE(*closes_half({1.0, 1.6, 2.0, std::nullopt}));
  EXPECT_FALSE(*closes_half({1.0, 1.4, 2.0, std::nullopt}));
  EXPECT_TRUE(*closes_half({1.0, 1.0, 2.0, 1.7}));
  EXPECT_FALSE(*closes_half({1.0, 1.7, 2.0, 1.2}));
  EXPECT_FALSE(closes_half({1.0, 1.0, 1.001, std::nullopt}).has_value());

  Truth truth = truth_of("case001", CaseKind::kOutside, {"backlash"});
  truth.excluded = "backlash";
  ScoredCase c = score_case(truth, {}, with_verdict(Verdict::kUnknown));
  EXPECT_EQ(tally({c}).outside_closed.total, 0u);
  c.fresh = FreshScores{1.0, 1.0, 2.0, 1.7};
  EXPECT_EQ(tally({c}).outside_closed.hits, 1u);
  EXPECT_EQ(tally({c}).outside_closed.total, 1u);
}

TEST(Tally, ShrinkageNeedsAGap) {
  EXPECT_NEAR(*realised_shrinkage({1.0, 1.8, 2.0, {}}), 0.8, 1e-12);
  EXPECT_FALSE(realised_shrinkage({1.0, 1.0, 1.001, {}}).has_value());
  EXPECT_FALSE(realised_shrinkage({1.0, 0.5, 0.9, {}}).has_value());
}

TEST(Tables, HoldRatesAndCases) {
  const BlindReport report{{{"seed", "7"}}, some_cases(), {{"backlash", "clear", 2.5}}};
  const auto json = nlohmann::json::parse(format_blind_json(report));
  EXPECT_EQ(json["cases"].size(), 7u);
  EXPECT_EQ(json["rates"]["failed"]["hits"], 1);
  EXPECT_EQ(json["confusion"]["none"]["backlash"], 1);
  EXPECT_EQ(json["cases"][5]["outcome"], "crashed");
  EXPECT_FALSE(json["cases"][6].contains("truth"));
  const std::string markdown = format_blind_markdown(report);
  EXPECT_THAT(markdown, HasSubstr("| backlash | clear | 2.5 |"));
  EXPECT_THAT(markdown, HasSubstr("| nulls called none | >= 95 % | 50 % [9, 91] | 1/2 |"));
  EXPECT_THAT(format_blind_summary(report),
              HasSubstr("WRONG case004: null; reported effect backlash"));
}

}  // namespace gapfarm::tally_test
