// What those who watch a run hear while it goes on.
#pragma once

#include <string_view>

#include "common/base/result.h"
#include "common/trials/trial.h"

namespace gapfarm {

class RunWatcher {
 public:
  virtual ~RunWatcher() = default;
  virtual void note(std::string_view) {}
  // The run goes on all the same.
  virtual void error(const Error&) {}
  // In place of the last one; `news`: it is not just more of the same.  Empty: there is none now.
  virtual void progress(std::string_view, bool /*news*/) {}
  // A log that the run takes beside its own.
  virtual void read(const TrialLog&) {}
};

}  // namespace gapfarm
