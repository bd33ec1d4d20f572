#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "common/base/text.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

constexpr std::size_t kLookedAt = 50;  // lines: a head and enough of the numbers
constexpr std::size_t kMostHeads = 5;  // rows above the numbers
constexpr double kMostlyUnits = 0.5;   // of a row's words, for it to be one of units

// How often each separator stands in a line, outside quotes.
std::array<std::size_t, 3> count_separators(std::string_view line, std::string_view separators) {
  std::array<std::size_t, 3> counts{};
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') quoted = !quoted;
    const std::size_t at = separators.find(c);
    if (!quoted && at != separators.npos) ++counts[at];
  }
  return counts;
}

bool is_unit(std::string text) {
  if (text.size() > 2 && (text.front() == '[' || text.front() == '(')) {
    text = text.substr(1, text.size() - 2);
  }
  static const std::set<std::string> kText = {
      "s",     "sec",    "ms",  "us",   "ns",    "m",      "cm",    "mm",      "px",   "pix",
      "pixel", "pixels", "rad", "mrad", "deg",   "m/s",    "cm/s",  "mm/s",    "km/h", "rad/s",
      "deg/s", "rpm",    "%",   "1",    "-",     "A",      "mA",    "V",       "mV",   "N",
      "Nm",    "W",      "Hz",  "K",    "ticks", "counts", "m/s^2", "rad/s^2", "bool", "degC"};
  return kText.count(text) != 0;
}

bool has_number(const CsvRow& row, char separator) {
  return std::any_of(row.fields.begin(), row.fields.end(), [&](const CsvField& field) {
    return field.text == "true" || field.text == "false" || field.text == "True" ||
           field.text == "False" || parse_decimal(field.text, separator).has_value();
  });
}

std::size_t text_in(const CsvRow& row) {
  return static_cast<std::size_t>(std::count_if(row.fields.begin(), row.fields.end(),
                                                [](const CsvField& f) { return !f.text.empty(); }));
}

bool are_units(const CsvRow& row) {
  const auto units = std::count_if(row.fields.begin(), row.fields.end(),
                                   [](const CsvField& f) { return is_unit(f.text); });
  return static_cast<double>(units) > kMostlyUnits * static_cast<double>(text_in(row));
}

bool are_unique(const CsvRow& row) {
  std::set<std::string> seen;
  return std::ranges::all_of(
      row.fields, [&](const CsvField& f) { return f.text.empty() || seen.insert(f.text).second; });
}

}  // namespace

char find_separator(std::string_view text) {
  constexpr std::string_view kSeparators = ";\t,";
  std::array<std::map<std::size_t, std::size_t>, 3> lines_with;
  std::array<std::size_t, 3> first{};
  std::size_t lines = 0;
  for (std::size_t at = 0; at < text.size() && lines < kLookedAt;) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string_view line = text.substr(at, end - at);
    at = end + 1;
    if (line.find_first_not_of(" \r") == line.npos || is_comment(line)) continue;
    const auto counts = count_separators(line, kSeparators);
    if (lines++ == 0) first = counts;
    for (std::size_t k = 0; k < counts.size(); ++k) ++lines_with[k][counts[k]];
  }
  char best = ',';
  std::size_t most = 0;
  for (std::size_t k = 0; k < first.size(); ++k) {
    if (first[k] == 0 || lines_with[k][first[k]] <= most) continue;
    most = lines_with[k][first[k]];
    best = kSeparators[k];
  }
  return best;
}

Result<std::vector<CsvRow>> parse_csv(std::string_view text, std::string_view file) {
  return parse_separated(text, file, ',');
}

std::optional<double> parse_decimal(std::string_view text, char separator) {
  if (const auto value = parse_double(text)) return value;
  const std::size_t comma = text.find(',');
  const bool decimal = separator != ',' && comma != text.npos &&
                       text.find_first_of(",.", comma + 1) == text.npos &&
                       text.find('.') == text.npos;
  if (!decimal) return {};
  std::string point(text);
  point[comma] = '.';
  return parse_double(point);
}

TableHead read_head(const std::vector<CsvRow>& rows, char separator) {
  TableHead head;
  head.names = rows.front().fields;
  std::size_t end = 1;
  while (end < rows.size() && end < kMostHeads && text_in(rows[end]) > 0 &&
         rows[end].fields.size() == rows.front().fields.size() &&
         !has_number(rows[end], separator)) {
    ++end;
  }
  // Words to the end are the rows of a table of words.
  if (end == 1 || end == rows.size() || end == kMostHeads) return head;
  if (text_in(rows[end]) == 0 || !has_number(rows[end], separator)) return head;
  head.rows = end;
  for (std::size_t r = 1; r < end; ++r) {
    if (are_units(rows[r])) {
      head.units = rows[r].fields;
    } else if (are_unique(rows[r]) && text_in(rows[r]) >= text_in(rows.front())) {
      head.titles = rows.front().fields;
      head.names = rows[r].fields;
    }
  }
  return head;
}

Status check_decimals(const std::vector<CsvRow>& rows, std::size_t first, char separator,
                      const std::string& file) {
  const CsvField* point = nullptr;
  const CsvField* comma = nullptr;
  for (std::size_t r = first; r < rows.size() && separator != ','; ++r) {
    for (const CsvField& field : rows[r].fields) {
      if (!parse_decimal(field.text, separator)) continue;
      if (field.text.find('.') != std::string::npos && point == nullptr) point = &field;
      if (field.text.find(',') != std::string::npos && comma == nullptr) comma = &field;
    }
  }
  if (point == nullptr || comma == nullptr) return {};
  return text_error(file, comma->place, quoted_word(comma->text),
                    "decimal points, as in " + quoted_word(point->text) + " in line " +
                        std::to_string(point->place.line),
                    "write all decimals alike, and no separators of thousands");
}

std::string blanks_to_commas(std::string_view text) {
  std::string out;
  bool numbers = false;
  for (const std::string_view line : lines_of(text)) {
    if (line.find_first_of(",;\"\t") != line.npos) return "";
    std::vector<std::string_view> tokens = tokens_of(line);
    if (!tokens.empty() && (tokens[0][0] == '#' || tokens[0][0] == '%')) {
      tokens[0].remove_prefix(1);
      if (tokens[0].empty()) tokens.erase(tokens.begin());
      if (out.find_first_not_of('\n') != out.npos) tokens.clear();
    }
    if (tokens.size() == 1) return "";
    for (std::size_t i = 0; i < tokens.size(); ++i) {
      numbers = numbers || parse_double(tokens[i]);
      out += (i == 0 ? "" : ",") + std::string(tokens[i]);
    }
    out += '\n';
  }
  return numbers ? out : "";
}

}  // namespace gapfarm
