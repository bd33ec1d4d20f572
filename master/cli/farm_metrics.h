// What a run shows to Prometheus.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "master/farm/socket_farm.h"
#include "master/store/records.h"

namespace gapfarm {

struct RunFigures {
  std::uint64_t generation = 0;
  std::uint64_t evaluations = 0;  // of this life of the master
  std::optional<double> best;     // fitness of the last generation's best
};

// The whole page.
std::string metrics_page(const SocketFarm& farm, const Progress& progress,
                         const RunFigures& figures);

}  // namespace gapfarm
