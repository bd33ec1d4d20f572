// What `gapfarm crossfit --effects` shows.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "master/experiment/effect_ranking.h"

namespace gapfarm {

nlohmann::ordered_json errors_json(const EndErrors& errors);
nlohmann::ordered_json ranking_json(const Problem& problem, const EffectRanking& ranking);
// A table, best effect first, and what follows from it in a sentence.
std::string ranking_text(const Problem& problem, const EffectRanking& ranking,
                         const EffectRankingPlan& plan);

}  // namespace gapfarm
