#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <limits>

#include "common/base/ranges.h"
#include "common/base/try.h"
#include "common/trials/dialect.h"
#include "common/trials/format.h"
#include "common/trials/text/csv.h"
#include "master/io/logs/log_table.h"

namespace gapfarm {
namespace {

constexpr double kBlank = std::numeric_limits<double>::quiet_NaN();
// 2026-01-31T12:00:00.5Z or ...+01:00 as seconds since 1970; without a zone it is taken for UTC.
std::optional<double> iso_time(std::string text) {
  std::tm at{}, zone{};
  if (text.size() > 10 && text[10] == 'T') text[10] = ' ';
  const char* rest = strptime(text.c_str(), "%Y-%m-%d %H:%M:%S", &at);
  char* end = nullptr;
  const double part = rest != nullptr && *rest == '.' ? std::strtod(rest, &end) : 0;
  if (end != nullptr) rest = end;
  if (rest != nullptr && *rest != 0) rest = strptime(rest, "%z", &zone);
  if (rest == nullptr || *rest != 0) return {};
  return static_cast<double>(timegm(&at) - zone.tm_gmtoff) + part;
}

// Words in cells that mean true or nothing; other words make a column one of words.
double number_of(const std::string& text, char separator = ',') {
  if (const auto value = parse_decimal(text, separator)) {
    return std::isfinite(*value) ? *value : kBlank;
  }
  if (const auto time = iso_time(text)) return *time;
  if (text == "true" || text == "True") return 1;
  if (text == "false" || text == "False") return 0;
  return kBlank;
}

bool is_number(const std::string& text) { return parse_double(text).has_value(); }

std::string_view first_line(std::string_view text) {
  if (text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);
  return text.substr(0, text.find_first_of("\r\n"));
}

std::vector<std::string_view> tokens_of(std::string_view line) {
  std::vector<std::string_view> tokens;
  for (std::size_t at = line.find_first_not_of(" \t"); at != line.npos;) {
    const std::size_t end = std::min(line.find_first_of(" \t", at), line.size());
    tokens.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(" \t", end);
  }
  return tokens;
}

// `t x y z qx qy qz qw`, blanks between, comments with '#'.
Result<Recording> parse_tum(std::string_view text, const std::string& file) {
  LogTable table{file, "", "tum", {"t", "x", "y", "z", "qx", "qy", "qz", "qw"}, {}};
  std::size_t line_number = 0;
  for (std::size_t at = 0; at < text.size(); ++line_number) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string_view line = text.substr(at, end - at);
    at = end + 1;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    const std::vector<std::string_view> tokens = tokens_of(line);
    if (tokens.empty() || tokens[0][0] == '#') continue;
    if (tokens.size() != 8) {
      return text_error(file, {line_number + 1, 1}, std::to_string(tokens.size()) + " numbers",
                        "8 (t x y z qx qy qz qw)", "check the line");
    }
    for (const std::string_view word : tokens) {
      const auto value = parse_double(word);
      if (!value || !std::isfinite(*value)) {
        return text_error(file, {line_number + 1, 1}, quoted_word(word), "a number",
                          "remove poses that were not measured");
      }
      table.values.push_back(*value);
    }
  }
  if (table.values.empty()) return text_error(file, {}, "no poses", "lines t x y z qx qy qz qw");
  return Recording{file, "a TUM trajectory", {std::move(table)}, "", {}};
}

// Seven lines of header: bodies in line 4, kinds in line 6, names in line 7.
Result<Recording> parse_motive(const std::vector<CsvRow>& rows, const std::string& file) {
  std::size_t head = 0;
  while (head < rows.size() && rows[head].fields[0].text != "Frame") ++head;
  if (head < 2 || head + 1 >= rows.size()) {
    return text_error(file, {}, "a Motive export without its line 'Frame,Time (Seconds),...'",
                      "seven header lines", "export the take again as CSV, with headers");
  }
  const CsvRow& names = rows[head];
  const CsvRow& kinds = rows[head - 1];
  const CsvRow* bodies = nullptr;
  for (std::size_t i = 0; i + 1 < head; ++i) {
    if (rows[i].fields.size() > 1 && rows[i].fields[1].text == "Name") bodies = &rows[i];
  }
  const auto text_of = [](const CsvRow* row, std::size_t i) {
    return row != nullptr && i < row->fields.size() ? row->fields[i].text : std::string();
  };
  Recording recording{file, "an OptiTrack Motive export", {}, "", {}};
  std::size_t column = 2;
  while (column < names.fields.size()) {
    // Seven columns of a rigid body: a quaternion and a place.
    const std::string body = text_of(bodies, column);
    const bool whole = column + 6 < names.fields.size() && text_of(&kinds, column) == "Rotation" &&
                       text_of(&names, column + 3) == "W" &&
                       text_of(&kinds, column + 4) == "Position";
    if (!whole) {
      ++column;
      continue;
    }
    LogTable table{file, body, "motive", {"t", "qx", "qy", "qz", "qw", "x", "y", "z"}, {}};
    for (std::size_t r = head + 1; r < rows.size(); ++r) {
      const auto& fields = rows[r].fields;
      if (fields.size() < 2) continue;
      const double t = number_of(fields[1].text);
      table.values.push_back(t);
      for (std::size_t k = 0; k < 7; ++k) {
        table.values.push_back(column + k < fields.size() ? number_of(fields[column + k].text)
                                                          : kBlank);
      }
    }
    if (table.rows() > 0) recording.tables.push_back(std::move(table));
    column += 7;
  }
  if (!recording.tables.empty()) return recording;
  return text_error(file, {}, "a Motive export without a rigid body", "rotations as quaternions",
                    "define the markers as a rigid body and export quaternions");
}

struct EchoType {
  const char* type;
  std::vector<std::string> columns;  // "-": words
};

// What ros2 topic echo --csv writes of the usual messages, in order.
const std::vector<EchoType>& echo_types() {
  static const std::vector<std::string> kStamp = {"sec", "nanosec", "-"};
  const auto with = [](std::vector<std::string> a, const std::vector<std::string>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  };
  static const std::vector<std::string> kTwist = {"linear.x",  "linear.y",  "linear.z",
                                                  "angular.x", "angular.y", "angular.z"};
  static const std::vector<std::string> kPose = {"position.x",    "position.y",    "position.z",
                                                 "orientation.x", "orientation.y", "orientation.z",
                                                 "orientation.w"};
  static const std::vector<EchoType> kTypes = {
      {"geometry_msgs/msg/TwistStamped", with(kStamp, kTwist)},
      {"geometry_msgs/msg/PoseStamped", with(kStamp, kPose)},
      {"nav_msgs/msg/Odometry", with(with(kStamp, {"-"}), kPose)},
      {"geometry_msgs/msg/PoseWithCovarianceStamped", with(kStamp, kPose)}};
  return kTypes;
}

// A row without a header fits a type when its words are where the type has words.
bool fits(const EchoType& type, const CsvRow& row, bool longer) {
  if (longer ? row.fields.size() < type.columns.size() + 36
             : row.fields.size() != type.columns.size()) {
    return false;
  }
  for (std::size_t i = 0; i < type.columns.size(); ++i) {
    if (is_number(row.fields[i].text) == (type.columns[i] == "-")) return false;
  }
  return true;
}

// Numbers without names: a map may call the columns column_1, column_2, ...
Result<Recording> parse_unnamed(const std::vector<CsvRow>& rows, const std::string& file,
                                char separator) {
  LogTable table{file, "", "csv", {}, {}};
  const std::size_t width = rows.front().fields.size();
  if (width < 2) {
    return text_error(file, {}, "a table of one column",
                      "columns between commas, semicolons or tabs", "separate its columns");
  }
  for (std::size_t i = 0; i < width; ++i) {
    table.columns.push_back("column_" + std::to_string(i + 1));
  }
  for (const CsvRow& row : rows) {
    if (row.fields.size() != width) {
      return text_error(file, row.end, std::to_string(row.fields.size()) + " fields",
                        std::to_string(width) + " as in the first line",
                        "the last line may have broken off: remove it");
    }
    for (const CsvField& field : row.fields) {
      table.values.push_back(number_of(field.text, separator));
    }
  }
  Recording recording{file, "a CSV file without a header", {std::move(table)}, "", {}};
  recording.notes.push_back(file + ": has no header; its columns are column_1 to column_" +
                            std::to_string(width) +
                            ", and a map must say what they are (of a Twist, ros2 topic echo --csv "
                            "writes no times: record a bag)");
  return recording;
}

Result<Recording> parse_echo(const std::vector<CsvRow>& rows, const std::string& file,
                             char separator) {
  for (const EchoType& type : echo_types()) {
    // Odometry and poses with covariance are followed by 36 numbers and more.
    const std::string_view name = type.type;
    const bool longer = name.find("Odometry") != name.npos || name.find("Covariance") != name.npos;
    if (!fits(type, rows.front(), longer)) continue;
    LogTable table{file, "", type.type, {}, {}};
    for (const std::string& column : type.columns) {
      if (column == "sec") table.columns.emplace_back("t");
      if (column != "-" && column != "sec" && column != "nanosec") table.columns.push_back(column);
    }
    for (const CsvRow& row : rows) {
      if (row.fields.size() != rows.front().fields.size()) {
        return text_error(file, row.end, std::to_string(row.fields.size()) + " fields",
                          std::to_string(rows.front().fields.size()) + " as in the first line",
                          "the last line may have broken off: remove it");
      }
      for (std::size_t i = 0; i < type.columns.size(); ++i) {
        const double value = number_of(row.fields[i].text);
        if (type.columns[i] == "nanosec") {
          table.values.back() += 1e-9 * value;
        } else if (type.columns[i] != "-") {
          table.values.push_back(value);
        }
      }
    }
    Recording recording{file, "ros2 topic echo --csv of " + std::string(type.type), {}, "", {}};
    recording.notes.push_back(file + ": taken for " + type.type +
                              " by its columns: the file has no header");
    recording.tables.push_back(std::move(table));
    return recording;
  }
  return parse_unnamed(rows, file, separator);
}

// Rows that end in a separator have an empty last field everywhere.
void drop_empty_last(std::vector<CsvRow>* rows) {
  const std::size_t width = rows->front().fields.size();
  const bool ends_empty = std::all_of(rows->begin(), rows->end(), [&](const CsvRow& row) {
    return row.fields.size() != width || row.fields.back().text.empty();
  });
  if (!ends_empty || width < 2) return;
  for (CsvRow& row : *rows) {
    if (row.fields.size() == width) row.fields.pop_back();
  }
}

// Names of the columns; a table may have an unnamed column of row numbers (pandas).
Result<std::vector<std::string>> column_names(const TableHead& head, const std::string& file) {
  std::vector<std::string> names;
  for (const CsvField& field : head.names) {
    std::string name = field.text;
    if (name.empty()) name = "column_" + std::to_string(names.size() + 1);
    if (contains(names, name)) {
      return text_error(file, field.place, "column " + quoted_word(name) + " again",
                        "each column once", "rename or remove one of the two");
    }
    names.push_back(std::move(name));
  }
  return names;
}

// A log writes its decimals one way: where points and commas are mixed, one of them groups digits.
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

Result<Recording> parse_headed(std::vector<CsvRow> rows, const std::string& file, char separator) {
  drop_empty_last(&rows);
  const TableHead head = read_head(rows, separator);
  ASSIGN_OR_RETURN(const auto names, column_names(head, file));
  LogTable table{file, "", "csv", names, {}};
  for (const CsvField& field : head.titles) table.titles.push_back(field.text);
  table.units = head.units;
  if (Status s = check_decimals(rows, head.rows, separator, file); !s) return s.error();
  std::vector<std::size_t> bad(table.columns.size(), 0), good(table.columns.size(), 0);
  std::vector<const CsvField*> example(table.columns.size(), nullptr);
  for (std::size_t r = head.rows; r < rows.size(); ++r) {
    const auto& fields = rows[r].fields;
    if (fields.size() != table.columns.size()) {
      return text_error(file, rows[r].end, std::to_string(fields.size()) + " fields",
                        std::to_string(table.columns.size()) + " as in the header, separated by " +
                            (separator == '\t' ? "tabs" : quoted_word({&separator, 1})),
                        "leave unknown values empty, but keep their separators");
    }
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const double value = number_of(fields[i].text, separator);
      const bool word =
          std::isnan(value) && !fields[i].text.empty() && !parse_decimal(fields[i].text, separator);
      (word ? bad : good)[i] += 1;
      if (word && example[i] == nullptr) example[i] = &fields[i];
      table.values.push_back(value);
    }
  }
  if (table.rows() == 0) {
    return text_error(file, rows.back().end, "a header without rows", "a row a measurement",
                      "check that the log was written");
  }
  for (std::size_t i = 0; i < bad.size(); ++i) {
    // A column of numbers with a slip in it is no column of words.
    if (bad[i] == 0 || good[i] < 20 * bad[i]) continue;
    return text_error(
        file, example[i]->place,
        "column " + quoted_word(table.columns[i]) + " " + quoted_word(example[i]->text),
        "a number, as in its other rows", "correct it or leave it empty");
  }
  const std::string& first = table.columns.front();
  std::string format = "a table with a header";
  if (first == "%time") format = "rostopic echo -p";
  if (first == "__time") format = "a PlotJuggler export";
  return Recording{file, format, {std::move(table)}, "", {}};
}

bool looks_like_tum(std::string_view text) {
  while (!text.empty() && (text[0] == '#' || text[0] == '\n' || text[0] == '\r')) {
    const std::size_t end = text.find('\n');
    if (end == text.npos) return false;
    text.remove_prefix(end + 1);
  }
  const std::string_view line = first_line(text);
  if (line.find(',') != line.npos) return false;
  const auto tokens = tokens_of(line);
  return tokens.size() == 8 && std::ranges::all_of(tokens, [](std::string_view word) {
           return parse_double(word).has_value();
         });
}

// Columns between blanks alone, as Octave and NumPy write them, by commas: a '#' or '%' before a
// header of names is no name, and other lines of comments are blank.  Empty: they are not such.
std::string with_commas(std::string_view text) {
  std::string out;
  bool numbers = false;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string_view line = text.substr(at, end - at);
    at = end + 1;
    if (line.find_first_of(",;\"\t") != line.npos) return "";
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
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

}  // namespace

Result<Recording> parse_text_log(std::string_view text, const std::string& file) {
  const TextFormat format = sniff_format(text);
  const bool other = format == TextFormat::kEmpty || format == TextFormat::kHtml ||
                     format == TextFormat::kJson || format == TextFormat::kUtf16 ||
                     format == TextFormat::kBinary || format == TextFormat::kRunStore;
  if (other) return wrong_format(file, format, "a log of drives");
  if (looks_like_tum(text)) return parse_tum(text, file);
  const std::string commas = with_commas(text);
  if (!commas.empty()) text = commas;
  const char separator = find_separator(text);
  ASSIGN_OR_RETURN(auto rows, parse_separated(text, file, separator));
  if (rows.empty()) return wrong_format(file, TextFormat::kEmpty, "a log of drives");
  const CsvRow& first = rows.front();
  if (first.fields[0].text == "Format Version") return parse_motive(rows, file);
  const auto named = [&](std::string_view name) {
    return std::ranges::any_of(first.fields, [&](const CsvField& f) { return f.text == name; });
  };
  if (format == TextFormat::kTrialLog && named("x0") && named("theta1")) {
    return wrong_format(file, format, "a log of drives");
  }
  const bool headed = std::ranges::none_of(first.fields, [&](const CsvField& f) {
    return parse_decimal(f.text, separator).has_value();
  });
  return headed ? parse_headed(std::move(rows), file, separator)
                : parse_echo(rows, file, separator);
}

}  // namespace gapfarm
