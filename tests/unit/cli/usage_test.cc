#include "common/usage/usage.h"

#include <gmock/gmock.h>

#include "common/base/text.h"
#include "master/cli/subcommand.h"

namespace gapfarm::usage_test {

using testing::HasSubstr;

std::string sentence_of(const std::vector<std::string>& arguments) {
  const std::unique_ptr<Program> program = make_program();
  try {
    parse_arguments(*program, arguments);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return "help";
    return usage_sentence(*program->app->get_subcommands().front(), error);
  }
  return "no error";
}

TEST(Usage, ReportsWhatWasFoundAndWhatWasExpected) {
  const std::vector<std::string> evolve = {"evolve", "c.toml", "--out", "x"};
  const auto with = [&](const std::string& option, const std::string& value) {
    std::vector<std::string> arguments = evolve;
    arguments.insert(arguments.end(), {option, value});
    return sentence_of(arguments);
  };
  EXPECT_EQ(with("--workers", "abc"), "--workers is 'abc', expected a whole number from 0 to 4096");
  EXPECT_EQ(with("--workers", "5000"),
            "--workers is '5000', expected a whole number from 0 to 4096");
  EXPECT_EQ(with("--seed", "first"), "--seed is 'first', expected a whole number of at least 0");
  for (const char* wrapped : {"-5", "99999999999999999999999"}) {
    EXPECT_EQ(with("--seed", wrapped),
              "--seed is '" + std::string(wrapped) + "', expected a whole number of at least 0");
    EXPECT_THAT(with("--generations", wrapped), HasSubstr("expected a whole number"));
  }
  EXPECT_EQ(with("--seed", "18446744073709551615"), "no error");
  EXPECT_EQ(with("--target", "high"), "--target is 'high', expected a number");
  EXPECT_EQ(with("--time", "-3"), "--time is '-3', expected a number greater than 0");
  EXPECT_EQ(with("--target", "nan"), "--target is 'nan', expected a finite number");
  EXPECT_EQ(with("--time", "nan"), "--time is 'nan', expected a finite number");
  EXPECT_EQ(sentence_of({"simulate", "c.toml", "--out", "x", "--levels", "0.5", "nan"}),
            "--levels is 'nan', expected a finite number");
  EXPECT_THAT(sentence_of({"workers", "--connect", "ipc://x", "--wait-limit", "nan"}),
              HasSubstr("--wait-limit is 'nan', expected a finite number"));
  // Nothing would be done.
  EXPECT_EQ(with("--generations", "0"),
            "--generations is '0', expected a whole number of at least 1");
  EXPECT_THAT(with("--evaluations", "0"), HasSubstr("expected a whole number"));
  EXPECT_EQ(with("--generations", "1"), "no error");
}

TEST(Usage, NamesTheOptionThatTookTheConfig) {
  EXPECT_EQ(sentence_of({"evolve", "--trials", "log.csv", "c.toml", "--out", "x"}),
            "CONFIG is missing: --trials took 'c.toml' too; put CONFIG before --trials");
  EXPECT_EQ(sentence_of({"evolve", "--trials", "log.csv", "--out", "x"}), "CONFIG is required");
}

TEST(Usage, NoOptionIsTheValueOfAnother) {
  EXPECT_EQ(sentence_of({"evolve", "c.toml", "--out", ""}), "--out: a value is missing");
  EXPECT_EQ(sentence_of({"evolve", "c.toml", "--trials", "--out", "x"}),
            "--trials: a value is missing before '--out'");
  EXPECT_EQ(sentence_of({"evolve", "c.toml", "--out", "--seed"}),
            "--out: a value is missing before '--seed'");
  EXPECT_EQ(sentence_of({"evolve", "c.toml", "--out", "x", "--target", "-3"}), "no error");
}

TEST(Usage, HelpIsACommandToo) {
  EXPECT_EQ(sentence_of({"help", "evolve"}), "help");
  EXPECT_EQ(sentence_of({"help", "keys", "make"}), "help");
}

TEST(Suggest, CountsSwappedLettersAsOneSlip) {
  const std::vector<std::string> known = {"check", "keys", "status"};
  EXPECT_EQ(nearest_word("chekc", known), "check");
  EXPECT_EQ(nearest_word("kesy", known), "keys");
  EXPECT_EQ(nearest_word("cheese", known), "");
}

}  // namespace gapfarm::usage_test
