#include "master/serve/request.h"

#include <gmock/gmock.h>

namespace gapfarm::request_test {

using testing::ElementsAre;

TEST(ParseTarget, DecodesPathAndQuery) {
  const auto target = parse_target("/view?of=run%2Fa%20b+c&of=%C3%A4&empty&x=1=2#part");
  ASSERT_TRUE(target.ok()) << target.error().message;
  EXPECT_EQ(target->path, "/view");
  EXPECT_THAT(target->query.at("of"), ElementsAre("run/a b c", "\xC3\xA4"));
  EXPECT_EQ(target->value("empty"), "");
  EXPECT_EQ(target->value("x"), "1=2");
  EXPECT_EQ(target->value("missing"), "");
}

TEST(ParseTarget, RefusesWhatIsNoPath) {
  for (const std::string bad : {"", "view", "http://evil.example/", "/a%", "/a%4", "/a%zz",
                                "/a%00b", "/a?x=%0d%0aHost:", "*", "/a\nb"}) {
    EXPECT_FALSE(parse_target(bad).ok()) << bad;
  }
  EXPECT_FALSE(parse_target("/" + std::string(4000, 'a')).ok());
  std::string many = "/?";
  for (int i = 0; i < 40; ++i) many += "of=a&";
  EXPECT_FALSE(parse_target(many).ok());
}

TEST(ParseTarget, ReadsBackWhatWasEncoded) {
  std::string text;
  for (int c = 0x20; c < 0x100; ++c) {
    if (c != 0x7f) text += static_cast<char>(c);
  }
  const auto target = parse_target("/view?of=" + percent_encoded(text));
  ASSERT_TRUE(target.ok()) << target.error().message;
  EXPECT_EQ(target->value("of"), text);
}

// A page elsewhere whose name was made to mean this machine (DNS rebinding) sends its own name.
TEST(IsLoopbackHost, KnowsThisMachineOnly) {
  for (const char* good : {"localhost", "localhost:8421", "127.0.0.1", "127.0.0.1:80", "[::1]:9"}) {
    EXPECT_TRUE(is_loopback_host(good)) << good;
  }
  for (const char* bad : {"", "evil.example", "evil.example:8421", "127.0.0.1.evil.example",
                          "localhost.evil.example", "localhost:", "localhost:80x", "127.0.0.2",
                          "localhost:123456", "0.0.0.0", "user@localhost"}) {
    EXPECT_FALSE(is_loopback_host(bad)) << bad;
  }
}

TEST(Refusal, LetsReadersOfThisMachineThrough) {
  EXPECT_FALSE(refusal({"GET", "/", "localhost", ""}));
  EXPECT_FALSE(refusal({"HEAD", "/view?of=a", "127.0.0.1:8421", ""}));
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "TRACE", "CONNECT", "get", ""}) {
    const auto response = refusal({method, "/", "localhost", ""});
    ASSERT_TRUE(response) << method;
    EXPECT_EQ(response->status, 405u);
    EXPECT_EQ(response->allow, "GET, HEAD");
  }
  EXPECT_EQ(refusal({"GET", "/", "evil.example", ""})->status, 421u);
  EXPECT_EQ(refusal({"GET", "/%", "localhost", ""})->status, 400u);
}

}  // namespace gapfarm::request_test
