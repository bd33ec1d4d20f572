// Poses that a tracker cannot have seen: other readings contradict them.
#pragma once

#include <cstddef>
#include <vector>

#include "common/problem/problem.h"

namespace gapfarm {

// Trials of a log of drives or pushes with such a reading, ascending.  One that ends where no other
// of its command does has one
// - where the next trial's start is where the others lead (the end is false), or the end of the
//   trial before is where the others begin (the start is);
// - where its end is, to the last digit, that of others: what a tracker reports that has lost the
//   robot;
// - where there are some of these and no other reading confirms its end, in a log whose trials
//   begin where the one before ends;
// - where it ends four times as far off as any other, and is one of 200.
// What was read on the way is late rather than false (pose_latency) unless it is one of few among
// these; a robot that slipped is seen twice where it is.  Empty where commands have too few
// repeats, and where there are so many that there is no knowing which readings are false.
std::vector<std::size_t> false_readings(const Problem& problem);

}  // namespace gapfarm
