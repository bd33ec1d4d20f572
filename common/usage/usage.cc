#include "common/usage/usage.h"

#include <cmath>
#include <cstdlib>
#include <optional>
#include <regex>

namespace gapfarm {
namespace {

bool is_whole(const std::string& number) { return number.find('.') == std::string::npos; }

std::string shown(const std::string& number) {
  if (is_whole(number)) return number;
  char text[32];
  std::snprintf(text, sizeof text, "%g", std::strtod(number.c_str(), nullptr));
  return text;
}

// "a whole number from 0 to 4096", of the two ends as CLI11 writes them.
std::string bounds_text(const std::string& lower, const std::string& upper) {
  const double least = std::strtod(lower.c_str(), nullptr);
  const double greatest = std::strtod(upper.c_str(), nullptr);
  if (greatest > 1e300) return least < 0 ? "a number" : "a number of at least 0";
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

}  // namespace

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

}  // namespace gapfarm
