// Small logs for the tests of this folder.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace gapfarm {

inline const std::vector<std::string> kCommands = {"forward", "backward", "turn_ccw",
                                                   "turn_cw", "wide_ccw", "wide_cw"};
inline const std::string kHeader =
    "session,trial,t,command,left,right,duration,x0,y0,theta0,x1,y1,theta1";
inline const std::string kRow = "s1,0,0,forward,1,1,1,0,0,0,0.25,0,0";

// A folder that goes with the test.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "gapfarm-XXXXXX").string();
    path_ = ::mkdtemp(name.data());
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::string path(const std::string& name) const { return (path_ / name).string(); }
  std::string write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name, std::ios::binary) << text;
    return path(name);
  }

 private:
  std::filesystem::path path_;
};

}  // namespace gapfarm
