// Genes that change nothing: a search over them is a search for nothing.
#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/config/settings.h"
#include "master/farm/farm.h"

namespace gapfarm {

struct IdleGene {
  std::string key;
  std::string remedy;  // what would show it, or that nothing in this log does
};

// Genes whose moving by half their range changes no score, of several objectives none, to the last
// bit: at the config's own values, nor at two points drawn from the genes' ranges.  One evaluation
// a gene where all do something.  Those of a user's program that are there only sometimes are not
// looked at, and none is found where nothing could be evaluated.  Errors: the farm's.
Result<std::vector<IdleGene>> idle_genes(Farm& farm, const Config& config);

}  // namespace gapfarm
