#include "master/cli/subcommand.h"

namespace gapfarm {

std::span<const Subcommand> subcommands() {
  static constexpr Subcommand kTable[] = {
#define COMMAND(folder, file, name, summary, group) {name, summary, group, setup_##file},
#include "master/cli/commands.inc"
  };
  return kTable;
}

}  // namespace gapfarm
