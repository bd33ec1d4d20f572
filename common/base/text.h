// Texts out of numbers and of other texts.
#pragma once

#include <cstdio>
#include <functional>
#include <span>
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

// A word of a shell command, for whoever pastes one: quoted only where a shell would take it for
// more than one word.
std::string shell_quoted(const std::string& word);

// Names as people count them: "run2" before "run10".  Of other characters by their bytes, so that
// letters of UTF-8 come after ASCII's.
bool comes_before(const std::string& a, const std::string& b);

// The known word with the least edit distance (a swap of neighbours is one edit) to `word`, when
// that is at most a third of the longer word's length (at least 1); empty otherwise.
std::string nearest_word(std::string_view word, std::span<const std::string> known);

// "; did you mean 'forward'?" or, when nothing is near, "; known: a, b, c".
std::string suggestion(std::string_view word, std::span<const std::string> known);

}  // namespace gapfarm
