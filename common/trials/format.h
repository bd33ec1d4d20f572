// Which format a text is, recognised by its content alone.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace gapfarm {

enum class TextFormat {
  kEmpty,
  kTrialLog,     // trials.csv
  kPaths,        // paths.csv
  kPushLog,      // pushes.csv
  kTips,         // tips.csv
  kBbautotune,   // bbautotune's forward-motion runs
  kBlendersim,   // blendersim's way-point logs
  kRacquetball,  // millisecond,x,y,z trajectories
  kPrediction,   // what `gapfarm predict` writes
  kToml,         // a config or a model
  kJson,
  kHtml,
  kRunStore,        // SQLite
  kOtherSeparator,  // a table whose columns are not cut by commas
  kUtf16,
  kBinary,
  kUnknown,
};

TextFormat sniff_format(std::string_view text);

// "a bbautotune log", for sentences.
std::string format_name(TextFormat format);

// The error of a file that is not the `expected` format ("a trial log"): names what it is and what
// to do with it, the importer where there is one.
Error wrong_format(std::string_view file, TextFormat found, std::string_view expected);

// The line with which a paths.csv says which log it belongs to:
//     # log: trials.csv 0123456789abcdef0123456789abcdef
// The digits, BLAKE2b-128 of the log's bytes (`b2sum -l 128 trials.csv`), may be missing.

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
