// Fits of a diagnosis in a file, a line each, so that a stopped one goes on from there.
#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include "master/ground/fit/window_fit.h"

namespace gapfarm {

class FitFile : public FitMemo {
 public:
  // What is in the file is taken up; a line that broke off is not.
  explicit FitFile(std::filesystem::path file);

  std::optional<KeptFit> find(const std::string& key) override;
  // A file that cannot be written loses nothing but the fits.
  void keep(const std::string& key, const KeptFit& fit) override;

  // They are not needed any more.
  void remove();

 private:
  std::filesystem::path file_;
  std::map<std::string, KeptFit> fits_;
  std::ofstream to_;
};

}  // namespace gapfarm
