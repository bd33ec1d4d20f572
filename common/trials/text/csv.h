// Comma-separated text (RFC 4180) with places, so that every error can point at its cause.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace gapfarm {

// A place in a text; lines and columns count from 1, columns in bytes.
struct TextPlace {
  std::size_t line = 1;
  std::size_t column = 1;
};

// Of a pose, either way: an arena is metres wide, and a greater number is a unit mistake that would
// upset every estimate.
inline constexpr double kGreatestCoordinate_m = 1e4;

// "file:line:column: found FOUND, expected EXPECTED; REMEDY"; an empty remedy is omitted.
Error text_error(std::string_view file, TextPlace place, std::string_view found,
                 std::string_view expected, std::string_view remedy = {});

// `word` in quotes, shortened, with unprintable bytes as \xNN: safe for a terminal.
std::string quoted_word(std::string_view word);

// "a number in [0, 1] s", with either end open when it is infinite.
std::string number_range(double lower, double upper, std::string_view unit);

struct CsvField {
  std::string text;  // unquoted; blanks around an unquoted field are cut off
  TextPlace place;   // of its first byte
};

// A line that begins with '#' before the header.  A header whose first name begins so is none: it
// has commas, which only a mark ("# log: ...", format.h) may have too.
bool is_comment(std::string_view line);

struct CsvRow {
  std::vector<CsvField> fields;
  TextPlace end;  // just past its last byte
};

// All rows; a byte-order mark, CRLF and empty lines are accepted, a quoted field may hold commas,
// line breaks and doubled quotes.  Lines at the very beginning that are comments are omitted.
// Errors: unclosed quote, text after a closing quote, bytes that are not UTF-8.
Result<std::vector<CsvRow>> parse_csv(std::string_view text, std::string_view file);

// `text` as a field, quoted when it must be.
std::string csv_field(std::string_view text);

// The whole of `text` as a number in C notation whatever the locale; a leading '+' is accepted.
// None when it is not one.  NaN and infinity are numbers here.
std::optional<double> parse_double(std::string_view text);
std::optional<std::int64_t> parse_integer(std::string_view text);

// The shortest text that reads back as the same bits.
std::string format_double(double value);

// The columns of a header row.  Columns beyond the `required` ones are the `extra`.
class CsvHeader {
 public:
  // Errors: missing (all of them are named), empty or repeated columns.  `format` names the file's
  // format for the error.
  static Result<CsvHeader> match(const CsvRow& row, std::span<const std::string> required,
                                 std::string_view file, std::string_view format);

  std::size_t width() const { return width_; }
  // Position in a row of required column `i`.
  std::size_t operator[](std::size_t i) const { return positions_[i]; }
  const std::vector<std::size_t>& extra() const { return extra_; }

 private:
  std::size_t width_ = 0;
  std::vector<std::size_t> positions_;
  std::vector<std::size_t> extra_;
};

// Typed fields of one row.  What is wrong is kept, the first mistake of each column, and reading it
// gives zero, so that a caller reads everything and then asks once.
class CsvRowReader {
 public:
  // REQUIRES: the row has as many fields as the header is wide (check_width).
  CsvRowReader(const CsvRow& row, const CsvHeader& header, std::span<const std::string> names,
               std::string_view file)
      : row_(row), header_(header), names_(names), file_(file) {}

  const CsvField& field(std::size_t column) const { return row_.fields[header_[column]]; }
  std::string word(std::size_t column);  // not empty
  std::int64_t integer(std::size_t column);
  double number(std::size_t column, double lower, double upper, const char* unit);
  // None when the field is empty.
  std::optional<double> optional_number(std::size_t column, double lower, double upper,
                                        const char* unit);
  double coordinate(std::size_t column);  // m
  double angle(std::size_t column);       // rad, wrapped into (-pi, pi]

  void fail(std::size_t column, std::string_view found, std::string_view expected,
            std::string_view remedy = {});
  const std::vector<Error>& errors() const { return errors_; }
  // The first of them; null when there is none.
  const Error* error() const { return errors_.empty() ? nullptr : &errors_.front(); }

 private:
  const CsvRow& row_;
  const CsvHeader& header_;
  std::span<const std::string> names_;
  std::string_view file_;
  std::vector<Error> errors_;
  std::vector<std::size_t> failed_;  // their columns
};

// OK when the row has as many fields as the header.
Status check_width(const CsvRow& row, const CsvHeader& header, std::string_view file);

// Tables as other programs and spreadsheets write them: which character separates columns, whether
// decimals have commas, and how many rows stand above the numbers.

// ',', ';' or a tab: the one that most lines hold equally often, the first line included.  Equals:
// ';' before the tab before ',', since decimals may have commas.
char find_separator(std::string_view text);

// As parse_csv(), with another separator.
Result<std::vector<CsvRow>> parse_separated(std::string_view text, std::string_view file,
                                            char separator);

// parse_double(), and where commas do not separate columns, a single one for the decimal point.
std::optional<double> parse_decimal(std::string_view text, char separator);

// What stands above the numbers: a row of names, often rows of units and of other names.
struct TableHead {
  std::size_t rows = 1;
  std::vector<CsvField> names;  // of the last row of names whose names are unique
  // Of the first one where there are several, and of the row of units; empty: there is none.
  std::vector<CsvField> titles, units;
};

// REQUIRES: a first row without numbers.
TableHead read_head(const std::vector<CsvRow>& rows, char separator);

// A log writes its decimals one way: where points and commas are mixed, one of them groups digits:
// an error.
Status check_decimals(const std::vector<CsvRow>& rows, std::size_t first, char separator,
                      const std::string& file);

// Columns between blanks alone, as Octave and NumPy write them, by commas: a '#' or '%' before a
// header of names is no name, and other lines of comments are blank.  Empty: they are not such.
std::string blanks_to_commas(std::string_view text);

}  // namespace gapfarm
