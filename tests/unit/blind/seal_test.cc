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

TEST(TruthBox, OpensWithItsKeyAlone) {
  const std::vector<SealedTruth> truths = two_truths();
  const TruthKey key = TruthKey::random();
  const std::string box = key.close_box(truths);
  EXPECT_EQ(box.find("unknown"), box.npos);
  const auto opened = key.open_box(box, "box");
  ASSERT_TRUE(opened.ok());
  EXPECT_EQ((*opened)[1].truth, truths[1].truth);
  EXPECT_EQ((*opened)[1].salt, truths[1].salt);
  EXPECT_FALSE(TruthKey::random().open_box(box, "box").ok());
  for (const std::size_t at : {std::size_t{0}, std::size_t{30}, box.size() - 1}) {
    std::string changed = box;
    changed[at] ^= 1;
    EXPECT_FALSE(key.open_box(changed, "box").ok()) << at;
  }
  EXPECT_FALSE(key.open_box("short", "box").ok());
}

TEST(TruthBox, KeyReadsBack) {
  const TruthKey key = TruthKey::random();
  const auto back = TruthKey::parse(key.text(), "key");
  ASSERT_TRUE(back.ok());
  EXPECT_TRUE(back->open_box(key.close_box(two_truths()), "box").ok());
  EXPECT_FALSE(TruthKey::parse("abc", "key").ok());
  EXPECT_FALSE(TruthKey::parse(key.text() + "00", "key").ok());
}

TEST(TruthBox, PrivateFilesAreTheOwnersAlone) {
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
