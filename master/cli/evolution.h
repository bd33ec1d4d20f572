// One evolution from a store's checkpoint to a reason to stop: what `evolve` and `resume` share.
#pragma once

#include <optional>

#include "common/config/settings.h"
#include "master/cli/inputs.h"
#include "master/cli/page_along.h"
#include "master/store/run_store.h"

namespace gapfarm {

// Settings of a run that may be given on the command line and outrank the config.
struct EvolutionOverrides {
  std::optional<std::uint64_t> generations;
  std::optional<std::uint64_t> evaluations;
  std::optional<double> time_s;
  std::optional<double> target_fitness;
  std::optional<unsigned> population;

  void declare(CLI::App& app);
  void apply(EvolutionSettings& settings) const;
  std::string to_json() const;
  // Those of `later` where it has them.
  void merge(const EvolutionOverrides& later);
  static EvolutionOverrides from_json(const std::string& text);
};

struct EvolutionRun {
  const Config& config;  // overrides applied; its log may be empty
  const Problem& problem;
  const FarmOptions& farm;
  Log& log;
  std::optional<std::uint64_t> shuffle_seed;
  PageOption page;
};

// Evolves from the store's last checkpoint, committing every generation, and leaves model.toml,
// poses.svg and fitness.svg behind.  Returns an ExitCode.
int run_evolution(RunStore& store, const EvolutionRun& run, CliContext& context);

}  // namespace gapfarm
