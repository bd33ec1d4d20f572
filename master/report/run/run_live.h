// What a run's page says of how it went on: operators, populations, genomes, the farm.
#pragma once

#include <string>

#include "common/json/json.h"
#include "master/report/html.h"
#include "master/report/run/run_report.h"

namespace gapfarm {

// For plots: numbers with no more digits than these can show; null where there is none.
Json written(const std::optional<double>& value, int digits = kPlotDigits);
Json written(const std::vector<double>& values, int digits = kPlotDigits);
Json written_values(const std::vector<NamedValue>& values, int digits);

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
Json generations_json(const RunReport& report);
Json operators_json(const RunReport& report);
Json densities_json(const RunReport& report);
Json elite_json(const RunReport& report);
Json front_json(const RunReport& report);
Json sample_json(const RunReport& report);
Json timeline_json(const RunFarm& farm);

}  // namespace gapfarm
