#include "common/usage/usage.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <regex>

#include "common/base/text.h"

namespace gapfarm {
namespace {

bool is_whole(const std::string& number) { return number.find('.') == std::string::npos; }

std::string shown(const std::string& number) {
  if (is_whole(number)) return number;
  return formatted("%g", std::strtod(number.c_str(), nullptr));
}

// "a whole number from 0 to 4096", of the two ends as CLI11 writes them.
std::string bounds_text(const std::string& lower, const std::string& upper) {
  const double least = std::strtod(lower.c_str(), nullptr);
  const double greatest = std::strtod(upper.c_str(), nullptr);
  if (greatest > 1e300) return least < 0 ? "a finite number" : "a number of at least 0";
  if (is_whole(upper) && greatest > 1e15) return "a whole number of at least " + lower;
  return (is_whole(lower) ? "a whole number from " : "a number from ") + shown(lower) + " to " +
         shown(upper);
}

// "a whole number", of the type name that CLI11 gives an option.
std::string type_names(const std::string& type) {
  if (type.find("UINT") != type.npos) return "a whole number of at least 0";
  if (type.find("INT") != type.npos) return "a whole number";
  if (type.find("FLOAT") != type.npos) return "a number";
  return "another value";
}

const CLI::Option* find_option(const CLI::App& app, const std::string& name) {
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_name() == name || option->get_name(true) == name) return option;
  }
  return nullptr;
}

// An option that takes many values takes the positional ones behind it too.
std::optional<std::string> swallowed(const CLI::App& app, const std::string& missing) {
  if (missing.empty() || missing[0] == '-') return {};
  for (const CLI::Option* option : app.get_options()) {
    const bool many = option->get_expected_max() > 1 && !option->get_positional();
    if (!many || option->results().size() < 2) continue;
    const std::string name = option->get_name();
    return missing + " is missing: " + name + " took '" + option->results().back() + "' too; put " +
           missing + " before " + name;
  }
  return {};
}

bool is_finite(const std::string& text) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  return *end != '\0' || std::isfinite(number);  // what is no number is CLI11's to refuse
}

// Text that roff prints as it is.
std::string roff(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n')) {
      out += std::string("\\&") + c;
    } else {
      out += c;
    }
  }
  return out;
}

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

// Lines as they are, without filling.
std::string verbatim(const std::string& text) {
  if (text.empty()) return "";
  return ".nf\n" + roff(text) + (text.back() == '\n' ? "" : "\n") + ".fi\n";
}

std::string option_entry(const CLI::Option& option) {
  std::string text = ".TP\n.B " + roff(option.get_positional() ? option.get_name(true)
                                                               : option.get_name(false, true));
  const std::string type = option.get_items_expected_max() > 0 ? option.get_type_name() : "";
  // What CLI11 calls a type may be a range: "UINT:INT in [0 - 4096]".
  const std::string word = type.substr(0, type.find_first_of(":{ "));
  if (!option.get_positional() && !word.empty()) text += " " + roff(word);
  text += "\n" + roff(option.get_description());
  if (!option.get_default_str().empty())
    text += " (default: " + roff(option.get_default_str()) + ")";
  return text + "\n";
}

std::string options_of(const CLI::App& app) {
  std::string text;
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_group().empty()) text += option_entry(*option);
  }
  return text;
}

std::vector<const CLI::App*> shown_commands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* sub) { return !sub->get_group().empty(); });
}

void describe_command(const CLI::App& app, const std::string& invocation, std::string& text) {
  text += ".SS " + roff(synopsis(app, invocation)) + "\n" + roff(app.get_description()) + "\n";
  text += options_of(app);
  if (!app.get_footer().empty()) text += ".PP\n" + verbatim(app.get_footer());
  for (const CLI::App* sub : shown_commands(app)) {
    describe_command(*sub, invocation + " " + sub->get_name(), text);
  }
}

}  // namespace

void refuse_wrong_values(CLI::App& app) {
  for (CLI::App* sub : app.get_subcommands({})) refuse_wrong_values(*sub);
  for (CLI::Option* option : app.get_options()) {
    const std::string type = option->get_type_name();
    const bool whole = type.starts_with("UINT");
    const bool number = type.starts_with("FLOAT") || type.starts_with("SECONDS");
    const bool may_be_empty = option->get_positional() || option->get_group().empty();
    option->check(CLI::Validator(
        [=, &app](const std::string& text) -> std::string {
          if (text.empty() && !may_be_empty) return "a value is missing";
          if (text.size() > 1 && text[0] == '-' && app.get_option_no_throw(text) != nullptr) {
            return "a value is missing before '" + text + "'";
          }
          if (number && !is_finite(text)) return "Value " + text + " not in range -1e308 to 1e308";
          errno = 0;
          std::strtoull(text.c_str(), nullptr, 10);
          if (!whole || (!text.starts_with("-") && errno != ERANGE)) return {};
          return "Value " + text + " not in range 0 to 18446744073709551615";
        },
        ""));
  }
}

std::string usage_sentence(const CLI::App& app, const CLI::ParseError& error) {
  const std::string text = error.what();
  std::smatch part;
  static const std::regex out_of_range("(\\S+): Value (.*) not in range (\\S+) to (\\S+)");
  if (std::regex_match(text, part, out_of_range)) {
    std::string expected = bounds_text(part[3], part[4]);
    // The least positive number is CLI11's way of stating more than 0.
    const double least = std::strtod(part[3].str().c_str(), nullptr);
    const CLI::Option* option = find_option(app, part[1]);
    const bool positive = option && option->get_type_name().find("POSITIVE") != std::string::npos;
    if (positive && least == 0) expected = "a number greater than 0";
    return part[1].str() + " is '" + part[2].str() + "', expected " + expected;
  }
  static const std::regex no_number("Could not convert: (\\S+) = (.*)");
  if (std::regex_match(text, part, no_number)) {
    const CLI::Option* option = find_option(app, part[1]);
    return part[1].str() + " is '" + part[2].str() + "', expected " +
           type_names(option ? option->get_type_name() : "");
  }
  static const std::regex required("(\\S+) is required");
  if (std::regex_match(text, part, required)) {
    if (const auto sentence = swallowed(app, part[1])) return *sentence;
  }
  return text;
}

std::string synopsis(const CLI::App& app, const std::string& invocation) {
  std::string text = invocation;
  const auto commands = shown_commands(app);
  if (!commands.empty()) return text + " COMMAND";
  text += " [OPTIONS]";
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_positional()) continue;
    std::string name = option->get_name(true);
    if (option->get_expected_max() > 1) name += "...";
    text += option->get_required() ? " " + name : " [" + name + "]";
  }
  return text;
}

std::string manual_page(const CLI::App& app, const std::string& version) {
  const std::string name = app.get_name();
  std::string summary = app.get_description();
  std::replace(summary.begin(), summary.end(), '\n', ' ');
  if (!summary.empty() && summary.back() == '.') summary.pop_back();
  std::string text = ".TH " + upper(name) + " 1 \"\" \"" + version + "\" \"User Commands\"\n";
  text += ".SH NAME\n" + roff(name) + " \\- " + roff(summary) + "\n";
  text += ".SH SYNOPSIS\n" + roff(synopsis(app, name)) + "\n.SH OPTIONS\n" + options_of(app);
  const auto commands = shown_commands(app);
  if (!commands.empty()) text += ".SH COMMANDS\n";
  for (const CLI::App* sub : commands) {
    describe_command(*sub, name + " " + sub->get_name(), text);
  }
  if (!app.get_footer().empty()) text += ".SH NOTES\n" + verbatim(app.get_footer());
  return text;
}

void add_manual_flag(CLI::App& app, const std::string& version) {
  const auto print = [&app, version] { throw CLI::CallForVersion(manual_page(app, version), 0); };
  app.add_flag_callback("--manual", print)->group("");
}

}  // namespace gapfarm
