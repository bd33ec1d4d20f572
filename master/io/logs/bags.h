// Readers of the three kinds of bags.  All give the topics that serve ground robots as tables, and
// say what they left.  Errors: "FILE:BYTE: found ..., expected ...; remedy"; nothing is half-read.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
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
  // As `values`, but the cells as they stand; empty where the file has numbers alone.
  std::vector<std::string> texts = {};
  // Of a bag's poses: the frame that they are in, and of transforms the one that they place.
  std::string frame = {}, child = {};

  std::size_t rows() const { return columns.empty() ? 0 : values.size() / columns.size(); }
  double at(std::size_t row, std::size_t column) const {
    return values[row * columns.size() + column];
  }
  std::optional<std::size_t> find(std::string_view name) const {
    for (const auto* names : {&columns, &titles}) {
      const auto found = std::ranges::find(*names, name);
      if (found != names->end()) return static_cast<std::size_t>(found - names->begin());
    }
    return {};
  }
  // As the file states it, without brackets; empty where it does not.
  std::string unit_of(std::string_view name) const;
  // Of a column, those that are there; empty also where there is none of that name.
  std::vector<double> numbers(std::string_view name) const;
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
// JSON objects, ros2 topic echo --csv of the usual types, TUM, OptiTrack Motive.  Recognised by its
// content.
// Errors name file, line, what was found and expected; nothing is half-read, unless `skip_invalid`:
// then rows with mistakes are omitted with a note for each, and most of them are an error.
Result<Recording> parse_text_log(std::string_view text, const std::string& file,
                                 bool skip_invalid = false);

// Rows of JSON objects, one a line or all in one array, below a head with the paths to their
// values.
Result<std::vector<CsvRow>> rows_of_json(std::string_view text, const std::string& file);

class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual std::uint64_t size() const = 0;
  // Exactly `count` bytes at `offset` into `to`; false where the file ends before.
  virtual bool read(std::uint64_t offset, std::size_t count, std::string& to) = 0;
};

// One a row of formats.inc; errors name `path`.
#define FORMAT(file, begins) \
  Result<Recording> read_##file(ByteSource& source, const std::string& path);
#include "master/io/logs/formats.inc"

// Any log, recognised by its content.
Result<Recording> read_recording(const std::string& path, bool skip_invalid = false);

// `bytes` packed as `how` ("", none, bz2, lz4, zstd), which become `size` bytes.  Errors, without a
// place: an unknown packing, bytes that do not unpack to just that size, a size beyond 1 GiB or
// beyond what any packing reaches.
Result<std::string> decompress(std::string_view bytes, const std::string& how, std::uint64_t size);

// Messages as JSON in an MCAP file (https://mcap.dev/spec), for Foxglove and PlotJuggler.
class McapWriter {
 public:
  // A topic whose messages are of this JSON Schema.  At most 65535.
  std::uint16_t add_channel(const std::string& topic, const std::string& schema_name,
                            const std::string& schema);
  // In any order.  REQUIRES: a channel of add_channel().
  void add_message(std::uint16_t channel, std::uint64_t time_ns, std::string json);
  // The whole file: chunks without compression in the order of time, their index, a summary.
  std::string finish();

 private:
  struct Channel {
    std::string topic;
    std::uint16_t schema = 0;
    std::uint32_t messages = 0;
  };
  struct Message {
    std::uint64_t time_ns = 0;
    std::uint16_t channel = 0;
    std::string json;
  };

  std::string schema_records() const;
  std::string channel_records() const;

  std::vector<std::pair<std::string, std::string>> schemas_;  // name, text
  std::vector<Channel> channels_;
  std::vector<Message> messages_;
};

}  // namespace gapfarm
