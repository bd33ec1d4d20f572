// Texts out of numbers and of other texts.
#pragma once

#include <cstdio>
#include <functional>
#include <string>
#include <string_view>

namespace gapfarm {

// As printf writes it, up to 199 characters.
template <class... Values>
std::string formatted(const char* format, Values... values) {
  char text[200];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

// What `of` makes of every item, with `between` between them.
template <class Range, class Of = std::identity>
std::string joined(const Range& items, std::string_view between = ", ", Of of = {}) {
  std::string all;
  for (auto&& item : items) {
    if (!all.empty()) all += between;
    all += std::invoke(of, item);
  }
  return all;
}

}  // namespace gapfarm
