// A folder of its own for every test, and runs to put in it.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "master/store/run_store.h"
#include "tests/temporary_folder.h"

namespace gapfarm {

class StoreTest : public ::testing::Test {
 protected:
  std::filesystem::path run() const { return folder_ / "run"; }
  std::filesystem::path file() const { return run() / "run.sqlite"; }

  static RunInfo example_info() {
    RunInfo info;
    info.config_path = "configs/srv1.toml";
    info.config_text = "seed = 1\n";
    info.problem = std::string("\x08\x00\x01", 3);
    info.problem_hash = "0123";
    info.seed = 0xfedcba9876543210u;  // beyond a signed 64-bit integer
    info.numeric_class = "c1a5";
    info.fitness = "log_score";
    info.fitness_unit = "nats/trial";
    return info;
  }

  static StoredGeneration example_generation(std::uint64_t number) {
    StoredGeneration generation;
    generation.generation = number;
    generation.diversity = 0.25;
    generation.operator_probabilities = {{"blend", 0.7}, {"gaussian", 0.3}};
    generation.evaluations = 3 * number;
    generation.wall_s = 0.5;
    generation.optimiser_state = std::string("s\0", 2) + std::to_string(number);
    for (std::uint64_t i = 0; i < 3; ++i) {
      StoredIndividual individual;
      individual.birth_id = 10 * number + i;
      individual.genome = {0.125 * static_cast<double>(i), 1.0 / static_cast<double>(number + 2)};
      individual.values = R"({"mass":0.35})";
      individual.scores = 2;
      individual.parents = {1, 2};
      individual.operators = "blend+gaussian";
      if (i < 2) {
        individual.fitness = static_cast<double>(number) - static_cast<double>(i);
      } else {
        individual.outcome = "DIVERGED";
      }
      generation.individuals.push_back(individual);
    }
    summarise_fitness(generation, true);
    return generation;
  }

  // Makes the file what schema 1 had, with the rows that fit.
  void downgrade_to_schema_1() const {
    Result<Database> database = Database::open(file(), Database::Mode::kWrite);
    ASSERT_TRUE(database.ok());
    ASSERT_TRUE(database
                    ->exec("DROP TABLE worker_events; DROP TABLE documents; DROP TABLE incidents; "
                           "ALTER TABLE progress DROP "
                           "COLUMN farm; ALTER TABLE individuals DROP COLUMN objectives; "
                           "PRAGMA user_version = 1",
                           "test")
                    .ok());
  }

  const TemporaryFolder temporary_;
  const std::filesystem::path folder_ = temporary_.path();
};

}  // namespace gapfarm
