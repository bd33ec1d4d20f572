// Names as people count them: "run2" before "run10".
#pragma once

#include <string>

namespace gapfarm {

// Of other characters by their bytes, so that letters of UTF-8 come after ASCII's.
inline bool comes_before(const std::string& a, const std::string& b) {
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!digit(a[i]) || !digit(b[j])) {
      if (a[i] != b[j]) return std::char_traits<char>::lt(a[i], b[j]);
      ++i;
      ++j;
      continue;
    }
    const auto number = [&](const std::string& text, std::size_t* at) {
      while (*at < text.size() && text[*at] == '0') ++*at;
      const std::size_t from = *at;
      while (*at < text.size() && digit(text[*at])) ++*at;
      return text.substr(from, *at - from);
    };
    const std::string x = number(a, &i), y = number(b, &j);
    if (x != y) return x.size() != y.size() ? x.size() < y.size() : x < y;
  }
  return a.size() - i != b.size() - j ? a.size() - i < b.size() - j : a < b;
}

}  // namespace gapfarm
