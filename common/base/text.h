// Texts out of numbers and of other texts.
#pragma once

#include <charconv>
#include <cmath>
#include <cstdio>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace gapfarm {

// As printf writes it, up to 199 characters.
template <class... Values>
std::string formatted(const char* format, Values... values) {
  char text[200];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

// "0.52 m [0.5, 0.54]", each number by printf's `format`.
inline std::string with_interval(const char* format, double value, double lo, double hi,
                                 std::string_view unit = "") {
  std::string text = formatted(format, value);
  if (!unit.empty()) text.append(" ").append(unit);
  return text + " [" + formatted(format, lo) + ", " + formatted(format, hi) + "]";
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

// What lies between separators: one part more than there are of these.
std::vector<std::string_view> parts_of(std::string_view text, char separator);
// Without their ends, "\n" or "\r\n".
std::vector<std::string_view> lines_of(std::string_view text);
// Between blanks, tabs and line ends.
std::vector<std::string_view> tokens_of(std::string_view text);
// "KEY=VALUE" at its first mark; no second part where there is none.
std::pair<std::string, std::optional<std::string>> cut_at(std::string_view text, char mark);

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

// The number that `value` is when it is written with so many significant digits: small values do
// not vanish, and its shortest text is no longer.  0 digits: as it is.
inline double rounded_to_digits(double value, int digits) {
  if (digits <= 0 || !std::isfinite(value)) return value;
  char text[64];
  const auto end =
      std::to_chars(text, text + sizeof text, value, std::chars_format::scientific, digits - 1);
  std::from_chars(text, end.ptr, value);
  return value;
}

// "1 h 02 min", "3 min 20 s", "12 s", "0.4 s"; "?" for what is no time.
std::string format_duration(double seconds);

// In UTC, as strftime() writes it, up to 39 characters.
std::string utc_text(double unix_s, const char* format);

// "0 %", "0.4 %", "37 %"; "100 %" only for all of it.
std::string format_share(double share);

// Six significant digits, "-" for none.
std::string format_number(const std::optional<double>& value, int digits = 6);
// ", 210/s"; "" while there is none.
std::string rate_text(double rate_per_s);
// "generation 41 of 100, 210/s, about 12 s left": the text of a progress line.
std::string progress_text(std::string_view what, double rate_per_s,
                          std::optional<double> time_left_s);

}  // namespace gapfarm
