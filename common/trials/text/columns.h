// The columns of the trial format, in the order that the writer writes them.
#pragma once

#include <string>
#include <vector>

namespace gapfarm {

enum TrialColumn : std::size_t {
  kSession,
  kTrial,
  kTime,
  kCommand,
  kLeft,
  kRight,
  kDuration,
  kX0,
  kY0,
  kTheta0,
  kX1,
  kY1,
  kTheta1
};
inline const std::vector<std::string>& trial_columns() {
  static const std::vector<std::string> names = {
      "session", "trial", "t",      "command", "left", "right", "duration",
      "x0",      "y0",    "theta0", "x1",      "y1",   "theta1"};
  return names;
}

enum PathColumn : std::size_t { kPathSession, kPathTrial, kPathTime, kPathX, kPathY, kPathTheta };
inline const std::vector<std::string>& path_columns() {
  static const std::vector<std::string> names = {"session", "trial", "t", "x", "y", "theta"};
  return names;
}

// Of a push log; the piece stands where a trial log has its command.
inline const std::vector<std::string>& push_columns() {
  static const std::vector<std::string> names = {"session", "trial", "object", "x0",    "y0",
                                                 "theta0",  "x1",    "y1",     "theta1"};
  return names;
}

enum TipColumn : std::size_t { kTipSession, kTipTrial, kTipTime, kTipX, kTipY };
inline const std::vector<std::string>& tip_columns() {
  static const std::vector<std::string> names = {"session", "trial", "t", "x", "y"};
  return names;
}

}  // namespace gapfarm
