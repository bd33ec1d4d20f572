// A generation in one word, so that two searches can be compared to the bit.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/base/hash.h"
#include "master/evolve/optimiser.h"
#include "tests/unit/evolve/toy_problems.h"

namespace gapfarm {

// Over the generation's number and each member's birth id, genome, outcome, cost and number of
// scores, by their bits.
inline std::string members_digest(std::uint64_t generation, std::span<const Individual> members) {
  Hasher hasher;
  hasher.add(generation).add(static_cast<std::uint64_t>(members.size()));
  for (const Individual& member : members) {
    hasher.add(member.birth_id).add(static_cast<std::uint64_t>(member.genome.size()));
    for (const double gene : member.genome) hasher.add(gene);
    hasher.add(static_cast<std::uint64_t>(member.standing.outcome)).add(member.standing.cost);
    hasher.add(static_cast<std::uint64_t>(member.standing.scores));
  }
  return hasher.finish();
}

// Members and state after each of the next `generations`.
inline std::vector<std::string> digests(ToyRun& run, int generations, bool reload_each_time) {
  std::vector<std::string> all;
  for (int i = 0; i < generations; ++i) {
    if (reload_each_time) run.reload();
    run.generation();
    const Optimiser& optimiser = run.optimiser();
    all.push_back(members_digest(optimiser.generation(), optimiser.members()) + optimiser.state());
  }
  return all;
}

}  // namespace gapfarm
