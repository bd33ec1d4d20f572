// [[pieces]] of a config and of a model.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/config/config.h"
#include "common/config/model.h"

namespace gapfarm::pieces_test {

using testing::HasSubstr;

const std::string kTop = "scenario = \"push\"\n";
const std::string kTriangle =
    "[[pieces]]\nname = \"t\"\ncorners = [[0, 0], [0.3, 0], [0, 0.3]]\nthickness = 0.02\n"
    "mass = 0.5\n";

std::string error_of(const std::string& text) {
  const auto config = parse_config(text, "c.toml");
  return config.ok() ? "no error" : config.error().message;
}

TEST(Pieces, BecomeTheCommands) {
  const auto config = parse_config(kTop + kTriangle, "c.toml");
  ASSERT_TRUE(config.ok()) << config.error().message;
  ASSERT_EQ(config->problem.pieces.size(), 1u);
  EXPECT_EQ(config->problem.commands[0].name, "t");
  EXPECT_EQ(config->problem.pieces[0].corners[1], Eigen::Vector2d(0.3, 0));
  EXPECT_EQ(config->problem.pieces[0].mass_kg, 0.5);
}

TEST(Pieces, CornersMayBeSeenFromTheCentroid) {
  const auto config = parse_config(kTop + kTriangle + "origin = \"centroid\"\n", "c.toml");
  ASSERT_TRUE(config.ok()) << config.error().message;
  EXPECT_NEAR(centroid(config->problem.pieces[0]).norm(), 0, 1e-15);
}

TEST(Pieces, ErrorsNameThePieceAndTheRemedy) {
  EXPECT_THAT(error_of(kTop), HasSubstr("scenario push needs sections [[pieces]]"));
  EXPECT_THAT(error_of(kTriangle), HasSubstr("unknown key 'pieces'"));
  EXPECT_THAT(error_of(kTop + kTriangle + kTriangle), HasSubstr("'t' is written twice"));
  const auto with_corners = [](const std::string& corners) {
    return error_of(kTop + "[[pieces]]\nname = \"t\"\ncorners = " + corners + "\n");
  };
  EXPECT_THAT(with_corners("[[0, 0], [0, 0.3], [0.3, 0]]"), HasSubstr("corners clockwise"));
  EXPECT_THAT(with_corners("[[0, 0], [0.3, 0]]"), HasSubstr("has 2 corners"));
  EXPECT_THAT(with_corners("[[0, 0], [0.3, 0], [0.1, 0.1], [0, 0.3]]"), HasSubstr("not convex"));
  EXPECT_THAT(with_corners("[[0, 0], [300, 0], [0, 300]]"), HasSubstr("corners are in m"));
  EXPECT_THAT(with_corners("[0, 1]"), HasSubstr("corners are pairs"));
}

TEST(Pieces, AModelReadsBackAsItWas) {
  auto config = parse_config(kTop + kTriangle + "symmetry = 2\n", "c.toml");
  Model model = *nominal_model("push");
  model.pieces = config->problem.pieces;
  model.commands = config->problem.commands;
  const auto again = parse_model(format_model(model), "m.toml");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->pieces, model.pieces);
  EXPECT_EQ(again->commands.size(), 1u);
  EXPECT_EQ(problem_of(*again).pieces, model.pieces);
  EXPECT_EQ(format_model(*again), format_model(model));
}

}  // namespace gapfarm::pieces_test
