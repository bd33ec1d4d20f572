// Parts of a fit to windows: the density of its residuals, and what it is asked.
#pragma once

#include <string>

#include "common/base/hash.h"
#include "master/ground/fit/window_fit.h"

namespace gapfarm {

inline constexpr double kWindowTail = 4;  // degrees of freedom of a residual's density

// Of a residual in a step of least squares, its scale being s.
inline double window_weight(double r, double s) {
  const double z = r / s;
  return (kWindowTail + 1) / (kWindowTail + z * z) / (s * s);
}

// Log density of a residual: Student's.
double window_nats(double residual, double scale);

// Times and values, into a hash.
inline void add_rows(const std::vector<CommandRow>& rows, Hasher* hasher) {
  for (const CommandRow& row : rows) {
    hasher->add(row.t_s);
    for (const double value : row.values) hasher->add(value);
  }
}

// Hash of all that fits to these windows depend on beside rows and start.
std::string question_of(const GroundRobot& robot, const WindowSet& windows,
                        const std::optional<GroundReference>& reference);

}  // namespace gapfarm
