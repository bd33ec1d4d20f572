// Which format a text is, recognised by its content alone.
#pragma once

#include <string>
#include <string_view>

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

}  // namespace gapfarm
