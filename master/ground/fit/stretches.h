// Which windows of a log count alike, and which are held out together.
#pragma once

#include <span>
#include <vector>

#include "common/recordings/windows.h"
#include "common/trials/trial.h"

namespace gapfarm {

// Of each window its length among lengths that count alike, 0 on.  Lengths are octaves; a few
// windows of a length between two horizons (poses are not even) count with the nearest one, or they
// would weigh as much as hundreds.
std::vector<std::size_t> window_lengths(std::span<const double> durations_s);

// How much each window counts, one on the whole: each length alike, so that no length is given up
// for another; one with a handful of windows as much less as these are fewer.
std::vector<double> window_weights(std::span<const std::size_t> lengths);

// Of each window one of at most `count` stretches of the log that are held out in turn: whole runs,
// those in a row together and those with the same commands wherever they are, or of one or two runs
// the log's time in equal parts.  What is alike (repeats, a floor) is held out together, or it
// would be predicted by itself.  REQUIRES: trials that are windows of `runs`.
std::vector<std::size_t> held_out_stretches(std::span<const Trial> windows,
                                            std::span<const CommandedRun> runs, std::size_t count);

}  // namespace gapfarm
