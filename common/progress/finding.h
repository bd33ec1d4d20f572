// What a long command has found so far, for those who watch it: what it ends with may differ.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace gapfarm {

struct Finding {
  std::string about;  // "the noise": a later finding about the same takes its place
  std::string text;   // sentences
  // A small table; empty: none.
  std::pair<std::string, std::string> columns;  // what stands above them, with the unit
  std::vector<std::pair<std::string, std::string>> rows;
};

using OnFinding = std::function<void(Finding)>;

}  // namespace gapfarm
