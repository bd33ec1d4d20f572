// Key folders: what is written can be read, and nothing that others could read or change is.
#include "common/net/keys.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "common/net/socket.h"
#include "tests/temporary_folder.h"

namespace gapfarm::keys_test {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Keys : public testing::Test {
 protected:
  KeyFolder folder(const std::string& name = "keys") const {
    return KeyFolder::open_or_make(base_ / name).value();
  }
  static mode_t mode(const fs::path& path) {
    struct stat found = {};
    EXPECT_EQ(stat(path.c_str(), &found), 0);
    return found.st_mode & 0777;
  }

  const TemporaryFolder temporary_;
  const fs::path base_ = temporary_.path();
};

TEST_F(Keys, WhatIsWrittenIsReadAgainAndPrivate) {
  const KeyFolder keys = folder();
  const KeyPair pair = make_key_pair("rack3");
  ASSERT_TRUE(keys.add_pair("worker", pair).ok());
  const auto read = keys.pair("worker");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->name, "rack3");
  EXPECT_EQ(read->public_key, pair.public_key);
  EXPECT_EQ(read->secret_key, pair.secret_key);
  EXPECT_EQ(mode(keys.path()), 0700u);
  EXPECT_EQ(mode(keys.path() + "/worker.key"), 0600u);
  const auto is_public = read_public_key(keys.path() + "/worker.pub");
  ASSERT_TRUE(is_public.ok());
  EXPECT_EQ(is_public->key, pair.public_key);
}

TEST_F(Keys, AKeyIsNeverReplaced) {
  const KeyFolder keys = folder();
  const KeyPair first = make_key_pair("a");
  ASSERT_TRUE(keys.add_pair("master", first).ok());
  EXPECT_FALSE(keys.add_pair("master", make_key_pair("b")).ok());
  EXPECT_EQ(keys.pair("master")->secret_key, first.secret_key);
  ASSERT_TRUE(keys.list({"w", first.public_key}).ok());
  EXPECT_TRUE(keys.list({"w", first.public_key}).ok());
  EXPECT_THAT(keys.list({"w", make_key_pair("w").public_key}).error().message,
              HasSubstr("another key"));
}

TEST_F(Keys, AFileThatIsTooLongIsRefusedAndNotCutOff) {
  const std::string path = base_ / "long.pub";
  const std::string key = "name w\npublic " + make_key_pair("w").public_key + "\n#";
  std::ofstream(path) << key << std::string(4096 - key.size(), '-');
  EXPECT_TRUE(read_public_key(path).ok());
  std::ofstream(path) << key << std::string(4097 - key.size(), '-');
  EXPECT_THAT(read_public_key(path).error().message,
              testing::AllOf(HasSubstr("long.pub' has 4097 bytes"), HasSubstr("at most 4096"),
                             HasSubstr("remove its comments")));
}

TEST_F(Keys, LoosePermissionsAreRefused) {
  const KeyFolder keys = folder();
  ASSERT_TRUE(keys.add_pair("master", make_key_pair("m")).ok());
  const fs::path secret = keys.path() + "/master.key";
  for (const auto loose : {fs::perms::group_read, fs::perms::others_read, fs::perms::group_write}) {
    fs::permissions(secret, fs::perms::owner_all | loose);
    EXPECT_THAT(keys.pair("master").error().message, HasSubstr("chmod 600"));
    fs::permissions(secret, fs::perms::owner_read);
    fs::permissions(keys.path(), fs::perms::owner_all | loose);
    EXPECT_THAT(KeyFolder::open(keys.path()).error().message, HasSubstr("chmod 700"));
    EXPECT_FALSE(master_security(keys.path()).ok());
    fs::permissions(keys.path(), fs::perms::owner_all);
  }
  EXPECT_TRUE(keys.pair("master").ok());
  fs::permissions(keys.path() + "/master.pub", fs::perms::all);
  EXPECT_FALSE(keys.master_public().ok());
}

TEST_F(Keys, LinksAndDamageAreRefused) {
  const KeyFolder keys = folder();
  ASSERT_TRUE(keys.add_pair("master", make_key_pair("m")).ok());
  fs::create_symlink(keys.path() + "/master.key", keys.path() + "/worker.key");
  EXPECT_FALSE(keys.pair("worker").ok());
  fs::remove(keys.path() + "/worker.key");
  const KeyPair one = make_key_pair("one"), two = make_key_pair("two");
  std::ofstream(keys.path() + "/worker.key")
      << "public " << one.public_key << "\nsecret " << two.secret_key << "\n";
  fs::permissions(keys.path() + "/worker.key", fs::perms::owner_read);
  EXPECT_THAT(keys.pair("worker").error().message, HasSubstr("damaged"));
}

TEST_F(Keys, TheListHoldsWhatCanBeReadAndNamesTheRest) {
  const KeyFolder keys = folder();
  EXPECT_TRUE(keys.listed(nullptr)->empty());
  ASSERT_TRUE(keys.list({"b", make_key_pair("").public_key}).ok());
  ASSERT_TRUE(keys.list({"a", make_key_pair("").public_key}).ok());
  EXPECT_FALSE(keys.list({"../up", make_key_pair("").public_key}).ok());
  EXPECT_FALSE(keys.list({"c", "short"}).ok());
  std::ofstream(keys.listed_path() + "/broken.pub") << "nothing\n";
  std::vector<std::string> trouble;
  const auto listed = keys.listed(&trouble);
  ASSERT_TRUE(listed.ok());
  ASSERT_EQ(listed->size(), 2u);
  EXPECT_EQ((*listed)[0].name, "a");
  EXPECT_EQ(trouble.size(), 1u);
  EXPECT_TRUE(keys.unlist("a").ok());
  EXPECT_FALSE(keys.unlist("a").ok());
  EXPECT_FALSE(keys.unlist("../workers/b").ok());
}

TEST_F(Keys, MissingKeysNameTheCommandThatMakesThem) {
  EXPECT_THAT(master_security(base_ / "none").error().message, HasSubstr("gapfarm keys make"));
  EXPECT_THAT(worker_security(folder().path()).error().message, HasSubstr("gapfarm keys"));
}

TEST(LinkSecurity, NothingListensOpenlyUnlessReportedTwice) {
  LinkSecurity security;
  EXPECT_TRUE(may_listen("ipc:///tmp/x", security).ok());
  EXPECT_THAT(may_listen("tcp://127.0.0.1:1", security).error().message, HasSubstr("keys"));
  security.own = make_key_pair("m");
  EXPECT_FALSE(may_listen("tcp://127.0.0.1:1", security).ok());  // nobody could be listed
  security.listed = "/somewhere";
  EXPECT_TRUE(may_listen("tcp://0.0.0.0:1", security).ok());
  security.open = OpenLinks::kLoopback;
  for (const char* local : {"tcp://127.0.0.1:1", "tcp://localhost:*", "tcp://127.9.9.9:1"}) {
    EXPECT_TRUE(may_listen(local, security).ok()) << local;
  }
  for (const char* wide : {"tcp://0.0.0.0:1", "tcp://*:1", "tcp://eth0:1", "tcp://127.evil.org:1",
                           "tcp://10.0.0.1:1", "tcp://[::]:1"}) {
    EXPECT_FALSE(may_listen(wide, security).ok()) << wide;
  }
  security.open = OpenLinks::kAnywhere;
  EXPECT_TRUE(may_listen("tcp://0.0.0.0:1", security).ok());
}

TEST(LinkSecurity, AWorkerDoesNotConnectWithoutKeysUnlessReported) {
  EXPECT_FALSE(DealerSocket::connect("tcp://127.0.0.1:1").ok());
  SocketOptions options;
  options.security.own = make_key_pair("w");
  EXPECT_FALSE(DealerSocket::connect("tcp://127.0.0.1:1", options).ok());
  options.security.master_key = make_key_pair("m").public_key;
  EXPECT_TRUE(DealerSocket::connect("tcp://127.0.0.1:1", options).ok());
}

TEST_F(Keys, ASocketThatCannotListenLeavesTheModeOfFilesToCome) {
  const mode_t before = umask(0022);
  SocketOptions options;
  options.security.open = OpenLinks::kAnywhere;
  const auto first = RouterSocket::create(options), second = RouterSocket::create(options);
  const auto endpoint = (*first)->bind("tcp://127.0.0.1:*");
  ASSERT_TRUE(endpoint.ok()) << endpoint.error().message;
  EXPECT_FALSE((*second)->bind(*endpoint).ok());
  EXPECT_EQ(umask(before), 0022u);
}

}  // namespace gapfarm::keys_test
