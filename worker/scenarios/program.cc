#include "worker/scenarios/program.h"

#include "common/base/clock.h"

namespace gapfarm {

std::shared_ptr<ExternalSimulator> shared_simulator(const ExternalCommand& command) {
  struct Started {
    ExternalCommand command;
    std::weak_ptr<ExternalSimulator> simulator;
  };
  static thread_local std::vector<Started> all;
  std::erase_if(all, [](const Started& one) { return one.simulator.expired(); });
  for (const Started& one : all) {
    if (one.command == command) return one.simulator.lock();
  }
  auto simulator = std::make_shared<ExternalSimulator>(command, monotonic_seconds);
  all.push_back({command, simulator});
  return simulator;
}

std::optional<v1::TaskResult> refuse_to_start() {
  if (external_programs_allowed()) return std::nullopt;
  return failed_task(
      v1::WORKER_UNFIT,
      "this worker starts no programs that a master names; start it with --allow-external, and "
      "only for a master that you trust with its machine");
}

}  // namespace gapfarm
