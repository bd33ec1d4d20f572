// How long a diagnosis will still take.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace gapfarm {

// From the time that its stages took so far and the shares that stages usually have of the whole
// (kDiagnosisStages); a guess, since what the log holds decides how often it is searched.
class StagePace {
 public:
  // A stage begins now; an unknown one counts for nothing.
  void begin(const std::string& stage, double now_s);
  // None before any time has passed.
  std::optional<double> time_left_s(double now_s) const;

 private:
  std::size_t stage_ = 0;
  double first_s_ = 0;  // when the first stage began
  double stage_s_ = 0;  // when the present one did
  bool begun_ = false;
};

}  // namespace gapfarm
