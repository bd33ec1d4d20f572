// An objective for gapfarm in C++: this header, a function, no library (docs/objective.md).
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

namespace gapfarm {

struct Answer {
  double value = 0;                // not finite: the evaluation failed
  std::vector<double> violations;  // above 0: violated
  // Of several objectives: their names and values, in place of `value`.
  std::vector<std::pair<std::string, double>> values = {};
};

// A line of the protocol.  Keys are letters, digits and _, so none hides in a choice's text.
class Question {
 public:
  explicit Question(std::string line) : line_(std::move(line)) {}

  bool has(const std::string& key) const { return at(key) != nullptr; }
  double number(const std::string& key) const { return has(key) ? std::atof(at(key)) : NAN; }
  // A choice without quotes or backslashes in it.
  std::string choice(const std::string& key) const {
    if (!has(key)) return "";
    const std::string text = at(key) + 1;
    return text.substr(0, text.find('"'));
  }
  std::uint32_t seed() const { return static_cast<std::uint32_t>(number("seed")); }

 private:
  const char* at(const std::string& key) const {
    const std::size_t found = line_.find('"' + key + "\":");
    return found == line_.npos ? nullptr : line_.c_str() + found + key.size() + 3;
  }
  std::string line_;
};

// `parameters`: the JSON of what is declared, without the list's brackets.
template <class Function>
int serve(const std::string& name, const std::string& parameters, const Function& function) {
  for (std::string line; std::getline(std::cin, line);) {
    const Question question(line);
    if (!question.has("id")) {
      std::cout << R"({"gapfarm":1,"name":")" << name << R"(","parameters":[)" << parameters << "]}"
                << std::endl;
      continue;
    }
    const Answer answer = function(question);
    const auto number = [](double value) {
      char text[32];
      std::snprintf(text, sizeof text, "%.17g", value);
      return std::string(std::isfinite(value) ? text : "null");
    };
    std::string reply = R"({"id":)" + std::to_string(std::uint64_t(question.number("id"))) +
                        R"(,"value":)" + number(answer.value) + R"(,"violations":[)";
    for (std::size_t i = 0; i < answer.violations.size(); ++i) {
      reply += (i == 0 ? "" : ",") + number(answer.violations[i]);
    }
    reply += "]";
    for (std::size_t i = 0; i < answer.values.size(); ++i) {
      reply += (i == 0 ? R"(,"values":{")" : R"(,")") + answer.values[i].first +
               "\":" + number(answer.values[i].second);
    }
    std::cout << reply << (answer.values.empty() ? "}" : "}}") << std::endl;
  }
  return 0;
}

}  // namespace gapfarm
