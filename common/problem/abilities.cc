#include "common/problem/abilities.h"

#include <algorithm>
#include <iterator>

namespace gapfarm {
namespace {

// All others predict, simulate and trace.
struct Limited {
  std::string_view scenario;
  unsigned can;
  const char* why;
};

constexpr const char* kFollowsRuns =
    "it follows logged commands: there are no commands of its own to plan or trace; use gapfarm "
    "horizons";
constexpr Limited kLimited[] = {
    {"ground", kPredicts, kFollowsRuns},
    {"external_runs", kPredicts, kFollowsRuns},
    {"objective", kEvaluates,
     "scenario objective has values and a number, and no trials or motions, which this command is "
     "about; it can be checked, evolved, resumed, compared and replayed, and shown by status, "
     "serve "
     "and report"},
    {"racquetball", kTraces,
     "scenario racquetball has paths and no trials: nothing can be predicted or logged; use "
     "gapfarm influence"},
};

}  // namespace

Status check_can(std::string_view scenario, unsigned what, const std::string& file) {
  const auto row = std::ranges::find(kLimited, scenario, &Limited::scenario);
  if (row == std::end(kLimited) || (row->can & what) != 0) return {};
  return Error{(file.empty() ? "" : file + ": ") + row->why};
}

}  // namespace gapfarm
