// Whole text files in and out.
#pragma once

#include <string>
#include <string_view>

#include "common/base/result.h"

namespace gapfarm {

// The bytes of a file.  Errors name the path and say whether it is missing, a folder or unreadable.
Result<std::string> read_text_file(const std::string& path);

// `path` as a command that was called in `folder` meant it: below that where it is relative and
// there is such a file, as it stands otherwise, or where that is the same.
std::string path_from(const std::string& folder, const std::string& path);

// What becomes of a file in the way: replaced, or kept.  Kept, the new one stays beside it, under a
// name that the error shows.
enum class IfThere { kReplace, kKeep };

// Writes beside `path` and renames, so a reader sees the old file or the new one, never a part.
// Missing folders of `path` are made.  Links are followed; devices and pipes are written to.  What
// a command is asked to write goes through its Outputs (master/cli), which come here.
Status write_file_atomically(const std::string& path, std::string_view bytes,
                             IfThere if_there = IfThere::kReplace);

}  // namespace gapfarm
