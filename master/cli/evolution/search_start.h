// Where `evolve --from` and `resume --fix` begin.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/config/settings.h"
#include "master/command/console.h"
#include "master/store/run_reader.h"

namespace gapfarm {

// At the values of a run, of a model or of a CSV table with columns named like genes, whose rows
// become first candidates, best first where a column `fitness` or `score` says which is.  What is
// not in it stays as the config has it, and a note says so.  Errors: another robot's, no gene, a
// value outside of its gene's range; they name file, place and remedy.
Status begin_at(const std::string& from, Config& config, const std::string& config_path,
                Console& console);

struct BranchOptions {
  std::optional<std::uint64_t> generation;  // to branch off after; none: the last
  std::vector<std::string> fixed, freed;    // "GENE=VALUE"; "KEY" or "KEY=LOWER,UPPER"
};

// What a run goes on as in a run of its own: `config` is the run's (stored_config), and becomes one
// with other genes that begins at the individuals of its last generation.  Errors: nothing to
// branch off, stages, no such gene, a value that it does not take.
Status branch_off(const RunReader& run, const BranchOptions& options, Config& config);

}  // namespace gapfarm
