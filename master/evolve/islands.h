// Islands: several populations, each an optimiser of its own over the same genes, that wait for one
// another as little as possible.  Before each generation an island meets one or two others as they
// were a generation or two before, near and far by turns (steps of 1, 2, 4, ... round a ring).
// What it learns from them is its method's: Optimiser::meet().
//
// No order in which results arrive shows: what an island does follows from its own results and
// from those that other islands had at stated generations.  So whoever drives islands may let each
// go on as soon as its own generation is complete.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "master/evolve/optimiser.h"

namespace gapfarm {

// The islands of an Optimiser; for who drives them one by one instead of by ask() and tell().
// Meanwhile the Optimiser itself shows the last generation that advance() has reached.
class Islands {
 public:
  virtual ~Islands() = default;

  // What an island asks for, a generation of it.
  struct Lot {
    std::size_t island = 0;
    std::vector<Candidate> candidates;  // at least one
  };
  // Begins a generation, none after `last`, on every island that has none under way and needs
  // nothing that others do not have yet.
  virtual std::vector<Lot> begin(std::uint64_t last) = 0;
  // Scores in the order of the island's lot; completes its generation.
  virtual void tell_island(std::size_t island, std::span<const Score> scores) = 0;
  // The Optimiser goes on to its next generation.  False: some island has not completed it.
  virtual bool advance() = 0;
  // Births of a generation, of all islands.
  virtual std::uint64_t population() const = 0;
};

// Into how many islands the setup's population goes; 1: it stays whole.  Errors: a method that
// cannot be split, a population too small for it.
Result<unsigned> island_count(const OptimiserSetup& setup);

// REQUIRES: island_count() is above 1.  Errors: as make_optimiser().
Result<std::unique_ptr<Optimiser>> make_islands(const OptimiserSetup& setup);

}  // namespace gapfarm
