// What an installed program brings along, found relative to the program itself.
#pragma once

#include <string>

namespace gapfarm {

// `path`; when it is relative, nothing is there, and share/gapfarm beside the program's folder has
// a file of that name ("configs/demo.toml"), that one.
std::string shipped_file(const std::string& path);

}  // namespace gapfarm
