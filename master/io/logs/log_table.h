// A recording as it is written: named columns of numbers, whatever file they came from.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/trials/text/csv.h"

namespace gapfarm {

// One topic of a bag, or one text file.  Row-major; NaN where the file has a blank or no number.
struct LogTable {
  std::string source;                // file, and topic where it has several
  std::string topic;                 // empty for text files
  std::string type;                  // geometry_msgs/Twist, tum, csv, ...
  std::vector<std::string> columns;  // "t" of a bag is the time of recording, s
  std::vector<double> values;
  // Of each column: its long name, and the unit that the file states.  Empty: no row has them.
  std::vector<std::string> titles = {};
  std::vector<CsvField> units = {};
  // Of a bag's poses: the frame that they are in, and of transforms the one that they place.
  std::string frame = {}, child = {};

  std::size_t rows() const { return columns.empty() ? 0 : values.size() / columns.size(); }
  double at(std::size_t row, std::size_t column) const {
    return values[row * columns.size() + column];
  }
  std::optional<std::size_t> find(std::string_view name) const {
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (columns[i] == name) return i;
    }
    for (std::size_t i = 0; i < titles.size(); ++i) {
      if (titles[i] == name) return i;
    }
    return {};
  }
  // As the file states it, without brackets; empty where it does not.
  std::string unit_of(std::string_view name) const;
};

// What one file held.
struct Recording {
  std::string file;
  std::string format;  // "a CSV file with a header", for sentences
  std::vector<LogTable> tables;
  std::string robot_description;   // a URDF that was recorded with it; often empty
  std::vector<std::string> notes;  // what was held out, and why
};

// Reads text logs: tables with a header (separated by commas, semicolons or tabs; decimal commas;
// rows of units and of other names above the numbers; rostopic echo -p and PlotJuggler included),
// ros2 topic echo --csv of the usual types, TUM, OptiTrack Motive.  Recognised by its content.
// Errors name file, line, what was found and expected; nothing is half-read, unless `skip_invalid`:
// then rows with mistakes are omitted with a note for each, and most of them are an error.
Result<Recording> parse_text_log(std::string_view text, const std::string& file,
                                 bool skip_invalid = false);

}  // namespace gapfarm
