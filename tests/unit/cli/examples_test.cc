// Every example in every --help is one of its own command, and a command line that is understood.
#include <gmock/gmock.h>

#include <filesystem>
#include <set>
#include <sstream>

#include "master/cli/subcommand.h"

namespace gapfarm::examples_test {

using testing::HasSubstr;
using testing::StartsWith;

// The words of a shell line up to a comment or a pipe, quotes taken off.
std::vector<std::string> tokens_of(const std::string& line) {
  std::vector<std::string> arguments;
  bool open = false;
  char quote = 0;
  for (const char c : line) {
    if (quote != 0) {
      if (c == quote) {
        quote = 0;
      } else {
        arguments.back() += c;
      }
      continue;
    }
    if (!open && (c == '#' || c == '|')) break;
    if (c == ' ') {
      open = false;
      continue;
    }
    if (!open) arguments.emplace_back();
    open = true;
    if (c == '\'' || c == '"') {
      quote = c;
    } else {
      arguments.back() += c;
    }
  }
  return arguments;
}

std::vector<std::string> examples_in(const std::string& footer) {
  std::string text = footer.substr(std::min(footer.size(), footer.find("Examples:\n")));
  for (std::size_t at; (at = text.find("\\\n")) != text.npos;) text.erase(at, 2);
  std::vector<std::string> examples;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("  gapfarm ", 0) == 0) examples.push_back(line);
  }
  return examples;
}

void check(const CLI::App& app, const std::string& command, bool leaf) {
  const std::vector<std::string> examples = examples_in(app.get_footer());
  EXPECT_FALSE(examples.empty()) << command;
  for (const std::string& example : examples) {
    if (leaf) {
      EXPECT_THAT(example, StartsWith("  " + command)) << "not its own";
    }
    std::vector<std::string> arguments = tokens_of(example);
    arguments.erase(arguments.begin());
    for (const std::string& word : arguments) {
      const bool shipped = word.rfind("configs/", 0) == 0;
      if (shipped) {
        EXPECT_TRUE(std::filesystem::exists(std::string(GAPFARM_SOURCE_DIR) + "/" + word)) << word;
      }
    }
    const std::unique_ptr<Program> program = make_program();
    try {
      parse_arguments(*program, arguments);
    } catch (const CLI::ParseError& error) {
      ADD_FAILURE() << example << "\n" << error.what();
    }
  }
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    check(*sub, command + " " + sub->get_name(), true);
  }
}

TEST(CliExamples, AreEachCommandsOwnAndAreUnderstood) {
  const std::unique_ptr<Program> program = make_program();
  check(*program->app, "gapfarm", false);
}

TEST(CliExamples, EveryCommandTakesJson) {
  const std::unique_ptr<Program> program = make_program();
  for (const CLI::App* sub : program->app->get_subcommands([](const CLI::App*) { return true; })) {
    const bool leaf = sub->get_subcommands([](const CLI::App*) { return true; }).empty();
    EXPECT_EQ(sub->get_option_no_throw("--json") != nullptr, leaf) << sub->get_name();
  }
}

}  // namespace gapfarm::examples_test
