// The config parser: no crash, errors with places, what is accepted is within bounds.
#include "common/config/config.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gapfarm;
  const auto config = parse_config(bytes_of(data, size), "f");
  if (!config.ok()) {
    promise_place(config.error().message, "f");
    return 0;
  }
  const ParameterTable& table = config->problem.table();
  for (std::size_t row = 0; row < table.size(); ++row) {
    promise(table.check(row, config->problem.values[row]).ok(), "values are within bounds");
  }
  for (const Gene& gene : config->problem.genes) {
    promise(gene.lower < gene.upper && table.check(gene.row, gene.lower).ok() &&
                table.check(gene.row, gene.upper).ok(),
            "genes are within bounds");
    for (const double g : {0.0, 0.5, 1.0}) {
      promise(table.check(gene.row, decode_gene(table, gene, g)).ok(), "genes decode");
    }
  }
  promise(config->evolution.elitism < config->evolution.population, "elites fit");
  return 0;
}
