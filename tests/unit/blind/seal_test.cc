#include "master/experiments/blind_check/cases/seal.h"

#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/stat.h>

#include "common/trials/files.h"
#include "tests/unit/blind/worker_farm.h"

namespace gapfarm::seal_test {

std::vector<SealedTruth> two_truths() {
  return {{"case001", random_salt(), "{\"answer\": \"none\"}"},
          {"case002", random_salt(), "{\"answer\": \"unknown\"}"}};
}

TEST(Seal, IsBlake2bOfSaltAndTruth) {
  // b2sum -l 256 of "abc".
  EXPECT_EQ(seal_of("a", "bc"), "bddd813c634239723171ef3fee98579b94964e3bb1cb3e427262c8c068d52319");
}

TEST(Seal, VerifiesAndDetectsTampering) {
  std::vector<SealedTruth> truths = two_truths();
  const std::string seals = format_seals(truths);
  EXPECT_TRUE(verify_seals(truths, seals, "seals.txt").ok());

  auto changed = truths;
  changed[1].truth[3] ^= 1;
  EXPECT_FALSE(verify_seals(changed, seals, "seals.txt").ok());
  changed = truths;
  changed[0].salt = random_salt();
  EXPECT_FALSE(verify_seals(changed, seals, "seals.txt").ok());
  changed = {truths[0]};
  EXPECT_FALSE(verify_seals(changed, seals, "seals.txt").ok());
  changed = truths;
  changed.push_back({"case003", random_salt(), "{}"});
  EXPECT_FALSE(verify_seals(changed, seals, "seals.txt").ok());
  EXPECT_FALSE(verify_seals(truths, seals + seals, "seals.txt").ok());
}

TEST(Seal, SaltsDiffer) { EXPECT_NE(random_salt(), random_salt()); }

TEST(Seal, SealedTruthsReadBack) {
  const std::vector<SealedTruth> truths = two_truths();
  const auto back = parse_sealed(format_sealed(truths), "truths");
  ASSERT_TRUE(back.ok());
  EXPECT_TRUE(verify_seals(*back, format_seals(truths), "seals.txt").ok());
  EXPECT_FALSE(parse_sealed("{}", "truths").ok());
}

TEST(Seal, PrivateFilesAreTheOwnersAlone) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_file_atomically(folder / "key", "secret", IfThere::kReplace, 0600).ok());
  struct stat status = {};
  ASSERT_EQ(::stat((folder / "key").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600u);
  EXPECT_EQ(*read_text_file(folder / "key"), "secret");
}

TEST(PrivateMemory, IsUndumpableWhileItLives) {
  const int before = ::prctl(PR_GET_DUMPABLE);
  {
    const PrivateMemory unreadable;
    EXPECT_EQ(::prctl(PR_GET_DUMPABLE), 0);
  }
  EXPECT_EQ(::prctl(PR_GET_DUMPABLE), before);
}

}  // namespace gapfarm::seal_test
