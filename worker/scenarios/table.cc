#include <array>

#include "worker/scenarios/scenario.h"
#include "worker/scenarios/srv1.h"

namespace gapfarm {

std::span<const Scenario> scenarios() {
  static constexpr std::array<Scenario, 1> rows = {{
      {"srv1", "tracked robot, six atomic commands", prepare_srv1},
  }};
  return rows;
}

}  // namespace gapfarm
