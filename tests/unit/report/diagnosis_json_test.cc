#include "master/diagnose/result/diagnosis_json.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "common/json/fields.h"
#include "tests/unit/report/example_diagnosis.h"

namespace gapfarm::diagnosis_json_test {

using ::testing::HasSubstr;
using Json = nlohmann::ordered_json;

TEST(DiagnosisJson, ReadsBackToTheSameBits) {
  for (const Diagnosis& d : {example_diagnosis(), null_diagnosis(), Diagnosis{}}) {
    const std::string text = to_json(d);
    const auto back = parse_diagnosis(text);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(to_json(*back), text);
    ASSERT_EQ(back->trials.size(), d.trials.size());
    for (std::size_t i = 0; i < d.trials.size(); ++i) {
      EXPECT_EQ(back->trials[i].X_WS, d.trials[i].X_WS);
      EXPECT_EQ(back->trials[i].tuned_cov, d.trials[i].tuned_cov);
      EXPECT_EQ(back->trials[i].final_residual, d.trials[i].final_residual);
    }
  }
}

TEST(DiagnosisJson, HasTheDocumentedFields) {
  const Json json = Json::parse(to_json(example_diagnosis()));
  EXPECT_EQ(json["version"], 1);
  EXPECT_EQ(json["verdict"], "effect+unknown");
  const Json& effect = json["effects"][0];
  EXPECT_EQ(effect["name"], "battery_sag");
  EXPECT_TRUE(effect["aliases"].is_array());
  EXPECT_EQ(effect["parameters"]["rate"]["unit"], "1/min");
  for (const char* key :
       {"confidence", "gap_before", "gap_after", "closed", "closed_lo", "closed_hi"}) {
    EXPECT_TRUE(effect[key].is_number()) << key;
  }
  EXPECT_EQ(json["gap"]["unit"], "nats/trial");
  EXPECT_EQ(json["gap"]["tuned"], 1.31);
  EXPECT_EQ(json["gap"]["position_mm"]["final"], 3.4);
  EXPECT_EQ(json["gap"]["heading_mrad"]["floor"], 11.0);
  for (const char* key : {"command", "component", "kind", "covariate", "share", "p", "text"}) {
    EXPECT_TRUE(json["where"][0].contains(key)) << key;
  }
  EXPECT_EQ(json["next_experiment"][0]["separates"], Json({"floor_tilt", "floor_nap"}));
}

TEST(DiagnosisJson, ListsSessionsWithTheirGains) {
  Diagnosis d = example_diagnosis();
  d.effects[0].name = "session_gain";
  d.effects[0].sessions = {{0.031, 0.026, 0.036, "monday"}, {-0.02, -0.024, -0.016, "friday"}};
  const std::string text = to_json(d);
  const Json effects = Json::parse(text)["effects"];
  ASSERT_EQ(effects[0]["sessions"].size(), 2u);
  EXPECT_EQ(effects[0]["sessions"][1],
            Json({{"session", "friday"}, {"gain", -0.02}, {"lo", -0.024}, {"hi", -0.016}}));
  EXPECT_FALSE(effects[1].contains("sessions"));
  EXPECT_EQ(to_json(parse_diagnosis(text).value()), text);
}

TEST(DiagnosisJson, KeepsWhatIsNotANumberOut) {
  Diagnosis d = null_diagnosis();
  d.gap.floor = std::numeric_limits<double>::quiet_NaN();
  d.trials[0].tuned_score = std::numeric_limits<double>::infinity();
  const std::string text = to_json(d);
  EXPECT_THAT(text, HasSubstr("\"floor\": null"));
  const auto back = parse_diagnosis(text);
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_TRUE(std::isnan(back->gap.floor));
  EXPECT_TRUE(std::isnan(back->trials[0].tuned_score));
}

TEST(DiagnosisJson, ReadsWhatFormatsAsksForAndNoMore) {
  const auto back = parse_diagnosis(R"({"version": 1, "verdict": "unknown", "effects": [],
      "gap": {"unit": "nats/trial", "tuned": 0.4, "final": 0.4, "floor": 0},
      "where": [], "next_experiment": [{"text": "more", "separates": []}], "later": 7})");
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(back->verdict, Verdict::kUnknown);
  EXPECT_EQ(back->gap.tuned, 0.4);
  EXPECT_EQ(back->next.at(0).text, "more");
}

// Every error names the field and what was found.
TEST(DiagnosisJson, ReportsWhatIsWrong) {
  const auto error_of = [](const std::string& pointer, const Json& value) {
    Json json = Json::parse(to_json(example_diagnosis()));
    json[Json::json_pointer(pointer)] = value;
    const auto back = parse_diagnosis(json.dump());
    return back.ok() ? std::string("read without an error") : back.error().message;
  };
  EXPECT_THAT(error_of("/version", 2), HasSubstr("version is 2"));
  EXPECT_THAT(error_of("/verdict", "maybe"), HasSubstr("\"maybe\""));
  EXPECT_THAT(error_of("/effects/1/closed", "most"), HasSubstr("effects[1].closed is \"most\""));
  EXPECT_THAT(error_of("/effects/0/parameters/rate", 3), HasSubstr("effects[0].parameters.rate"));
  EXPECT_THAT(error_of("/gap", Json::array()), HasSubstr("gap"));
  EXPECT_THAT(error_of("/gap/position_mm/tuned", true), HasSubstr("gap.position_mm.tuned"));
  EXPECT_THAT(error_of("/where/0", "x"), HasSubstr("where[0]"));
  EXPECT_THAT(error_of("/cautions", "careful"), HasSubstr("cautions"));
  EXPECT_THAT(error_of("/trials/rows/5/0", 5), HasSubstr("trials.rows[5].session is 5"));
  EXPECT_THAT(error_of("/trials/rows/2", 5), HasSubstr("trials.rows[2]"));
  EXPECT_THAT(error_of("/trials/columns/0", "run"), HasSubstr("trials.columns"));
  EXPECT_FALSE(parse_diagnosis("{\"version\": 1").ok());
  EXPECT_FALSE(parse_diagnosis("[]").ok());
  EXPECT_FALSE(parse_diagnosis("").ok());
}

ResidualTerm shape_over_the_floor() {
  ResidualTerm term;
  term.frame = ResidualFrame::kMotion;
  term.covariates = {0, 1};
  term.lengths = {0.5, 0.25};
  term.centres = Eigen::MatrixXd::Constant(2, 2, 1.0 / 3);
  term.weights = {{"forward", Eigen::MatrixXd::Constant(2, 3, 0.1)},
                  {"turn_cw", Eigen::MatrixXd::Constant(2, 3, -0.2)}};
  return term;
}

TEST(DiagnosisJson, KeepsTheShapeOfWhatHasNoName) {
  Diagnosis d;
  d.residual = FoundResidual{{{shape_over_the_floor()},
                              OutlierDrives{OutlierKind::kShifted, 0.1, 0.02, 0.03, 0, 0.5, 0, 0}},
                             0.4,
                             0.3,
                             0.5,
                             0.7,
                             0.3,
                             0.6,
                             0.5,
                             0.7,
                             "so",
                             {0.25, 1}};
  d.nearest = {{{"camera_seam", "floor_tilt"}, 120, 44, "start place", "why"}};
  const auto back = parse_diagnosis(to_json(d));
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(to_json(*back), to_json(d));
  ASSERT_TRUE(back->residual);
  EXPECT_EQ(back->residual->correction.field.at(0).frame, ResidualFrame::kMotion);
  EXPECT_EQ(back->residual->correction.field.at(0).weights.at(1).shifts(1, 2), -0.2);
  EXPECT_EQ(back->residual->correction.outliers, d.residual->correction.outliers);
  EXPECT_EQ(back->nearest.at(0).effects.at(1), "floor_tilt");
  Json json = Json::parse(to_json(d));
  json["residual"]["terms"][0]["centres"][1] = "x";
  EXPECT_THAT(parse_diagnosis(json.dump()).error().message, HasSubstr("residual.terms[0]"));
  json = Json::parse(to_json(d));
  json["residual"]["strays"]["kind"] = "lost";
  EXPECT_THAT(parse_diagnosis(json.dump()).error().message, HasSubstr("lost"));
  json["residual"] = 3;
  EXPECT_THAT(parse_diagnosis(json.dump()).error().message, HasSubstr("residual"));
}

TEST(FieldReader, IsStrictWhereItMayReportWhatIsWrong) {
  struct Row {
    double value = 1;
    std::uint64_t count = 2;
    std::optional<double> maybe;
  };
  const auto describe = [](auto& v, auto& row) { FIELDS(value, count, maybe); };
  const Json json = {{"value", nullptr}, {"count", 3.5}, {"maybe", "x"}};
  const Row lenient = FieldReader::read<Row>(json, describe);
  EXPECT_EQ(lenient.value, 1);
  EXPECT_EQ(lenient.count, 3U);
  EXPECT_FALSE(lenient.maybe);
  Row strict;
  std::string error;
  FieldReader fields(json, "row", &error);
  describe(fields, strict);
  EXPECT_TRUE(std::isnan(strict.value));
  EXPECT_EQ(error, "row.count is 3.5, expected a count");
}

// A file cut off anywhere, or with any byte gone wrong, is refused or read; it never crashes.
TEST(DiagnosisJson, SurvivesDamage) {
  Diagnosis d = example_diagnosis();
  d.trials.resize(2);
  const std::string text = to_json(d);
  for (std::size_t at = 0; at + 3 < text.size(); at += 7) {
    EXPECT_FALSE(parse_diagnosis(text.substr(0, at)).ok());
    std::string damaged = text;
    damaged[at] = "0[{\"\x80"[at % 5];
    (void)parse_diagnosis(damaged).ok();
  }
}

TEST(DiagnosisJson, ReplacesBytesThatAreNotText) {
  Diagnosis d;
  d.headline = "battery \xff sag";
  const auto back = parse_diagnosis(to_json(d));
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->headline, "battery \xEF\xBF\xBD sag");
}

}  // namespace gapfarm::diagnosis_json_test
