#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <map>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/trials/format.h"
#include "common/trials/text/csv.h"
#include "common/trials/text/mistakes.h"
#include "master/io/logs/bags.h"
#include "master/io/logs/column_map.h"

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

// `t x y z qx qy qz qw`, blanks between, comments with '#'.
Result<Recording> parse_tum(std::string_view text, const std::string& file, Mistakes& mistakes) {
  LogTable table{file, "", "tum", {"t", "x", "y", "z", "qx", "qy", "qz", "qw"}, {}};
  std::size_t line_number = 0;
  for (const std::string_view line : lines_of(text)) {
    ++line_number;
    const std::vector<std::string_view> tokens = tokens_of(line);
    if (tokens.empty() || tokens[0][0] == '#') continue;
    if (tokens.size() != 8) {
      mistakes.add_row(
          {text_error(file, {line_number, 1}, std::to_string(tokens.size()) + " numbers",
                      "8 (t x y z qx qy qz qw)", "check the line")});
      table.values.insert(table.values.end(), 8, kBlank);
      continue;
    }
    std::vector<double> pose;
    std::vector<Error> errors;
    for (const std::string_view word : tokens) {
      pose.push_back(parse_double(word).value_or(kBlank));
      if (std::isfinite(pose.back())) continue;
      errors.push_back(text_error(file, {line_number, 1}, quoted_word(word), "a number",
                                  "remove poses that were not measured"));
    }
    mistakes.add_row(errors);
    if (!errors.empty()) pose.assign(8, kBlank);
    table.values.insert(table.values.end(), pose.begin(), pose.end());
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

// Blanks rows from `first` on of another number of fields: where each row leads on from the one
// before, what lies before and behind it is not one.
void blank_other_widths(std::size_t first, std::size_t width, const std::string& expected,
                        const std::string& remedy, const std::string& file,
                        std::vector<CsvRow>* rows, Mistakes& mistakes) {
  for (std::size_t r = first; r < rows->size(); ++r) {
    CsvRow& row = (*rows)[r];
    if (row.fields.size() == width) continue;
    mistakes.add_row({text_error(file, row.end, std::to_string(row.fields.size()) + " fields",
                                 std::to_string(width) + expected, remedy)});
    row.fields.assign(width, {"", row.end});
  }
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

Result<Recording> parse_echo(std::vector<CsvRow> rows, const std::string& file, char separator,
                             Mistakes& mistakes) {
  blank_other_widths(0, rows.front().fields.size(), " as in the first line",
                     "the last line may have broken off: remove it", file, &rows, mistakes);
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

struct Word {
  std::size_t row, column;
  const CsvField* field;
};

// Blanks rows with a word where 20 times as many have none: a column of numbers with a slip in it
// is no column of words.
void blank_slips(const std::vector<Word>& words, const std::string& file, LogTable* table,
                 Mistakes& mistakes) {
  std::vector<std::size_t> count(table->columns.size(), 0);
  for (const Word& word : words) ++count[word.column];
  std::map<std::size_t, std::vector<Error>> errors;  // of each row
  for (const Word& word : words) {
    if (table->rows() < 21 * count[word.column]) continue;
    const std::string column = "column " + quoted_word(table->columns[word.column]);
    errors[word.row].push_back(
        text_error(file, word.field->place, column + " " + quoted_word(word.field->text),
                   "a number, as in its other rows", "correct it or leave it empty"));
  }
  for (const auto& [row, all] : errors) {
    mistakes.add_row(all);
    std::fill_n(table->values.begin() + static_cast<long>(row * count.size()), count.size(),
                kBlank);
  }
}

Result<Recording> parse_headed(std::vector<CsvRow> rows, const std::string& file, char separator,
                               Mistakes& mistakes) {
  drop_empty_last(&rows);
  const TableHead head = read_head(rows, separator);
  ASSIGN_OR_RETURN(const auto names, column_names(head, file));
  LogTable table{file, "", "csv", names, {}};
  for (const CsvField& field : head.titles) table.titles.push_back(field.text);
  table.units = head.units;
  RETURN_IF_ERROR(check_decimals(rows, head.rows, separator, file));
  blank_other_widths(head.rows, names.size(),
                     " as in the header, separated by " +
                         (separator == '\t' ? "tabs" : quoted_word({&separator, 1})),
                     "leave unknown values empty, but keep their separators", file, &rows,
                     mistakes);
  std::vector<Word> words;
  for (std::size_t r = head.rows; r < rows.size(); ++r) {
    const auto& fields = rows[r].fields;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const double value = number_of(fields[i].text, separator);
      const bool word =
          std::isnan(value) && !fields[i].text.empty() && !parse_decimal(fields[i].text, separator);
      if (word) words.push_back({r - head.rows, i, &fields[i]});
      table.values.push_back(value);
    }
  }
  if (table.rows() == 0) {
    return text_error(file, rows.back().end, "a header without rows", "a row a measurement",
                      "check that the log was written");
  }
  blank_slips(words, file, &table, mistakes);
  for (std::size_t r = head.rows; r < rows.size(); ++r) {
    for (CsvField& field : rows[r].fields) table.texts.push_back(std::move(field.text));
  }
  join_times(&table);
  const std::string& first = table.columns.front();
  std::string format = "a table with a header";
  if (first == "%time") format = "rostopic echo -p";
  if (first == "__time") format = "a PlotJuggler export";
  return Recording{file, format, {std::move(table)}, "", {}};
}

bool looks_like_tum(std::string_view text) {
  for (const std::string_view line : lines_of(text)) {
    if (line.empty() || line[0] == '#') continue;
    const auto tokens = tokens_of(line);
    return tokens.size() == 8 && std::ranges::all_of(tokens, [](std::string_view word) {
             return parse_double(word).has_value();
           });
  }
  return false;
}

Result<Recording> parse_form(std::string_view text, const std::string& file, Mistakes& mistakes) {
  const TextFormat format = sniff_format(text);
  const bool other = format == TextFormat::kEmpty || format == TextFormat::kHtml ||
                     format == TextFormat::kUtf16 || format == TextFormat::kBinary ||
                     format == TextFormat::kRunStore;
  if (other) return wrong_format(file, format, "a log of drives");
  if (format == TextFormat::kJson) {
    ASSIGN_OR_RETURN(auto objects, rows_of_json(text, file));
    return parse_headed(std::move(objects), file, ',', mistakes);
  }
  if (looks_like_tum(text)) return parse_tum(text, file, mistakes);
  const std::string commas = blanks_to_commas(text);
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
  return headed ? parse_headed(std::move(rows), file, separator, mistakes)
                : parse_echo(std::move(rows), file, separator, mistakes);
}

}  // namespace

Result<Recording> parse_text_log(std::string_view text, const std::string& file,
                                 bool skip_invalid) {
  Mistakes mistakes(skip_invalid);
  auto recording = parse_form(text, file, mistakes);
  const std::size_t bad = mistakes.omitted();
  const std::size_t all = recording ? recording->tables.front().rows() : bad;
  if (2 * bad > all) {
    mistakes.add_file(text_error(file, {}, "mistakes in " + std::to_string(bad) + " of its rows",
                                 "few among " + std::to_string(all), "export it again"));
  }
  RETURN_IF_ERROR(mistakes.status());
  if (recording) {
    for (std::string& note : mistakes.notes()) recording->notes.push_back(std::move(note));
  }
  return recording;
}

}  // namespace gapfarm
