// Configs: TOML files to typed settings (docs/configuration.md).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/config/settings.h"

namespace gapfarm {

using ProgramStarter = std::function<Result<std::string>(const ExternalCommand&)>;
// An error: whoever only reads starts nothing.
Result<std::string> start_no_program(const ExternalCommand& command);
// Starts it, reads its first line and ends it.
Result<std::string> start_program(const ExternalCommand& command);

// Keys that the file omits keep their defaults.  The error lists everything that is wrong, a
// line each: "file:line:column: sentence", with "did you mean" for unknown words.
// `start` starts the simulator that scenario `external` names, and returns how it introduces
// itself.  Where the problem is `known`, robot and program are its own: no robot's file is read and
// nothing is started.
Result<Config> parse_config(std::string_view text, const std::string& path,
                            const ProgramStarter& start = start_no_program,
                            const Problem* known = nullptr);
// Looks among the shipped ones too (shipped_file).
Result<Config> read_config(const std::string& path);

// What evolving needs beyond a config that reads: at least one gene.
Status check_evolvable(const Config& config);

// An error where the scenario is `objective`, for what needs trials or motions; `path` names it.
Status check_moves(const std::string& scenario, const std::string& path);

// Comparisons: one config with several variants of it, to be run side by side.
struct Variant {
  std::string name;
  Config config;
};

struct Comparison {
  std::optional<unsigned> seeds;
  std::optional<std::uint64_t> evaluations;  // of every run
  std::optional<double> target_fitness;
  std::vector<Variant> variants;
};

// Whether a TOML text has a section [compare].  False when it does not parse.
bool is_comparison(std::string_view text);

//   [compare]
//   config = "base.toml"          # relative to this file
//   seeds = 20
//   evaluations = 5000
//   target_fitness = 0.931
//   [variants.small]              # keys that replace the base's, section by section
//   evolution.population = 10
//
// Errors: as parse_config(), no variants; those of a variant's own keys name the variant.
Result<Comparison> read_comparison(const std::string& path);

// Stages of a config: some genes first, then others (Laue and Hebbel 2009), trials held out
// to validate what comes of it, and who searches where the config does not say.

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
