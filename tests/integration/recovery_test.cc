// From a log to a model that predicts: a robot whose parameters are known drives two logs,
// evolution sees one of them, and its model is judged by the motion in the other.  Not by its
// parameters: different genomes may explain the same motion.
#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/integration/run_program.h"
#include "tests/unit/trials/shared_data.h"

namespace gapfarm::recovery_test {

using ::testing::HasSubstr;

// 60 Hz: turns and distances are those of 240 Hz within the robot's own scatter, at a quarter of
// the cost.
constexpr const char* kRobot =
    "[parameters]\n"
    "step_rate = 60\n"
    "friction = 0.45\n"
    "contact_length = 0.058\n"
    "full_speed = 0.31\n";
constexpr const char* kNoise =
    "drive_noise_common = 0.03\n"
    "drive_noise_side = 0.02\n"
    "pose_noise_position = 0.003\n"
    "pose_noise_heading = 0.012\n";

// Mean of a column of a prediction, which is its last one.
double mean_log_score(const std::string& csv) {
  std::istringstream lines(csv);
  std::string line;
  std::getline(lines, line);
  EXPECT_THAT(line, ::testing::EndsWith(",log_score"));
  double sum = 0;
  int count = 0;
  for (; std::getline(lines, line); ++count) sum += std::stod(line.substr(line.rfind(',') + 1));
  return sum / count;
}

class Recovery : public ::testing::Test {
 protected:
  void expect_done(const std::vector<std::string>& arguments) {
    finished_ = gapfarm_command(arguments);
    ASSERT_EQ(finished_.exit_code, 0) << finished_.err;
  }

  double score(const std::string& model, const std::string& trials) {
    expect_done({"predict", model, "--trials", trials, "--out", "-"});
    return mean_log_score(finished_.out);
  }

  const TemporaryFolder folder_;
  Finished finished_;
};

TEST_F(Recovery, PredictsASecondLogAsWellAsTheTruth) {
  const std::string robot = folder_.write("robot.toml", std::string(kRobot) + kNoise);
  const std::string truth =
      folder_.write("truth.toml", std::string("model = 1\n") + kRobot + "[noise]\n" + kNoise);
  const std::string evolution = folder_.write("evolution.toml",
                                              "[parameters]\n"
                                              "step_rate = 60\n"
                                              "[genes]\n"
                                              "friction = [0.1, 1.5]\n"
                                              "contact_length = [0.03, 0.12]\n"
                                              "full_speed = [0.1, 0.6]\n"
                                              "drive_noise_common = [0.0, 0.15]\n"
                                              "drive_noise_side = [0.0, 0.15]\n"
                                              "pose_noise_position = [0.0005, 0.03]\n"
                                              "pose_noise_heading = [0.002, 0.15]\n"
                                              "[evolution]\n"
                                              "population = 24\n"
                                              "seed_nominal = false\n"
                                              "mutation_sigma = 0.05\n"
                                              "[evolution.stop]\n"
                                              "generations = 50\n");
  const std::string seen = folder_ / "seen.csv", unseen = folder_ / "unseen.csv";
  expect_done(
      {"simulate", robot, "--seed", "11", "--sessions", "3", "--trials", "100", "--out", seen});
  // Longer, so that the luck of the draw does not decide.
  expect_done(
      {"simulate", robot, "--seed", "12", "--sessions", "10", "--trials", "100", "--out", unseen});
  expect_done({"evolve", evolution, "--trials", seen, "--out", folder_ / "run"});
  const double evolved = score(folder_ / "run", unseen);
  const double best_possible = score(truth, unseen);
  RecordProperty("nats_below_truth", std::to_string(best_possible - evolved));
  EXPECT_GT(evolved, best_possible - 0.05);
  // And the truth is worth reaching: the robot that the config describes is far from it.
  EXPECT_GT(evolved, score(folder_.write("nominal.toml", "model = 1\n"), unseen) + 1);
}

// Where the public log is at hand: GAPFARM_SHARED, or ../shared beside the sources.
TEST_F(Recovery, ReachesTheRealForwardLog) {
  const auto data = shared_data("srv1_forward");
  if (!data) GTEST_SKIP() << "no shared data beside the sources";
  std::vector<std::string> arguments = {"evolve", GAPFARM_SOURCE_DIR "/configs/srv1_forward.toml",
                                        "--out", folder_ / "run", "--trials"};
  for (const std::string& file : files_in(*data, ".dat")) arguments.push_back(file);
  expect_done(arguments);
  // 519 lines, the last of run40.dat cut short: reported, and not made up.
  EXPECT_THAT(finished_.err, HasSubstr("on 518 trials"));
  EXPECT_THAT(finished_.err, HasSubstr("run40.dat:172:15: found the end of the line"));
  expect_done({"status", folder_ / "run", "--json"});
  const auto status = nlohmann::json::parse(finished_.out);
  EXPECT_EQ(status["fitness"], "robust_mahalanobis");
  EXPECT_LT(status["best_fitness"], 0.05);
  EXPECT_EQ(status["quarantined"], 0);

  arguments = {"import", "bbautotune", "--out", folder_ / "trials.csv"};
  for (const std::string& file : files_in(*data, ".dat")) arguments.push_back(file);
  expect_done(arguments);
  EXPECT_THAT(finished_.out, HasSubstr("518 trials in 26 sessions"));
  EXPECT_THAT(finished_.err, HasSubstr("run40.dat:172:15"));
}

}  // namespace gapfarm::recovery_test
