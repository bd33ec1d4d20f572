// The line with which a paths.csv says which log it belongs to:
//     # log: trials.csv 0123456789abcdef0123456789abcdef
// The digits, BLAKE2b-128 of the log's bytes (`b2sum -l 128 trials.csv`), may be missing.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace gapfarm {

struct LogMark {
  std::string file;  // name without folder
  std::string hash;  // empty: any state of that file
};

// With the line's end.
std::string format_mark(const std::string& log_path, std::string_view log_text);

// All marks among the comments that `text` begins with.
std::vector<LogMark> log_marks(std::string_view text);

enum class Belonging {
  kYes,
  kNo,     // no mark names it
  kStale,  // a mark names it, but it has changed since
};
Belonging belonging(const std::vector<LogMark>& marks, const std::string& log_path,
                    std::string_view log_text);

}  // namespace gapfarm
