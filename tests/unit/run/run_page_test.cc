// A run's page from a store that was made up, as large as a night's.
#include "master/run/run_page.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "master/run/stored_run.h"
#include "master/store/database.h"
#include "master/store/run_store.h"
#include "tests/temporary_folder.h"
#include "tests/unit/run/config_of_run.h"

namespace gapfarm::run_page_test {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr std::size_t kPopulation = 12;

class RunPage : public testing::Test {
 protected:
  RunPage() { fs::copy_file(GAPFARM_SOURCE_DIR "/configs/demo/trials.csv", folder_ / "apart.csv"); }

  fs::path run() const { return folder_ / "run"; }

  // Every individual's genes are its rank's share of the range.
  static StoredGeneration generation(const Problem& problem, std::uint64_t number) {
    StoredGeneration g;
    g.generation = number;
    g.evaluations = kPopulation * number;
    g.wall_s = 1.2345678901;
    g.operator_probabilities = {
        {"step_size", 8}, {"blend", 0.123456789}, {"gaussian", 0.876543211}};
    for (std::size_t i = 0; i < kPopulation; ++i) {
      StoredIndividual one;
      one.birth_id = kPopulation * number + i;
      one.genome.assign(problem.genes.size(), static_cast<double>(i + 1) / (kPopulation + 1));
      one.values = readable_values(problem, one.genome);
      one.fitness = -static_cast<double>(i) - 1.0 / static_cast<double>(number);
      if (number == 2 && i + 1 == kPopulation) {
        one.outcome = "WORKER_FAILED";
        one.fitness.reset();
        g.quarantined = 1;
      }
      g.individuals.push_back(std::move(one));
    }
    summarise_fitness(g, true);
    return g;
  }

  void make(std::uint64_t generations) const {
    const std::string text = "trials = [\"" GAPFARM_SOURCE_DIR
                             "/configs/demo/trials.csv\"]\n[genes]\n"
                             "friction = [0.1, 1.5]\nfull_speed = [0.1, 0.6]\n"
                             "[validation]\ntrials = [\"apart.csv\"]\n";
    const Config config = tests::config_of_run(text, (folder_ / "c.toml").string());
    auto store = RunStore::create(run(), run_info(config, {}));
    ASSERT_TRUE(store.ok()) << store.error().message;
    for (std::uint64_t g = 1; g <= generations; ++g) {
      ASSERT_TRUE(store->commit(generation(config.problem, g)).ok());
    }
  }

  RunReport read(std::optional<std::uint64_t> genome = {},
                 std::optional<std::uint64_t> generation = {}) const {
    const auto report = read_run_report({run(), genome, generation});
    EXPECT_TRUE(report.ok()) << report.error().message;
    return report ? *report : RunReport();
  }

  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(RunPage, StaysSmallHoweverLongTheRun) {
  make(60);
  RunReport report = read();
  report.served = true;
  for (std::uint64_t g = 61; g <= 100000; ++g) {
    report.generations.push_back({g, -1.0 / static_cast<double>(g), -2.123456789, -3.3, 12 * g, 1});
  }
  const std::string page = run_html(report);
  EXPECT_LT(page.size(), 2'000'000u);
  EXPECT_EQ(report.elite.lines.size(), kPopulation);
  EXPECT_EQ(report.elite.axes.size(), 2u);
  EXPECT_THAT(report.operators, testing::ElementsAre("blend", "gaussian")) << "no step sizes";
  EXPECT_THAT(report.probabilities.back(), testing::ElementsAre(0.123456789, 0.876543211));
}

TEST_F(RunPage, FindsAnyGenomeAndTheBestOfAnyGeneration) {
  make(3);
  const RunReport report = read(kPopulation * 2 + 3, 1);
  ASSERT_TRUE(report.looked_up);
  EXPECT_EQ(report.looked_up->generation, 2u);
  ASSERT_EQ(report.looked_up_values.size(), 2u);
  EXPECT_THAT(report.looked_up_values[1].second, HasSubstr("m/s"));
  EXPECT_EQ(report.genomes_of, 1u);
  EXPECT_EQ(report.genomes.front().individual.birth_id, kPopulation);
  EXPECT_THAT(run_html(report), HasSubstr("--genome " + std::to_string(kPopulation * 2 + 3)));
  EXPECT_THAT(read(999).without_looked_up, HasSubstr("999"));
  EXPECT_EQ(read({}, 77).genomes_of, 3u) << "there is no generation 77";
  ASSERT_EQ(report.farm.given_up.size(), 1u);
  EXPECT_EQ(report.farm.given_up[0].individual.birth_id, kPopulation * 3 - 1);
}

TEST_F(RunPage, CountsTrialsHeldOutWhileTheirFileIsThere) {
  make(1);
  EXPECT_EQ(read().held_out, 120u);
  fs::remove(folder_ / "apart.csv");
  EXPECT_EQ(read().held_out, 0u);
}

// A store without a place for what a farm copes with does not say that it was nothing.
TEST_F(RunPage, ReportsNoZerosThatNobodyCounted) {
  fs::create_directory(run());
  {
    auto database = Database::open((run() / "run.sqlite").string(), Database::Mode::kCreate);
    ASSERT_TRUE(database.ok()) << database.error().message;
    std::ostringstream sql;
    sql << std::ifstream(GAPFARM_SOURCE_DIR "/tests/integration/run_of_0_1.sql").rdbuf();
    ASSERT_TRUE(database->exec(sql.str(), "make it").ok());
  }
  const std::string page = run_html(read());
  EXPECT_THAT(page, HasSubstr("kept no account"));
  EXPECT_THAT(page, testing::Not(HasSubstr("no task was given up")));
  EXPECT_THAT(page, testing::Not(HasSubstr("retries: jobs given out again")));
}

TEST_F(RunPage, ShowsWhatDetermineLeft) {
  make(1);
  const RunReport before = read();
  ASSERT_EQ(before.parameters.size(), 2u);
  EXPECT_EQ(before.parameters[0].note, "");
  std::ofstream(run() / kDeterminedFile)
      << "parameter,value,low_95,high_95,deviation_share,determined,at_bound\n"
      << "friction," << before.parameters[0].after << ",0.15,0.45,0.1,0,0\n"
      << "full_speed,0.55,0.5,0.6,0.1,1,0\n";
  const RunReport after = read();
  EXPECT_THAT(after.parameters[0].note, HasSubstr("0.15 to 0.45"));
  EXPECT_THAT(after.parameters[0].note, HasSubstr("do not determine it"));
  EXPECT_THAT(after.parameters[1].note, HasSubstr("another value"));
  // Where the population lay is no interval, and is not pasted as one.
  const std::string page = run_html(after);
  EXPECT_THAT(page, HasSubstr("# 95 % by gapfarm determine: 0.15 to 0.45"));
  EXPECT_THAT(page, testing::Not(HasSubstr("# 90 %")));
  EXPECT_THAT(page, testing::Not(testing::ContainsRegex(", 90 % [0-9]")));
}

}  // namespace gapfarm::run_page_test
