// Checks of logs of drives.
#pragma once

#include <vector>

#include "master/io/log_checks/drive_sample.h"
#include "master/io/log_checks/finding.h"

namespace gapfarm {

// What a scenario's robot can do, of its parameters' bounds and the config's values.
struct DriveLimits {
  double slowest_m_s = 0, fastest_m_s = 0;  // full speed at full duty
  double expected_m_s = 0;                  // the config's
  double gauge_m = 0;                       // between left and right contact
};

// Nothing was commanded to move, or nothing did.  Whether anything was found.
bool check_motion(const std::vector<DriveSample>& samples, const DriveLimits& limits,
                  std::vector<SanityFinding>* findings);
// Lengths of another unit, or a robot that is faster or slower than the scenario's can be.
bool check_speed(const std::vector<DriveSample>& samples, const DriveLimits& limits,
                 std::vector<SanityFinding>* findings);
// Headings of another unit: small ones while the travel goes all ways.
bool check_heading_unit(const std::vector<DriveSample>& samples,
                        std::vector<SanityFinding>* findings);
// Turns faster than the sides' speeds and their distance allow without any slip.
void check_turning(const std::vector<DriveSample>& samples, const DriveLimits& limits,
                   std::vector<SanityFinding>* findings);

}  // namespace gapfarm
