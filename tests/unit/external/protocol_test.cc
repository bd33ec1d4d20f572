// The protocol with simulators of users, and the parameter table that a declaration makes.
#include "common/external/protocol.h"

#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/parameters/table.h"

namespace gapfarm::protocol_test {

using testing::HasSubstr;

std::string declaration_with(const std::string& parameter, const std::string& inputs = "[]") {
  return R"({"gapfarm": 1, "name": "mine", "inputs": )" + inputs + R"(, "parameters": [)" +
         parameter + "]}";
}

std::string error_of(const std::string& line) {
  const auto declaration = parse_declaration(line);
  EXPECT_FALSE(declaration.ok()) << line;
  return declaration ? "" : declaration.error().message;
}

constexpr const char* kMass =
    R"({"key": "mass", "unit": "kg", "lower": 0.1, "upper": 2, "nominal": 1, "log": true})";

TEST(ExternalDeclaration, RefusesWhatCannotBeATable) {
  EXPECT_THAT(error_of("hello"), HasSubstr("JSON object"));
  EXPECT_THAT(error_of("caf\xe9 here"), HasSubstr("'caf\uFFFD here'"));
  EXPECT_THAT(error_of(R"({"gapfarm": 2})"), HasSubstr("does not speak protocol 1"));
  EXPECT_THAT(error_of(declaration_with(std::string(kMass) + "," + kMass)), HasSubstr("twice"));
  EXPECT_THAT(error_of(declaration_with(R"({"key": "a b"})")), HasSubstr("'a b' needs a key"));
  EXPECT_THAT(error_of(declaration_with(R"({"key": "motor_lag"})")), HasSubstr("uses itself"));
  EXPECT_THAT(error_of(declaration_with(R"({"key": "m", "lower": 1, "upper": 1, "nominal": 1})")),
              HasSubstr("lower below upper"));
  EXPECT_THAT(error_of(declaration_with(R"({"key": "m", "lower": 1, "upper": "2", "nominal": 1})")),
              HasSubstr("expected two finite numbers"));
  EXPECT_THAT(error_of(declaration_with(R"({"key": "m", "lower": 1, "upper": 2, "nominal": 3})")),
              HasSubstr("outside its bounds"));
  EXPECT_THAT(error_of(declaration_with(
                  R"({"key": "m", "lower": 0, "upper": 2, "nominal": 1, "log": true})")),
              HasSubstr("log scale"));
  EXPECT_THAT(error_of(declaration_with(
                  R"({"key": "n", "lower": 1, "upper": 2.5, "nominal": 1, "integer": true})")),
              HasSubstr("expected whole numbers"));
  EXPECT_THAT(error_of(declaration_with(
                  R"({"key": "n", "lower": 1, "upper": 9, "nominal": 1, "integer": true,
                      "log": true})")),
              HasSubstr("searched evenly"));
  EXPECT_THAT(error_of(declaration_with(
                  R"({"key": "m", "lower": 1, "upper": 2, "nominal": 1, "intger": true})")),
              HasSubstr("unknown key 'intger'; did you mean 'integer'?"));
  EXPECT_THAT(error_of(declaration_with(R"({"key": "m", "foo": 1})")),
              testing::EndsWith("'foo'; known: key, unit, lower, upper, nominal, log, integer, "
                                "choices, when, summary"));
  EXPECT_THAT(error_of(declaration_with(kMass, R"(["paths"])")),
              testing::EndsWith("did you mean 'path'?"));
}

TEST(ExternalDeclaration, ReportsEverythingInOneLine) {
  const auto declaration = parse_declaration(declaration_with(
      R"({"key": "m", "lower": 1, "upper": 2, "nominal": 1, "summary": "of\nall\n[genes]"})"));
  ASSERT_TRUE(declaration.ok());
  EXPECT_EQ(declaration->parameters[0].summary, "of all [genes]");
}

// Whole numbers are searched and asked for as such.
TEST(ExternalDeclaration, AnIntegerIsOne) {
  const auto declaration = parse_declaration(declaration_with(
      R"({"key": "teeth", "lower": 8, "upper": 12, "nominal": 10, "integer": true})"));
  ASSERT_TRUE(declaration.ok()) << declaration.error().message;
  const ExternalTable table(*declaration);
  EXPECT_FALSE(table.table().check(0, 9.5).ok());
  EXPECT_TRUE(table.table().check(0, 9).ok());
  const Gene gene{0, 8, 12, ParameterScale::kLinear};
  for (const double g : {0.0, 0.13, 0.5, 0.77, 1.0}) {
    const double value = decode_gene(table.table(), gene, g);
    EXPECT_EQ(value, std::floor(value)) << g;
  }
  ExternalRequest request;
  request.declaration = &table.declaration();
  request.values = {9};
  EXPECT_THAT(request_line(request), HasSubstr(R"("teeth":9})"));
}

// Four digits, but for a value that a rounded bound would let in.
TEST(ExternalTable, NumbersForPeopleAreShort) {
  const ExternalTable table(
      parse_declaration(declaration_with(R"({"key": "m", "unit": "m", "nominal": 0.3,
          "lower": 0.24413111231467408, "upper": 0.9}, {"key": "n", "nominal": 123456,
          "lower": 0, "upper": 200000, "integer": true})"))
          .value());
  const ParameterTable& rows = table.table();
  EXPECT_EQ(rows.format(0, 0.24413111231467408), "0.2441 m");
  EXPECT_EQ(rows.format(1, 123456), "123456");
  EXPECT_EQ(rows.check(0, 0.1).error().message,
            "m is 0.1, but it must be between 0.2441 m and 0.9 m");
  EXPECT_THAT(rows.check(0, 0.2441).error().message, HasSubstr("between 0.24413111231467408"));
}

TEST(ExternalTable, HasTheProgramsRowsThenNoiseThenEffectsThatCanBeApplied) {
  const ExternalTable plain(parse_declaration(declaration_with(kMass)).value());
  EXPECT_EQ(plain.table()[0].key, "mass");
  EXPECT_EQ(plain.table()[0].scale, ParameterScale::kLog);
  EXPECT_EQ(plain.table()[plain.first_noise_row()].key, "drive_noise_common");
  EXPECT_EQ(plain.table()[plain.first_noise_row() + 5].key, "pose_noise_tail");
  EXPECT_TRUE(plain.table().find("motor_asymmetry.ratio") ||
              plain.table().find("camera_aspect.ratio"));
  for (const char* needs : {"motor_lag.tau", "floor_tilt.angle", "backlash.travel"}) {
    EXPECT_FALSE(plain.table().find(needs)) << needs;
  }
  const ExternalTable rich(
      parse_declaration(declaration_with(kMass, R"(["lag", "dead_travel", "floor", "path"])"))
          .value());
  EXPECT_TRUE(rich.table().find("motor_lag.tau"));
  // All of srv1's but one on the robot's build and a second patch, of which a request shows
  // nothing.
  EXPECT_FALSE(rich.table().find("friction_patch_2.ratio"));
  EXPECT_EQ(rich.table().effects().size() + 2, srv1_effects_and_seconds().size());
}

TEST(ExternalRequest, HoldsWhatTheProgramDeclaredAndNothingElse) {
  const ExternalDeclaration declaration =
      parse_declaration(declaration_with(kMass, R"(["lag"])")).value();
  ExternalRequest request;
  request.declaration = &declaration;
  request.id = 7;
  request.values = {0.5};
  request.left = {1, 0.25, 0.01};
  request.duration_s = 2;
  const auto json = nlohmann::json::parse(request_line(request));
  EXPECT_EQ(json["id"], 7);
  EXPECT_EQ(json["parameters"]["mass"], 0.5);
  EXPECT_EQ(json["left"], (nlohmann::json{{"speed", 1}, {"lag", 0.25}}));
  EXPECT_FALSE(json.contains("floor"));
  EXPECT_FALSE(json.contains("interval"));
  EXPECT_EQ(json["duration"], 2);
}

}  // namespace gapfarm::protocol_test
