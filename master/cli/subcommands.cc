#include "master/cli/subcommand.h"

namespace gapfarm {

std::span<const Subcommand> subcommands() {
  static constexpr Subcommand kTable[] = {
      {"status", "say how a run is doing, live or dead", "Runs", setup_status},
      // {"check", "validate everything that a run would need; run nothing", "Data", setup_check},
      {"import", "turn other programs' logs into a trial log", "Data", setup_import},
  };
  return kTable;
}

}  // namespace gapfarm
