// Cases for `gapfarm blind-check --foreign`: OUT/cases/ID/trials.csv and OUT/truth/ID.json.
#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"
#include "tests/truths/sizing.h"

namespace gapfarm::truths {

struct CaseCounts {
  unsigned nulls = 0;
  unsigned clear = 0, subtle = 0;  // single effects, one after the other through the catalogue
  unsigned outside = 0;            // clear ones that the catalogue does not hold
};

struct CaseSettings {
  CaseCounts counts;
  PlanSize plan;
  std::uint64_t seed = 1;
  std::string out;
  std::vector<std::string> effects;  // empty: all that the engine has
};

struct Case {
  Robot robot;
  Noise noise;
  std::vector<Cause> causes;
  std::string level;
  double size = 1;
  std::uint64_t seed = 0;
};

// A robot of its own, and the noise of its drives and readings.  Treads that carry the load all
// along turn as easily as points of contact half as far apart: these are longer than scenario
// srv1's.
void draw_robot(std::uint64_t seed, Case& made);

// Effects, size, level, robot, seed and the answer that a diagnosis should give.
std::string truth_text(const Case& made);

struct Made {
  unsigned cases = 0;
  std::vector<std::string> out_of_reach;  // effects that cannot be as large as wanted: no case
};
Result<Made> make_cases(const EngineKind& engine, const CaseSettings& settings);

// The program: ENGINE_cases OUT [--nulls N] [--clear N] [--subtle N] [--outside N] [--seed S] ...
int cases_program(const EngineKind& engine, int argc, char** argv);

}  // namespace gapfarm::truths
