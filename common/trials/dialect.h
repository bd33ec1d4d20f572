// Tables as other programs and spreadsheets write them: which character separates columns, whether
// decimals have commas, and how many rows stand above the numbers.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/trials/text/csv.h"

namespace gapfarm {

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
