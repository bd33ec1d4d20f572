// A farm of one worker in this process: real simulations, no sockets.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "common/config/settings.h"
#include "master/farm/farm.h"
#include "worker/evaluate.h"

namespace gapfarm::tests {

class WorkerFarm : public Farm {
 public:
  std::string add_problem(const v1::Problem& problem) override;
  Result<std::vector<v1::TaskResult>> run(
      const std::string& problem_hash, const std::vector<v1::Task>& tasks,
      const std::function<void(const FarmProgress&)>& on_progress = {}) override;

 private:
  std::map<std::string, std::unique_ptr<PreparedProblem>> problems_;
};

// A small experiment: 2 sessions of 12 trials, two durations, 120 Hz.
Config small_config();

// A fresh folder that goes with its owner.
class Folder {
 public:
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace gapfarm::tests
