#include <gmock/gmock.h>

#include "master/command/provenance.h"
#include "tests/unit/trials/trial_text.h"

namespace gapfarm::stamp_test {

using testing::HasSubstr;

class Stamp : public testing::Test {
 protected:
  std::string compared(bool force = false) const {
    const auto state = compare_stamp(folder_ / "", "result.json", stamp_, force);
    if (!state) return state.error().message;
    return *state == FolderState::kNew ? "new" : *state == FolderState::kSame ? "same" : "replaced";
  }
  void write() const { folder_.write(kStampFile, format_stamp(stamp_)); }

  TemporaryFolder folder_;
  Provenance stamp_{"diagnose",
                    "0123",
                    {{"seed", 1}, {"genes", {{"friction", {0.1, 1.0}}}}},
                    {{"config", "a.toml"}, {"trials", {"x.csv", "y.csv"}}},
                    "build"};
};

TEST_F(Stamp, GoesOnWithTheSameQuestion) {
  EXPECT_EQ(compared(), "new");
  write();
  EXPECT_EQ(compared(), "same");
  folder_.write("result.json", "{}");
  EXPECT_EQ(compared(), "same");
  // Where the files lie is no part of the question.
  stamp_.about["config"] = "elsewhere/a.toml";
  EXPECT_EQ(compared(), "same");
}

TEST_F(Stamp, RefusesAnotherLogEvenWithForce) {
  write();
  stamp_.problem = "4567";
  stamp_.about = {{"config", "a.toml"}, {"trials", {"z.csv"}}};
  EXPECT_THAT(compared(true), HasSubstr("holds what 'diagnose' found of a.toml, x.csv, y.csv, and "
                                        "this is another question (a.toml, z.csv)"));
}

TEST_F(Stamp, ReplacesOtherOptionsWithForceAlone) {
  write();
  stamp_.options["seed"] = 2;
  EXPECT_EQ(compared(), "replaced");  // nothing was finished that could be lost
  folder_.write("result.json", "{}");
  EXPECT_THAT(compared(), HasSubstr("with other seed; choose another --out, or --force"));
  EXPECT_EQ(compared(true), "replaced");
}

TEST_F(Stamp, RefusesWhatDoesNotReportOfWhatItIs) {
  folder_.write("result.json", "{}");
  EXPECT_THAT(compared(true), HasSubstr("do not say of what"));
}

TEST_F(Stamp, KeepsAnotherBuildsResult) {
  write();
  stamp_.build = "newer";
  EXPECT_EQ(compared(), "same");  // nothing was finished yet
  folder_.write("result.json", "{}");
  EXPECT_THAT(compared(), HasSubstr("by another build"));
  EXPECT_EQ(compared(true), "same");
}

}  // namespace gapfarm::stamp_test
