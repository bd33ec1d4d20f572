// Stages of a config: some genes first, then others (Laue and Hebbel 2009), and trials held out
// to validate what comes of it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/config/settings.h"

namespace gapfarm {

struct Stage {
  std::vector<std::size_t> genes;  // of the problem, ascending
  std::uint64_t evaluations = 0;   // before the next stage begins; the last one's stop is the run's
};

struct StagePlan {
  std::vector<Stage> stages;  // empty: all genes at once
  // Relative to the config's folder made absolute; where trials are windows of runs: folders.
  std::vector<std::string> validation_files;
};

//   [[stages]]
//   genes = ["full_speed", "friction"]
//   evaluations = 400
//   [[stages]]
//   genes = ["drive_noise_common", "full_speed"]
//   [validation]
//   trials = ["held_out.csv"]     # of scenario ground: folders = ["tuesday"]
//
// Read from the config's own text.  Errors, with places: a name that is no gene, a gene in no
// stage, a stage before the last without evaluations.
Result<StagePlan> read_stages(const Config& config);

}  // namespace gapfarm
