// Which stage is on, and how long each took.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace gapfarm {

class StageClock {
 public:
  explicit StageClock(std::function<void(const std::string&)> on_stage)
      : on_stage_(std::move(on_stage)) {}

  // Ends the present one; empty: none begins.
  void begin(const std::string& name) {
    const auto now = std::chrono::steady_clock::now();
    if (!present.empty()) {
      timing_s.emplace_back(present, std::chrono::duration<double>(now - began_).count());
    }
    present = name;
    began_ = now;
    if (on_stage_ && !name.empty()) on_stage_(name);
  }

  std::string present;
  std::vector<std::pair<std::string, double>> timing_s;

 private:
  std::function<void(const std::string&)> on_stage_;
  std::chrono::steady_clock::time_point began_;
};

}  // namespace gapfarm
