#include "master/ground/horizons.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/unit/blind/worker_farm.h"
#include "tests/unit/worker/ground_problem.h"

namespace gapfarm {
namespace {

// Run a of 12 s and run b, which the problem takes for its own.
RunLog two_runs(Problem& problem, double b_s) {
  const RunLog log{problem.ground->robot().channels,
                   {},
                   {tests::driven_run(problem, problem.values, 12, "a"),
                    tests::driven_run(problem, problem.values, b_s, "b")},
                   {}};
  tests::take_runs(problem, log.runs);
  return log;
}

TEST(Horizons, ReportEveryWindowBesideTheMedians) {
  Problem problem = tests::ground_problem();
  const RunLog log = two_runs(problem, 9);
  tests::WorkerFarm farm;
  const auto horizons = measure_horizons(farm, problem, problem.values, log, {{2, 0}, 0.5});
  ASSERT_TRUE(horizons.ok()) << horizons.error().message;
  ASSERT_EQ(horizons->rows.size(), 2u);
  const auto windows = horizons->rows[0].windows;
  ASSERT_EQ(horizons->windows.size(), windows + 2);
  const WindowRow& a = horizons->windows[windows];
  const WindowRow& b = horizons->windows[windows + 1];
  EXPECT_EQ(a.run, "a");
  EXPECT_EQ(b.run, "b");
  EXPECT_NEAR(a.duration_s, 11.45, 0.1);  // the run-in is omitted
  EXPECT_GT(a.travel_m, b.travel_m);
  // The simulation drove them itself; a skid-steer's kinematics know no slip.
  for (const WindowRow& w : {a, b}) {
    EXPECT_LT(w.simulation.position_m, 0.01);
    EXPECT_GT(w.constant_velocity.position_m, 0.1);
  }
  // The median of two is their mean.
  EXPECT_NEAR(horizons->rows[1].kinematics.heading_rad,
              (a.kinematics.heading_rad + b.kinematics.heading_rad) / 2, 1e-12);
  EXPECT_NEAR(horizons->rows[1].travel_m, (a.travel_m + b.travel_m) / 2, 1e-12);

  const std::string table = windows_csv(*horizons);
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), static_cast<long>(windows + 3));
  EXPECT_NE(table.find("\n0,,b,"), std::string::npos) << table;
  const Json json = horizons_json(*horizons);
  EXPECT_EQ(json["rows"][1]["horizon_s"], 0);
  EXPECT_EQ(json["rows"][1]["kinematics"]["heading_rad"], horizons->rows[1].kinematics.heading_rad);
}

// A farm in which the robot falls over where a task holds the trial.
class FallsOver : public tests::WorkerFarm {
 public:
  explicit FallsOver(std::uint32_t trial) : trial_(trial) {}

 private:
  Result<v1::TaskResult> answer_task(const std::string& hash, const v1::Task& task) override {
    const auto& trials = task.predict().trials();
    if (std::count(trials.begin(), trials.end(), trial_) == 0) {
      return tests::WorkerFarm::answer_task(hash, task);
    }
    v1::TaskResult result;
    result.set_outcome(v1::DIVERGED);
    return result;
  }

  std::uint32_t trial_;
};

TEST(Horizons, CountARunThatFallsOverAsInfinitelyFarOff) {
  Problem problem = tests::ground_problem();
  const RunLog log = two_runs(problem, 4);
  FallsOver farm(0);
  const auto horizons = measure_horizons(farm, problem, problem.values, log, {{2}, 0.5});
  ASSERT_TRUE(horizons.ok()) << horizons.error().message;
  EXPECT_EQ(horizons->unfinished_runs, 1u);
  EXPECT_TRUE(std::isinf(horizons->windows.front().simulation.position_m));
  EXPECT_TRUE(std::isfinite(horizons->windows.back().simulation.position_m));
  EXPECT_TRUE(std::isinf(horizons->rows[0].simulation.position_m));  // most of the windows
  EXPECT_TRUE(std::isfinite(horizons->rows[0].kinematics.position_m));
  EXPECT_NE(format_horizons(*horizons).find("\n1 run could not be simulated"), std::string::npos);
}

}  // namespace
}  // namespace gapfarm
