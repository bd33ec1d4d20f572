// What a ground robot's search has found so far, sent to who watches it; all of it may still move.
#pragma once

#include <utility>
#include <vector>

#include "master/ground/search.h"

namespace gapfarm {

void emit_faults(const GroundWork& work, const GroundSearch& search);
// Of the step in work, as far as it has come.
void emit_offers(const GroundWork& work, const GroundSearch& search,
                 const std::vector<std::pair<Offer, WindowFit>>& tried);
void emit_steps(const GroundWork& work, const GroundSearch& search);
void emit_rest(const GroundWork& work, const GroundSearch& search);

}  // namespace gapfarm
