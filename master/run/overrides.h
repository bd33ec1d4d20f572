// Settings of a run that may be given on the command line and outrank the config.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/config/settings.h"

namespace gapfarm {

struct EvolutionOverrides {
  std::optional<std::uint64_t> generations;
  std::optional<std::uint64_t> evaluations;
  std::optional<double> time_s;
  std::optional<double> target_fitness;
  std::optional<unsigned> population;

  void apply(EvolutionSettings& settings) const;
  // Those of `later` where it has them.
  void merge(const EvolutionOverrides& later);
  std::string to_json() const;
  static EvolutionOverrides from_json(const std::string& text);
};

}  // namespace gapfarm
