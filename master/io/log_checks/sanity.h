// What a careful person would check before simulating anything: units, axes, clocks, copies, too
// little of everything, a robot that the scenario cannot be.
#pragma once

#include <cstddef>
#include <vector>

#include "common/problem/problem.h"
#include "master/io/log_checks/finding.h"

namespace gapfarm {

// Fewer trials name nothing: a place or a direction that is searched for explains any of so few.
inline constexpr std::size_t kFewestTrials = 40;

// The worst first.  A pure function of log and config that takes milliseconds; robust against a few
// per cent of wild rows.  `impossible`: set to the trials that cannot be, ascending: drives for
// which the robot would have had to move at more than twice the log's own speed and 30 cm beyond
// (none where they are so many that the speed itself is in question), and trials that other
// readings contradict (false_readings()), and pushes whose finger jumps (check_tip_jumps()).
std::vector<SanityFinding> check_sanity(const Problem& problem,
                                        std::vector<std::size_t>* impossible = nullptr);

}  // namespace gapfarm
