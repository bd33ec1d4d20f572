// How the clocks of several runs stand to one another.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "common/base/ranges.h"
#include "master/ground/diagnose_ground.h"
#include "tests/unit/ground/driven_log.h"

namespace gapfarm {
namespace {

// Runs of a robot whose values are off by these, each this late.
RunLog on_clocks(const GroundRobot& robot, std::span<const double> clocks_s,
                 const Kinematics& off) {
  RunLog log;
  for (std::size_t r = 0; r < clocks_s.size(); ++r) {
    Kinematics late = off;
    late.add("delay", clocks_s[r]);
    RunLog alike = driven(robot, late);
    log.channels = alike.channels;
    log.runs.push_back(std::move(alike.runs[r]));
  }
  return log;
}

GroundDiagnosis diagnosis_of_clocks(const GroundRobot& robot, const RunLog& log) {
  auto result = diagnose_ground(robot, log, {});
  EXPECT_TRUE(result.ok()) << result.error().message;
  return *std::move(result);
}

// The caution; empty: there is none.
std::string about_clocks(const GroundDiagnosis& found) {
  for (const std::string& text : found.diagnosis.cautions) {
    if (text.find("clocks are apart") != text.npos) return text;
  }
  return "";
}

// Every run has a clock of its own: how far they are apart is in the interval of their mean,
// however long each run is.
TEST(RunClocks, AreInTheIntervalOfTheirMean) {
  const GroundRobot robot = robot_of(kDifferential);
  const double clocks_s[] = {0.37, 0.23, 0.33, 0.35, 0.27};
  const GroundDiagnosis found = diagnosis_of_clocks(robot, on_clocks(robot, clocks_s, {}));
  ASSERT_FALSE(found.diagnosis.effects.empty()) << found.diagnosis.headline;
  const NamedEffect& effect = found.diagnosis.effects.front();
  EXPECT_EQ(effect.name, "command_delay");
  const Estimate& delay = effect.parameters.at(0);
  EXPECT_LT(delay.lo, 0.31);
  EXPECT_GT(delay.hi, 0.31);
  EXPECT_GT(delay.hi - delay.lo, 0.05);  // 3.3 standard errors of these five are 0.082
  const std::string apart = about_clocks(found);
  const std::size_t second = apart.find(" s in run 2");
  ASSERT_NE(second, std::string::npos) << apart;
  EXPECT_NEAR(std::stod(apart.substr(second - 5, 5)), 0.23, 0.04) << apart;
}

// One of OptiOdom's runs of three omni wheels is 0.31 s off, and a third of all: values of the file
// that were wrong had no name beside it.
TEST(RunClocks, ARunThatIsFarOffTheOthersIsPutRightAndHidesNothing) {
  const GroundRobot robot = robot_of(kDifferential);
  const double clocks_s[] = {0.002, 0, -0.31, -0.002, 0.001};
  const RunLog log = on_clocks(robot, clocks_s, off_by({"right"}, {0.96}));
  const GroundDiagnosis found = diagnosis_of_clocks(robot, log);
  ASSERT_EQ(found.diagnosis.effects.size(), 1u) << found.diagnosis.headline;
  EXPECT_EQ(found.diagnosis.effects.front().name, "wheel_radius");
  EXPECT_NEAR(found.diagnosis.effects.front().parameters.at(0).value, -0.04, 0.004);
  EXPECT_EQ(found.diagnosis.verdict, Verdict::kEffect);
  const std::string apart = about_clocks(found);
  const std::string run = "of run 3 were moved by ";
  const std::size_t by = apart.find(run);
  ASSERT_NE(by, std::string::npos) << apart;
  EXPECT_NEAR(std::stod(apart.substr(by + run.size())), -0.31, 0.02) << apart;
}

// Another run's commands fit at some delay or other, too.
TEST(RunClocks, CommandsOfAnotherRunAreNoClock) {
  const GroundRobot robot = robot_of(kDifferential);
  const double clocks_s[] = {0, 0, 0, 0, 0};
  RunLog log = on_clocks(robot, clocks_s, {});
  const std::vector<CommandRow> own = log.runs[2].commands;
  log.runs[2].commands = log.runs[4].commands;
  for (std::size_t k = 0; k < own.size(); ++k) log.runs[2].commands[k].t_s = own[k].t_s;
  const GroundDiagnosis found = diagnosis_of_clocks(robot, log);
  EXPECT_EQ(about_clocks(found), "");
  EXPECT_NE(found.diagnosis.headline.find("Run 3 misses"), std::string::npos)
      << found.diagnosis.headline;
}

}  // namespace
}  // namespace gapfarm
