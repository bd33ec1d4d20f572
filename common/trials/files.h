// Whole text files in and out.
#pragma once

#include <string>
#include <string_view>

#include "common/base/result.h"

namespace gapfarm {

// The bytes of a file.  Errors name the path and say whether it is missing, a folder or unreadable.
Result<std::string> read_text_file(const std::string& path);

// Writes beside `path` and renames, so a reader sees the old file or the new one, never a part.
// Missing folders of `path` are made.
Status write_file_atomically(const std::string& path, std::string_view bytes);

}  // namespace gapfarm
