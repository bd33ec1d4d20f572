#include "common/base/shipped.h"

#include <filesystem>

namespace gapfarm {

std::string shipped_file(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (path.empty() || fs::path(path).is_absolute() || fs::exists(path, error)) return path;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return path;
  const fs::path shipped = program.parent_path().parent_path() / "share/gapfarm" / path;
  return fs::is_regular_file(shipped, error) ? shipped.string() : path;
}

}  // namespace gapfarm
