// Comparisons: one config with several variants of it, to be run side by side.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/config/settings.h"

namespace gapfarm {

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

}  // namespace gapfarm
