// Whole text files in and out.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "common/base/result.h"

namespace gapfarm {

// The bytes of a file.  Errors name the path and say whether it is missing, a folder or unreadable.
Result<std::string> read_text_file(const std::string& path);

// What `parse` makes of the text of a file and its path; the errors of either.
template <class Parse>
auto parse_file(const std::string& path, const Parse& parse) -> decltype(parse(path, path)) {
  const Result<std::string> text = read_text_file(path);
  if (!text) return text.error();
  return parse(*text, path);
}

// Whether there is such a file or folder, or such a folder; of what cannot be looked at: no.
bool is_there(const std::filesystem::path& path);
bool is_folder(const std::filesystem::path& path);

// From the root on; as it stands where nothing says where that is.
std::string whole_path(const std::string& path);

// `path` as a command that was called in `folder` meant it: below that where it is relative and
// there is such a file, as it stands otherwise, or where that is the same.
std::string path_from(const std::string& folder, const std::string& path);

// What becomes of a file in the way: replaced, or kept.  Kept, the new one stays beside it, under a
// name that the error shows.
enum class IfThere { kReplace, kKeep };

// Writes beside `path` and renames, so a reader sees the old file or the new one, never a part.
// Missing folders of `path` are made.  Links are followed; devices and pipes are written to.  What
// a command is asked to write goes through its Outputs (master/cli), which come here.  `mode`: who
// may read it, as far as the umask lets them; 0600: its owner alone.
Status write_file_atomically(const std::string& path, std::string_view bytes,
                             IfThere if_there = IfThere::kReplace, unsigned mode = 0666);

}  // namespace gapfarm
