// Whether slips happen anywhere, as the effect has it, or where something else lies.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "master/diagnose/study.h"

namespace gapfarm {

struct Gathering {
  double gain = 0;           // nats, of the best place over slips that fall anywhere
  std::string where;         // in words: a disc, or a line that the drives cross
  std::vector<bool> passed;  // whether each trial's drive went there
};

// A gain that slips which fall anywhere reach in less than one of 500 logs: the best of about 500
// places that differ, twice a gain being a chi-square with one degree of freedom.
inline constexpr double kLeastGathering = 10;

// Scan for a place that drives pass through in which they slip more often than elsewhere: Kulldorff
// (1997), Poisson.  `slipped`: probability that each trial did; trials of false `informative` do
// not count.  Longer drives show slips better, so what is expected goes by kind and length of a
// drive.
Gathering gathering_of_slips(const Study& study, std::span<const double> slipped,
                             const std::vector<bool>& informative);

}  // namespace gapfarm
