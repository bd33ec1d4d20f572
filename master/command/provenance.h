// What a folder of results answers, so that nothing but the same question goes on there.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "common/base/result.h"
#include "common/recordings/run.h"

namespace gapfarm {

struct Provenance {
  std::string command;             // "diagnose"
  std::string problem;             // problem_hash(): config's model and log
  nlohmann::ordered_json options;  // whatever else results depend on
  nlohmann::ordered_json about;    // files, for people
  std::string build;               // fingerprint of the program

  bool operator==(const Provenance&) const = default;
};

enum class FolderState {
  kNew,       // nothing of such a command is there
  kSame,      // the same question: go on
  kReplaced,  // another one about the same problem, unfinished or to be replaced with --force
};

// Compares with the stamp, question.json, in `folder`.  `result`: the file that a finished command
// leaves there.  Errors: a folder of another command, another problem, and without `force` other
// options than those of a finished result, or such a result of another build.
Result<FolderState> compare_stamp(const std::string& folder, const std::string& result,
                                  const Provenance& stamp, bool force);

std::string format_stamp(const Provenance& stamp);

// Of all that was recorded.
std::string log_hash(const RunLog& log);

inline constexpr const char* kStampFile = "question.json";

}  // namespace gapfarm
