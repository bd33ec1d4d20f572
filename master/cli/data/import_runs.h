// gapfarm import runs: logs of drives in any format to commands.csv and poses.csv.
#pragma once

#include <string>
#include <vector>

#include "master/cli/subcommand.h"
#include "master/command/outputs.h"

namespace gapfarm {

struct ImportRunsOptions {
  std::vector<std::string> files;
  std::string out;  // folder
  std::string map;  // TOML; empty: guessed
  bool print_map = false;
};

Result<int> import_runs(const ImportRunsOptions& options, Outputs& outputs, CliContext& context);

}  // namespace gapfarm
