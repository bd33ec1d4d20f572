// Stages of a config: some genes first, then others (Laue and Hebbel 2009), trials held out
// to validate what comes of it, and who searches where the config does not say.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
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

struct DefaultOptimiser {
  OptimiserKind kind = OptimiserKind::kAutoSearch;
  std::string reason;  // for the log; empty: that of the optimiser itself
};

// `auto`; or the genetic algorithm, where [evolution] sets what only that has.  None: the text has
// an [optimiser] kind, or is no config.
std::optional<DefaultOptimiser> default_optimiser(std::string_view config_text);

// Names keys of [evolution] and [optimiser] that are stated but that this kind of search does not
// read, in a sentence; empty: there are none.
std::string unread_by_search(std::string_view config_text, OptimiserKind kind);

}  // namespace gapfarm
