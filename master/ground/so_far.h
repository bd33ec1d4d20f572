// What a ground robot's search has found so far, told to who watches it; all of it may still move.
#pragma once

#include <utility>
#include <vector>

#include "master/ground/search.h"

namespace gapfarm {

void tell_of_faults(const GroundWork& work, const GroundSearch& search);
// Of the step in work, as far as it has come.
void tell_of_offers(const GroundWork& work, const GroundSearch& search,
                    const std::vector<std::pair<Offer, WindowFit>>& tried);
void tell_of_steps(const GroundWork& work, const GroundSearch& search);
void tell_of_rest(const GroundWork& work, const GroundSearch& search);

}  // namespace gapfarm
