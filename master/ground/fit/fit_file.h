// Fits in a file, a line each, so that nothing is fitted twice: those of a diagnosis, so that a
// stopped one goes on from there, and those of a fleet's runs.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "common/base/result.h"
#include "common/json/json.h"
#include "master/ground/fit/window_fit.h"

namespace gapfarm {

// JSON objects by their "key".  What is in the file is taken up; a line that broke off is not.  A
// file that cannot be written loses nothing but its lines.
class LineFile {
 public:
  explicit LineFile(std::filesystem::path file);

  // Null: not there.
  Json line(const std::string& key) const;
  void add(const std::string& key, Json line);
  // They are not needed any more.
  void remove();

 private:
  std::filesystem::path file_;
  std::map<std::string, std::string> lines_;
};

class FitFile : public FitMemo, public LineFile {
 public:
  using LineFile::LineFile;
  std::optional<KeptFit> find(const std::string& key) override;
  void keep(const std::string& key, const KeptFit& fit) override;
};

class RunCache : public LineFile {
 public:
  using LineFile::LineFile;
  // None: not fitted yet.  What cannot be fitted is kept with its reason.
  std::optional<Result<OffsetFit>> find(const std::string& key) const;
  void keep(const std::string& key, const Result<OffsetFit>& fit);
};

}  // namespace gapfarm
