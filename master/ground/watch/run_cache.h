// Fits of runs in a file, a line each: a run is fitted once.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "common/base/result.h"
#include "master/ground/reference.h"

namespace gapfarm {

class RunCache {
 public:
  // What is in the file is taken up; a line that broke off is not.
  explicit RunCache(std::filesystem::path file);

  // Null: not fitted yet.  What cannot be fitted is kept with its reason.
  const Result<OffsetFit>* find(const std::string& key) const;
  // A file that cannot be written loses nothing but the fits.
  const Result<OffsetFit>& keep(const std::string& key, Result<OffsetFit> fit);

 private:
  std::filesystem::path file_;
  std::map<std::string, Result<OffsetFit>> fits_;
};

}  // namespace gapfarm
