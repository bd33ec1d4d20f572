#include "common/trials/text/csv.h"

#include <algorithm>
#include <boost/locale/utf.hpp>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/base/text.h"
#include "common/pose/pose.h"

namespace gapfarm {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr double kAngleTolerance = 1e-6;  // logs print pi with six digits or so, rounded up

bool is_blank(char c) { return c == ' ' || c == '\t'; }

// Walks over the text once and cuts it into rows.
class Cutter {
 public:
  Cutter(std::string_view text, std::string_view file, char separator)
      : text_(text), file_(file), separator_(separator) {}

  Result<std::vector<CsvRow>> cut() {
    if (text_.substr(0, kByteOrderMark.size()) == kByteOrderMark) at_ = kByteOrderMark.size();
    line_start_ = at_;
    skip_comments();
    std::vector<CsvRow> rows;
    while (at_ < text_.size()) {
      CsvRow row;
      RETURN_IF_ERROR(cut_row(row));
      const bool empty = row.fields.size() == 1 && row.fields[0].text.empty();
      if (!empty) rows.push_back(std::move(row));
    }
    return rows;
  }

 private:
  TextPlace place() const { return {line_, at_ - line_start_ + 1}; }
  bool at_line_end() const {
    if (at_ >= text_.size() || text_[at_] == '\n') return true;
    return text_[at_] == '\r' && (at_ + 1 == text_.size() || text_[at_ + 1] == '\n');
  }
  void next_line() {
    if (at_ < text_.size() && text_[at_] == '\r') ++at_;
    if (at_ < text_.size()) ++at_;
    ++line_;
    line_start_ = at_;
  }
  void skip_comments() {
    while (at_ < text_.size()) {
      const std::string_view line = text_.substr(at_, text_.find('\n', at_) - at_);
      if (!is_comment(line)) return;
      at_ += line.size();
      next_line();
    }
  }
  void skip_blanks() {
    while (at_ < text_.size() && is_blank(text_[at_]) && text_[at_] != separator_) ++at_;
  }

  Status cut_row(CsvRow& row) {
    while (true) {
      skip_blanks();
      CsvField field;
      field.place = place();
      if (at_ < text_.size() && text_[at_] == '"') {
        RETURN_IF_ERROR(cut_quoted(field));
      } else {
        const std::size_t begin = at_;
        while (!at_line_end() && text_[at_] != separator_) ++at_;
        field.text = trimmed(text_.substr(begin, at_ - begin));
      }
      row.fields.push_back(std::move(field));
      row.end = place();
      if (at_line_end()) {
        next_line();
        return {};
      }
      ++at_;  // the separator
    }
  }

  Status cut_quoted(CsvField& field) {
    ++at_;
    while (true) {
      if (at_ >= text_.size()) {
        return text_error(file_, field.place, "an unclosed quote", "a closing '\"'",
                          "close it, or double a quote that belongs to the text");
      }
      const char c = text_[at_++];
      if (c == '"') {
        if (at_ >= text_.size() || text_[at_] != '"') break;
        ++at_;
      } else if (c == '\n') {
        ++line_;
        line_start_ = at_;
      }
      field.text += c;
    }
    skip_blanks();
    if (at_line_end() || text_[at_] == separator_) return {};
    return text_error(file_, place(), quoted_word(text_.substr(at_, 1)),
                      "a separator or the end of the line after a closing quote",
                      "double a quote that belongs to the text");
  }

  std::string_view text_;
  std::string_view file_;
  char separator_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
  std::size_t line_start_ = 0;
};

// Overlong forms and surrogates are none, since protobuf strings refuse them.
Status check_utf8(std::string_view text, std::string_view file) {
  namespace utf = boost::locale::utf;
  TextPlace place;
  const char* line_start = text.begin();
  for (const char* at = text.begin(); at != text.end();) {
    const char* const begin = at;
    if (!utf::is_valid_codepoint(utf::utf_traits<char>::decode(at, text.end()))) {
      place.column = static_cast<std::size_t>(begin - line_start) + 1;
      return text_error(file, place, "a byte that is not UTF-8", "UTF-8 text",
                        "save the file as UTF-8");
    }
    if (*begin != '\n') continue;
    ++place.line;
    line_start = at;
  }
  return {};
}

}  // namespace

Error text_error(std::string_view file, TextPlace place, std::string_view found,
                 std::string_view expected, std::string_view remedy) {
  std::string message = std::string(file) + ":" + std::to_string(place.line) + ":" +
                        std::to_string(place.column) + ": found " + std::string(found) +
                        ", expected " + std::string(expected);
  if (!remedy.empty()) message += "; " + std::string(remedy);
  return {message};
}

std::string number_range(double lower, double upper, std::string_view unit) {
  std::string text = "a number";
  if (std::isfinite(lower) && std::isfinite(upper)) {
    text += " in [" + format_double(lower) + ", " + format_double(upper) + "]";
  } else if (std::isfinite(lower)) {
    text += " of at least " + format_double(lower);
  }
  if (!unit.empty()) text += " " + std::string(unit);
  return text;
}

std::string quoted_word(std::string_view word) {
  constexpr std::size_t kLongest = 40;
  constexpr char kHex[] = "0123456789abcdef";
  std::string text = "'";
  for (const char c : word.substr(0, kLongest)) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte >= 0x7f) {
      text += {'\\', 'x', kHex[byte >> 4], kHex[byte & 15]};
    } else {
      text += c;
    }
  }
  return text + (word.size() > kLongest ? "...'" : "'");
}

bool is_comment(std::string_view line) {
  if (line.empty() || line[0] != '#') return false;
  return line.substr(0, 6) == "# log:" || line.find(',') == line.npos;
}

Result<std::vector<CsvRow>> parse_separated(std::string_view text, std::string_view file,
                                            char separator) {
  RETURN_IF_ERROR(check_utf8(text, file));
  return Cutter(text, file, separator).cut();
}

std::string csv_field(std::string_view text) {
  const bool blank_edge = trimmed(text).size() != text.size();
  if (!blank_edge && text.find_first_of(",\"\r\n") == std::string_view::npos) {
    return std::string(text);
  }
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

std::optional<double> parse_double(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code == std::errc::invalid_argument || end != text.data() + text.size()) return {};
  // Too great or too small for a double: the former is infinite for every purpose here.
  if (code == std::errc::result_out_of_range) {
    const bool tiny = text.find("e-") != text.npos || text.find("E-") != text.npos;
    return tiny ? 0.0 : std::numeric_limits<double>::infinity();
  }
  return value;
}

std::optional<std::int64_t> parse_integer(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  std::int64_t value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc{} || end != text.data() + text.size()) return {};
  return value;
}

std::string format_double(double value) {
  char buffer[32];
  const auto [end, code] = std::to_chars(buffer, buffer + sizeof buffer, value);
  return code == std::errc{} ? std::string(buffer, end) : std::string("nan");
}

namespace {

std::string listed_names(const std::vector<std::string>& names) {
  return joined(names, ", ", quoted_word);
}

// `names`: of the row's columns.
Error missing_columns(const CsvRow& row, const std::vector<std::string>& names,
                      const std::vector<std::string>& missing,
                      std::span<const std::string> required, std::string_view file,
                      std::string_view format) {
  std::vector<std::string> others;
  for (const std::string& name : names) {
    const bool known = std::find(required.begin(), required.end(), name) != required.end();
    if (!known) others.push_back(name);
  }
  // A column with nearly that name is most likely a slip of the pen: point at it.
  const std::string near = nearest_word(missing.front(), others);
  if (missing.size() == 1 && !near.empty()) {
    const auto i = std::find(names.begin(), names.end(), near) - names.begin();
    return text_error(file, row.fields[static_cast<std::size_t>(i)].place,
                      "column " + quoted_word(near) + " but no column '" + missing.front() + "'",
                      "column '" + missing.front() + "'", "rename it");
  }
  const std::string columns =
      (missing.size() == 1 ? "column " : "columns ") + listed_names(missing);
  const std::string remedy =
      others.empty() ? (missing.size() == 1 ? "add it to every row" : "add them to every row")
                     : "columns here beyond those of the format: " + listed_names(others) +
                           "; rename what is one of them, or add it to every row";
  return text_error(file, row.end, "no " + columns, columns + " of " + std::string(format), remedy);
}

}  // namespace

Result<CsvHeader> CsvHeader::match(const CsvRow& row, std::span<const std::string> required,
                                   std::string_view file, std::string_view format) {
  CsvHeader header;
  header.width_ = row.fields.size();
  std::vector<std::string> names;
  for (const CsvField& field : row.fields) {
    if (field.text.empty()) {
      return text_error(file, field.place, "a column without a name", "a name",
                        "name the column or remove it and its fields");
    }
    if (std::find(names.begin(), names.end(), field.text) != names.end()) {
      return text_error(file, field.place, "column " + quoted_word(field.text) + " again",
                        "each column once", "rename or remove one of the two");
    }
    names.push_back(field.text);
  }
  std::vector<std::string> missing;
  for (const std::string& name : required) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) missing.push_back(name);
    header.positions_.push_back(static_cast<std::size_t>(found - names.begin()));
  }
  if (!missing.empty()) return missing_columns(row, names, missing, required, file, format);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (std::find(required.begin(), required.end(), names[i]) == required.end()) {
      header.extra_.push_back(i);
    }
  }
  return header;
}

Status check_width(const CsvRow& row, const CsvHeader& header, std::string_view file) {
  if (row.fields.size() == header.width()) return {};
  const bool more = row.fields.size() > header.width();
  return text_error(file, more ? row.fields[header.width()].place : row.end,
                    std::to_string(row.fields.size()) + " fields",
                    std::to_string(header.width()) + " as in the header",
                    more ? "quote a field that holds a comma; decimals are written with a point"
                         : "leave unknown values empty, but keep their commas");
}

void CsvRowReader::fail(std::size_t column, std::string_view found, std::string_view expected,
                        std::string_view remedy) {
  if (std::find(failed_.begin(), failed_.end(), column) != failed_.end()) return;
  failed_.push_back(column);
  errors_.push_back(text_error(file_, field(column).place,
                               names_[column] + " " + std::string(found), expected, remedy));
}

std::string CsvRowReader::word(std::size_t column) {
  const std::string& text = field(column).text;
  if (text.empty()) fail(column, "empty", "a name", "fill it in");
  return text;
}

std::int64_t CsvRowReader::integer(std::size_t column) {
  const std::optional<std::int64_t> value = parse_integer(field(column).text);
  if (!value) {
    fail(column, quoted_word(field(column).text), "an integer", "number the trials 0, 1, 2, ...");
  }
  return value.value_or(0);
}

double CsvRowReader::number(std::size_t column, double lower, double upper, const char* unit) {
  const std::string& text = field(column).text;
  const std::optional<double> value = parse_double(text);
  if (!value) {
    fail(column, text.empty() ? "empty" : quoted_word(text), number_range(lower, upper, unit),
         "write decimals with a point, without units");
    return 0;
  }
  if (!std::isfinite(*value)) {
    fail(column, quoted_word(text), "a finite number",
         "remove trials that were not measured from the file");
    return 0;
  }
  if (*value < lower || *value > upper) {
    fail(column, text, number_range(lower, upper, unit), "check the column's unit");
    return 0;
  }
  return *value;
}

std::optional<double> CsvRowReader::optional_number(std::size_t column, double lower, double upper,
                                                    const char* unit) {
  if (field(column).text.empty()) return {};
  return number(column, lower, upper, unit);
}

double CsvRowReader::coordinate(std::size_t column) {
  return number(column, -kGreatestCoordinate_m, kGreatestCoordinate_m, "m");
}

double CsvRowReader::angle(std::size_t column) {
  const std::string& text = field(column).text;
  const std::optional<double> value = parse_double(text);
  if (value && std::isfinite(*value) && std::abs(*value) > std::numbers::pi + kAngleTolerance) {
    fail(column, text, "an angle in (-pi, pi] rad",
         "wrap it; degrees are multiplied by pi/180 first");
    return 0;
  }
  const double limit = std::numbers::pi + kAngleTolerance;
  return wrap_angle(number(column, -limit, limit, "rad"));
}

}  // namespace gapfarm
