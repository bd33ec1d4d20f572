// What a worker says that has no master.
#pragma once

#include <optional>
#include <string>

namespace gapfarm {

class MasterWait {
 public:
  explicit MasterWait(std::string endpoint) : endpoint_(std::move(endpoint)) {}

  // What is to be printed now: at once that it waits and for whom, every minute that it still does,
  // and when a master comes or goes.  `working`: some master has welcomed this worker.  Times are
  // of one clock of the caller's.
  std::optional<std::string> message(bool working, double now_s);

 private:
  std::string endpoint_;
  bool working_ = false;
  std::optional<double> since_s_;  // it waits
  double reported_s_ = 0;
};

}  // namespace gapfarm
