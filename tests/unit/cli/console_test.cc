#include "master/command/console.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

namespace gapfarm::console_test {

using Json = nlohmann::ordered_json;

class ConsoleTest : public testing::Test {
 protected:
  ~ConsoleTest() override {
    std::fclose(out_);
    std::fclose(err_);
  }
  std::string printed() {
    std::rewind(out_);
    std::string text(1000, '\0');
    text.resize(std::fread(text.data(), 1, text.size(), out_));
    return text;
  }

  std::FILE* out_ = std::tmpfile();
  std::FILE* err_ = std::tmpfile();
};

TEST_F(ConsoleTest, ShowsResultsAsTextOrAsJson) {
  Console plain(out_, err_);
  plain.result("two trials\n", {{"trials", 2}});
  EXPECT_EQ(plain.end(0), 0);
  EXPECT_EQ(printed(), "two trials\n");
}

TEST_F(ConsoleTest, ShowsTheErrorAsJsonWhereThereIsNoResult) {
  Console console(out_, err_);
  console.use_json();
  console.error({"log.csv:2:1: found \xff"});
  console.error({"and more"});
  EXPECT_EQ(console.end(2), 2);
  const Json json = Json::parse(printed());
  EXPECT_EQ(json["error"]["exit_code"], 2);
  EXPECT_THAT(json["error"]["message"].get<std::string>(), testing::EndsWith("\nand more"));
}

TEST_F(ConsoleTest, ShowsNoErrorBehindAResult) {
  Console console(out_, err_);
  console.use_json();
  console.result("", {{"same", false}});
  console.error({"it differs"});
  EXPECT_EQ(console.end(1), 1);
  EXPECT_EQ(Json::parse(printed()), Json({{"same", false}}));
}

TEST_F(ConsoleTest, FailsWhereItsResultIsNotTaken) {
  std::FILE* full = std::fopen("/dev/full", "w");
  ASSERT_NE(full, nullptr);
  {
    Console console(full, err_);
    console.result("two trials\n", {{"trials", 2}});
    EXPECT_EQ(console.end(kExitDone), kExitFailed);
    console.print("more\n");
    EXPECT_EQ(console.end(kExitQuarantined), kExitQuarantined);
  }
  std::fclose(full);
  std::swap(out_, err_);
  EXPECT_THAT(printed(), testing::StartsWith("gapfarm: stdout: cannot be written: No space"));
}

}  // namespace gapfarm::console_test
