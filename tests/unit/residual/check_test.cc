#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/residual/fields.h"

namespace gapfarm {
namespace {

using testing::HasSubstr;

const std::vector<std::string> kCommands = {"forward", "turn_cw"};

std::string wrong(const ResidualTerm& term) {
  const Status s = check_residual({term}, kCommands);
  return s.ok() ? "" : s.error().message;
}

TEST(ResidualCheck, SoundOnesPass) {
  EXPECT_TRUE(check_residual({}, kCommands).ok());
  EXPECT_EQ(wrong(tests::heading_term()), "");
  for (const ResidualFrame frame :
       {ResidualFrame::kRobot, ResidualFrame::kWorld, ResidualFrame::kReadings}) {
    EXPECT_EQ(wrong(tests::place_term(frame)), "");
  }
}

TEST(ResidualCheck, ReportsWhatIsWrong) {
  const ResidualTerm sound = tests::heading_term();
  ResidualTerm term = sound;
  term.weights[1].command = "turn_cx";
  EXPECT_THAT(wrong(term), HasSubstr("command 'turn_cx', which the model does not have; did you "
                                     "mean 'turn_cw'?"));
  term = sound;
  term.weights[1].shifts.conservativeResize(2, 3);
  EXPECT_THAT(wrong(term), HasSubstr("'turn_cw' are 2 rows of 3, expected 3 rows of 3"));
  term = sound;
  term.weights[0].shifts(1, 1) = std::numeric_limits<double>::infinity();
  EXPECT_THAT(wrong(term), HasSubstr("not finite"));
  term = sound;
  term.weights[1].command = "";
  EXPECT_THAT(wrong(term), HasSubstr("keep either"));
  term = sound;
  term.lengths = {0};
  EXPECT_THAT(wrong(term), HasSubstr("length 0"));
  term = sound;
  term.lengths = {1, 1};
  EXPECT_THAT(wrong(term), HasSubstr("2 lengths for 1 covariates"));
  term = sound;
  term.covariates = {99};
  EXPECT_THAT(wrong(term), HasSubstr("the same build"));
  term = sound;
  term.centres.resize(0, 1);
  EXPECT_THAT(wrong(term), HasSubstr("0 centres, expected 1 to 64"));
}

TEST(ResidualCheck, ReadingsHaveNoDurationsAndKeepTheirHeadings) {
  ResidualTerm term = tests::place_term(ResidualFrame::kReadings);
  term.covariates[1] = tests::covariate("duration");
  EXPECT_THAT(wrong(term), HasSubstr("which no reading has; expected x, y or heading"));
  term = tests::place_term(ResidualFrame::kReadings);
  term.weights[0].shifts(0, 2) = 0.1;
  EXPECT_THAT(wrong(term), HasSubstr("make the third number 0"));
  term = tests::place_term(ResidualFrame::kReadings);
  term.by_drive = true;
  EXPECT_THAT(wrong(term), HasSubstr("leave by_drive out"));
}

}  // namespace
}  // namespace gapfarm
