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

// A line of the protocol: {"id":1,"parameters":{...},"seed":2}.  Keys are letters, digits and _, so
// none hides in a choice's text.
class Question {
 public:
  explicit Question(const std::string& line) {
    const std::string key = "\"parameters\":";
    const std::size_t begin = line.find(key), end = line.rfind("\"seed\":");
    if (begin == line.npos || end == line.npos) return;  // it is asked what it has
    asks_ = true;
    parameters_ = line.substr(begin + key.size(), end - begin - key.size());
    id_ = std::strtoull(after(line, line.find("\"id\":")), nullptr, 10);
    seed_ = static_cast<std::uint32_t>(std::strtoull(after(line, end), nullptr, 10));
  }

  bool asks() const { return asks_; }
  std::uint64_t id() const { return id_; }
  std::uint32_t seed() const { return seed_; }
  bool has(const std::string& key) const { return at(key) != nullptr; }
  double number(const std::string& key) const { return has(key) ? std::atof(at(key)) : NAN; }
  // A choice without quotes or backslashes in it.
  std::string choice(const std::string& key) const {
    if (!has(key)) return "";
    const std::string text = at(key) + 1;
    return text.substr(0, text.find('"'));
  }

 private:
  static const char* after(const std::string& line, std::size_t key) {
    return key == line.npos ? "" : line.c_str() + line.find(':', key) + 1;
  }
  const char* at(const std::string& key) const {
    const std::size_t found = parameters_.find('"' + key + "\":");
    return found == parameters_.npos ? nullptr : parameters_.c_str() + found + key.size() + 3;
  }
  bool asks_ = false;
  std::uint64_t id_ = 0;
  std::uint32_t seed_ = 0;
  std::string parameters_;
};

// `parameters`: the JSON of what is declared, without the list's brackets.
template <class Function>
int serve(const std::string& name, const std::string& parameters, const Function& function) {
  for (std::string line; std::getline(std::cin, line);) {
    const Question question(line);
    if (!question.asks()) {
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
    std::string reply = R"({"id":)" + std::to_string(question.id()) + R"(,"value":)" +
                        number(answer.value) + R"(,"violations":[)";
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
