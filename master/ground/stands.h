// Which names stand beside one another.
#pragma once

#include <vector>

#include "master/ground/search.h"

namespace gapfarm {

// Whether the interval of what says how much of it there is, its first parameter, excludes none, or
// what is kept: what a few windows at a border gain may be theirs alone.
bool shows_its_size(const WindowFitter& fitter, const GroundWork& work, const GroundSearch& search,
                    std::size_t index, const WindowFit& fit);

// The file with these hypotheses put right, predicting what was not fitted; fits begin where `fit`
// ended.
WindowFit held_out_with(const WindowFitter& fitter, const GroundSearch& search,
                        const std::vector<std::size_t>& hypotheses, const WindowFit& fit);

// Names that would not be given beside all others lose them, unless none would be left.
void drop_again(const WindowFitter& fitter, const GroundWork& work, const GroundNames& unnamed,
                GroundSearch* search);

// Looks for a smooth correction (GroundSearch::smooth) beside what is named; names beside which it
// foresees hardly more than it does without them stand for something else, and lose them.
void drop_stand_ins(const WindowFitter& fitter, const GroundWork& work, const GroundNames& unnamed,
                    GroundSearch* search);

}  // namespace gapfarm
