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

inline std::string lowered(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

// Without the blanks and line ends about it.
inline std::string_view trimmed(std::string_view text) {
  constexpr const char* kBlanks = " \t\r\n";
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == text.npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

}  // namespace gapfarm
