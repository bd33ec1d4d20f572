// What a worker, or who brings workers, says that has no master.
#pragma once

#include <optional>
#include <string>

namespace gapfarm {

class MasterWait {
 public:
  // `limit_s`: it gives up after so long; 0: never.
  explicit MasterWait(std::string endpoint, double limit_s = 0)
      : endpoint_(std::move(endpoint)), limit_s_(limit_s) {}

  // What is to be printed now: at once that it waits, for whom and how long, then after one, three,
  // seven ... minutes that it still does, and when a master comes or goes.  `working`: some master
  // has welcomed it.  Times are of one clock of the caller's.
  std::optional<std::string> message(bool working, double now_s);
  // Of the last message() on: there was no master for the limit.
  bool is_over(double now_s) const;
  // For whoever gives up.
  std::string over() const;

 private:
  std::string endpoint_;
  double limit_s_;
  bool working_ = false;
  std::optional<double> since_s_;  // it waits
  double next_s_ = 0, interval_s_ = 0;
};

}  // namespace gapfarm
