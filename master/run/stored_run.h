// A run as its store has it: what it was asked, and what came of it so far.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/config/model.h"
#include "common/config/settings.h"
#include "master/store/run_reader.h"

namespace gapfarm {

struct EvolutionOverrides {
  std::optional<std::uint64_t> generations;
  std::optional<std::uint64_t> evaluations;
  std::optional<double> time_s;
  std::optional<double> target_fitness;
  std::optional<unsigned> population;

  void apply(EvolutionSettings& settings) const;
  std::string to_json() const;
  static EvolutionOverrides from_json(const std::string& text);
};

// What a new run of a config keeps, `overrides` applied to it.
RunInfo run_info(const Config& config, const EvolutionOverrides& overrides);

// Error: the problem cannot be read.
Result<Problem> stored_problem(const RunInfo& info);
Result<Problem> stored_problem(const RunReader& run);  // the error names the run

// The config's text, about the stored problem; its files, or those that the run's log was read from
// in their place, as seen from where the run began, wherever this is called.
Result<Config> parse_stored(const RunInfo& info, const Problem& problem);

// RunInfo::overrides with these in place of those that it has.
std::string merged_overrides(const RunInfo& info, const EvolutionOverrides& overrides);

// The run's config and problem, with its overrides and then these.
Result<Config> stored_config(const RunInfo& info, const EvolutionOverrides& overrides);

// The values of a member of `generation`.  Errors: it did not end well, or is of other genes.
Result<Model> model_of_member(const RunReader& run, const StoredIndividual& member,
                              std::uint64_t generation);

// The best of the last committed generation, of several objectives the knee of its front.  Errors:
// none was committed, or nothing of it ends well.
Result<Model> current_best(const RunReader& run);

}  // namespace gapfarm
