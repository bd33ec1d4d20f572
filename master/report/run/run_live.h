// What a run's page says of how it went on: operators, populations, genomes, the farm.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "master/report/run/run_report.h"

namespace gapfarm {

// "running, 38.1 evaluations/s, about 3 min left", in a line of its own.
std::string state_line(const RunFarm& farm);
std::string operators_section(const RunReport& report);
std::string densities_section(const RunReport& report);
std::string elite_section(const RunReport& report);
std::string front_section(const RunReport& report);
// Importance of the genes, and the fitness over two of them.
std::string understanding_section(const RunReport& report);
std::string genomes_section(const RunReport& report);
std::string farm_section(const RunFarm& farm);

// At most 2,000.
nlohmann::ordered_json generations_json(const RunReport& report);
nlohmann::ordered_json operators_json(const RunReport& report);
nlohmann::ordered_json densities_json(const RunReport& report);
nlohmann::ordered_json elite_json(const RunReport& report);
nlohmann::ordered_json front_json(const RunReport& report);
nlohmann::ordered_json sample_json(const RunReport& report);
nlohmann::ordered_json timeline_json(const RunFarm& farm);

}  // namespace gapfarm
