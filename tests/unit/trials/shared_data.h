// Real and practice logs that are not part of the project.  Tests that want them pass vacuously
// where they are absent: GAPFARM_SHARED or ../shared beside the sources.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace gapfarm {

inline std::optional<std::filesystem::path> shared_data(const std::string& folder) {
  const char* set = std::getenv("GAPFARM_SHARED");
  const std::filesystem::path root =
      set != nullptr ? std::filesystem::path(set)
                     : std::filesystem::path(GAPFARM_SOURCE_DIR).parent_path() / "shared";
  std::error_code code;
  const std::filesystem::path path = root / "data" / folder;
  if (!std::filesystem::is_directory(path, code)) return std::nullopt;
  return path;
}

// Paths in `folder` that end in `extension`, sorted.
inline std::vector<std::string> files_in(const std::filesystem::path& folder,
                                         const std::string& extension) {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == extension) files.push_back(entry.path().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace gapfarm
