// [residual] of model.toml, and of a problem's message.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/config/model.h"
#include "tests/unit/residual/fields.h"

namespace gapfarm {
namespace {

using testing::HasSubstr;

Model model_with_residual() {
  Model model = *nominal_model("srv1");
  model.residual.field = {tests::heading_term(), tests::place_term(ResidualFrame::kReadings)};
  model.residual.field[0].weights[0].shifts(0, 0) = 0.1 + 0.2;
  model.residual.outliers = {OutlierKind::kSide, 0.1 + 0.2, -0.5, 0.125, 0.01, 0, 0.25, 0.15};
  return model;
}

void expect_equal(const ResidualField& a, const ResidualField& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].frame, b[i].frame);
    EXPECT_EQ(a[i].by_drive, b[i].by_drive);
    EXPECT_EQ(a[i].covariates, b[i].covariates);
    EXPECT_EQ(a[i].lengths, b[i].lengths);
    EXPECT_EQ(a[i].centres, b[i].centres);
    ASSERT_EQ(a[i].weights.size(), b[i].weights.size());
    for (std::size_t k = 0; k < a[i].weights.size(); ++k) {
      EXPECT_EQ(a[i].weights[k].command, b[i].weights[k].command);
      EXPECT_EQ(a[i].weights[k].shifts, b[i].weights[k].shifts);
    }
  }
}

TEST(ModelResidual, ReadsBackToTheBit) {
  const Model model = model_with_residual();
  const auto again = parse_model(format_model(model), "m.toml");
  ASSERT_TRUE(again.ok()) << again.error().message;
  expect_equal(again->residual.field, model.residual.field);
  EXPECT_EQ(again->residual.outliers, model.residual.outliers);
  EXPECT_EQ(format_model(*again), format_model(model));
}

TEST(ModelResidual, CrossesTheWire) {
  const Problem problem = problem_of(model_with_residual());
  const auto again = from_proto(to_proto(problem));
  ASSERT_TRUE(again.ok()) << again.error().message;
  expect_equal(again->residual.field, problem.residual.field);
  EXPECT_EQ(again->residual.outliers, problem.residual.outliers);
}

// Problems without one keep their hashes, and with them their stored answers.
TEST(ModelResidual, WithoutOneTheBytesAreWhatTheyWere) {
  const Problem plain = problem_of(*nominal_model("srv1"));
  EXPECT_EQ(to_proto(plain).residual(), "");
  EXPECT_NE(problem_hash(to_proto(plain)),
            problem_hash(to_proto(problem_of(model_with_residual()))));
  EXPECT_EQ(format_model(*nominal_model("srv1")).find("residual"), std::string::npos);
}

TEST(ModelResidual, MistakesAreNamedWithTheirPlace) {
  const std::string sound = format_model(model_with_residual());
  const auto message = [&](const std::string& from, const std::string& to) {
    std::string text = sound;
    const auto at = text.find(from);
    EXPECT_NE(at, text.npos) << from;
    text.replace(at, from.size(), to);
    const auto model = parse_model(text, "m.toml");
    return model.ok() ? std::string() : model.error().message;
  };
  EXPECT_THAT(message("frame = \"robot\"", "frame = \"robt\""),
              testing::AllOf(HasSubstr("m.toml:"), HasSubstr("robt"), HasSubstr("robot")));
  EXPECT_THAT(message("covariates = [\"heading\"]", "covariates = [\"headin\"]"),
              HasSubstr("heading"));
  EXPECT_THAT(message("lengths = [0.7]", "lengths = [-0.7]"), HasSubstr("-0.7"));
  EXPECT_THAT(message("centres = [[-2.0]", "centres = [[-2.0, 1]"),
              HasSubstr("centres are rows of 1 finite numbers"));
  EXPECT_THAT(message("centres = [[-2.0]", "centres = [[nan]"),
              HasSubstr("centres are rows of 1 finite numbers"));
  EXPECT_THAT(message("turn_cw = [", "turn_up = ["), HasSubstr("turn_up"));
  EXPECT_THAT(message("by_drive = true", "by_drve = true"), HasSubstr("by_drve"));
  EXPECT_THAT(message("kind = \"side\"", "kind = \"sideways\""), HasSubstr("sideways"));
  EXPECT_THAT(message("least = -0.5", "least = 0.5"), HasSubstr("exchange them"));
  EXPECT_THAT(message("gauge = 0.15", "guage = 0.15"), HasSubstr("guage"));
  EXPECT_THAT(message("scenario = \"srv1\"", "scenario = \"racquetball\""), HasSubstr("residual"));
}

TEST(ModelResidual, OutliersStandAlone) {
  Model model = *nominal_model("srv1");
  model.residual.outliers = {OutlierKind::kLate, 0.25, 0.2, 0.22, -0.05, 0, 0, 0};
  const std::string text = format_model(model);
  const auto again = parse_model(text, "m.toml");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->residual.outliers, model.residual.outliers);
  EXPECT_EQ(format_model(*again), text);
  model.scenario = "racquetball";
  const auto message = [](std::string scenario, const std::string& residual) {
    v1::Problem foreign = to_proto(problem_of(*nominal_model(scenario)));
    foreign.set_residual(residual);
    return from_proto(foreign).error().message;
  };
  const std::string sent = to_proto(problem_of(*again)).residual();
  EXPECT_THAT(message("racquetball", sent), HasSubstr("takes no [residual]"));
  EXPECT_THAT(message("srv1", sent + "share = 2\n"), HasSubstr("problem"));
  EXPECT_THAT(message("srv1", "[residual.strays]\nkind = \"late\"\nshare = 2\n"),
              HasSubstr("share"));
}

TEST(ModelResidual, EmptyAndForeignOnesAreRefused) {
  const auto empty = parse_model("model = 1\n[residual]\n", "m.toml");
  ASSERT_FALSE(empty.ok());
  EXPECT_THAT(empty.error().message, HasSubstr("[residual] has no terms"));
  v1::Problem message = to_proto(problem_of(*nominal_model("racquetball")));
  message.set_residual(to_proto(problem_of(model_with_residual())).residual());
  const auto foreign = from_proto(message);
  ASSERT_FALSE(foreign.ok());
  EXPECT_THAT(foreign.error().message, HasSubstr("[residual"));
}

}  // namespace
}  // namespace gapfarm
