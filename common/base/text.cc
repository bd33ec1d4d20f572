#include "common/base/text.h"

#include <algorithm>
#include <cctype>
#include <ctime>
#include <numeric>

namespace gapfarm {
namespace {

// Insertions, deletions, substitutions and swaps of neighbours (optimal string alignment), since
// fingers swap as often as they slip.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before, last, row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before = std::move(last);
    last = row;
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substitute = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, substitute});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row.back();
}

}  // namespace

std::vector<std::string_view> parts_of(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (std::size_t end = 0; end != text.npos; text.remove_prefix(std::min(end + 1, text.size()))) {
    end = text.find(separator);
    parts.push_back(text.substr(0, end));
  }
  return parts;
}

std::vector<std::string_view> lines_of(std::string_view text) {
  std::vector<std::string_view> lines = parts_of(text, '\n');
  if (lines.back().empty()) lines.pop_back();
  for (std::string_view& line : lines) {
    if (line.ends_with('\r')) line.remove_suffix(1);
  }
  return lines;
}

std::vector<std::string_view> tokens_of(std::string_view text) {
  constexpr const char* kBlanks = " \t\r\n";
  std::vector<std::string_view> tokens;
  for (std::size_t at = text.find_first_not_of(kBlanks); at != text.npos;) {
    const std::size_t end = std::min(text.find_first_of(kBlanks, at), text.size());
    tokens.push_back(text.substr(at, end - at));
    at = text.find_first_not_of(kBlanks, end);
  }
  return tokens;
}

std::pair<std::string, std::optional<std::string>> cut_at(std::string_view text, char mark) {
  const std::size_t at = text.find(mark);
  if (at == text.npos) return {std::string(text), {}};
  return {std::string(text.substr(0, at)), std::string(text.substr(at + 1))};
}

std::string shell_quoted(const std::string& word) {
  const auto plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) ||
           std::string("_-./:=@%+,").find(c) != std::string::npos;
  };
  if (!word.empty() && std::all_of(word.begin(), word.end(), plain)) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

bool comes_before(const std::string& a, const std::string& b) {
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

std::string nearest_word(std::string_view word, std::span<const std::string> known) {
  std::string best;
  std::size_t best_distance = std::string::npos;
  for (const std::string& candidate : known) {
    const std::size_t limit = std::max<std::size_t>(1, std::max(word.size(), candidate.size()) / 3);
    const std::size_t distance = edit_distance(word, candidate);
    if (distance <= limit && distance < best_distance) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

std::string suggestion(std::string_view word, std::span<const std::string> known) {
  const std::string near = nearest_word(word, known);
  if (!near.empty()) return "; did you mean '" + near + "'?";
  return "; known: " + joined(known);
}

std::string format_duration(double seconds) {
  if (!(seconds >= 0) || seconds > 1e9) return "?";
  if (seconds < 9.95) return formatted("%.1f s", seconds);
  const long whole = std::lround(seconds);
  if (whole < 60) return formatted("%ld s", whole);
  if (whole < 3600) return formatted("%ld min %02ld s", whole / 60, whole % 60);
  return formatted("%ld h %02ld min", whole / 3600, whole / 60 % 60);
}

std::string utc_text(double unix_s, const char* format) {
  const auto seconds = static_cast<std::time_t>(unix_s);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char text[40];
  return {text, std::strftime(text, sizeof text, format, &utc)};
}

std::string format_share(double share) {
  const double percent = 100 * std::clamp(share, 0.0, 1.0);
  if (percent > 0 && percent < 0.95) return formatted("%.1f %%", percent);
  // Never "100 %" before the end.
  return formatted("%.0f %%", share < 1 ? std::min(99.0, std::round(percent)) : 100.0);
}

std::string format_number(const std::optional<double>& value, int digits) {
  return value ? formatted("%.*g", digits, *value) : "-";
}

std::string rate_text(double rate_per_s) {
  return rate_per_s > 0 ? formatted(", %.3g/s", rate_per_s) : "";
}

std::string progress_text(std::string_view what, double rate_per_s,
                          std::optional<double> time_left_s) {
  std::string text = std::string(what) + rate_text(rate_per_s);
  if (time_left_s) text += ", about " + format_duration(*time_left_s) + " left";
  return text;
}

}  // namespace gapfarm
