// gapfarm diagnose on pushes as a user runs it, on logs whose truth is known.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "common/trials/read.h"
#include "tests/integration/diagnose_program.h"

namespace gapfarm::diagnose_pushes_test {

constexpr const char* kConfig = R"(scenario = "push"
[parameters]
step_rate = 60
shape_factor = 0.6
[genes]
shape_factor = [0.2, 1.0]
finger_friction = [0.02, 1.0]
[simulate]
sessions = 1
[[pieces]]
name = "square"
corners = [[0, 0], [0.12, 0], [0.12, 0.12], [0, 0.12]]
origin = "centroid"
thickness = 0.01
mass = 0.15
[[pieces]]
name = "triangle"
corners = [[0, 0], [0.17, 0], [0.085, 0.085]]
thickness = 0.01
mass = 0.08
)";

using Json = nlohmann::json;

class DiagnosePushes : public ::testing::Test {
 protected:
  Json diagnose(int pushes, const std::vector<std::string>& set,
                const std::vector<std::string>& more = {}) {
    const std::string config = folder_.write("c.toml", kConfig);
    simulate_log(config, folder_ / "pushes.csv", pushes, set);
    const Json diagnosis = diagnose_log(config, folder_ / "pushes.csv", folder_ / "d", more);
    report_ = text_of(folder_ / "d/report.html");
    return diagnosis;
  }

  // Of the planar simulator, at half the rate of steps and without what is excluded: minutes less.
  Json diagnose_planar(const char* seed, const std::vector<std::string>& set,
                       const std::vector<std::string>& excluded) {
    std::vector<std::string> make = {folder_.path().string(), seed};
    make.insert(make.end(), set.begin(), set.end());
    const Finished made = run_program("planar_push_log", make);
    EXPECT_EQ(made.exit_code, 0) << made.err;
    std::vector<std::string> more = {"--exclude"};
    more.insert(more.end(), excluded.begin(), excluded.end());
    return diagnose_log(folder_.write("c.toml", shipped_config("push.toml", 60)),
                        folder_ / "trials.csv", folder_ / "d", more);
  }

  TemporaryFolder folder_;
  std::string report_;
};

TEST_F(DiagnosePushes, NamesAnEffectWithAnIntervalAndClosesTheGap) {
  const Json d = diagnose(50, {"com_offset.y=0.008"});
  EXPECT_EQ(d["verdict"], "effect") << d["headline"];
  ASSERT_EQ(d["effects"].size(), 1u);
  EXPECT_EQ(d["effects"][0]["name"], "com_offset");
  // What was found on the way stays to be seen.
  const Finished status = gapfarm_command({"status", folder_ / "d"});
  EXPECT_NE(status.out.find("Chosen from the catalogue so far: com_offset"), std::string::npos)
      << status.out;
  const Json& y = d["effects"][0]["parameters"]["y"];
  EXPECT_LT(y["lo"], 0.008);
  EXPECT_GT(y["hi"], 0.008);
  EXPECT_GT(y["lo"], 0.004);
  EXPECT_LT(d["gap"]["final"], d["gap"]["tuned"]);
  // The pictures show what pushes depend on, and no word of what a robot is reported.
  EXPECT_EQ(d["pictures"]["x"], "along the push");
  EXPECT_NE(report_.find("along and across the push"), std::string::npos);
  const std::size_t body = report_.find("<body>");
  for (const char* word : {" tread", "motor", " robot"}) {
    EXPECT_EQ(report_.substr(body, report_.find("<script>") - body).find(word), std::string::npos)
        << word;
  }
  // The model wrote predicts the log that it was made for.
  const Finished predicted = gapfarm_command(
      {"predict", folder_ / "d/model.toml", "--trials", folder_ / "pushes.csv", "--out", "-"});
  EXPECT_EQ(predicted.exit_code, 0) << predicted.err;
  // The report can be made again from the diagnosis alone.
  const Finished again =
      gapfarm_command({"report", folder_ / "d/diagnosis.json", "--out", folder_ / "again.html"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
}

TEST_F(DiagnosePushes, ReportNoneWhenNothingIsMissing) {
  const Json d = diagnose(50, {});
  EXPECT_EQ(d["verdict"], "none") << d["headline"];
  EXPECT_TRUE(d["effects"].empty());
  for (const Json& row : d["screening"]) {
    // A drive's reason.
    EXPECT_EQ(row["note"].get<std::string>().find("full speed"), std::string::npos) << row;
    if (row["effect"] != "com_offset") continue;
    // 8 mm is named elsewhere.
    EXPECT_GT(row["detectable_from"]["y"], 0.0005);
    EXPECT_LT(row["detectable_from"]["y"], 0.008);
  }
}

// Seed 137 of scripts/foreign_pushes.sh: a disc of table seemed to explain more than the lens, but
// predicted nothing.
TEST_F(DiagnosePushes, WhatPredictsNothingKeepsNoOtherFromBeingFound) {
  const Json d = diagnose_planar(
      "137", {"camera_distortion.k1=0.15", "camera_distortion.x=0.5", "camera_distortion.y=0.5"},
      {"friction_anisotropy", "friction_speed", "table_tilt", "com_offset", "pressure_distribution",
       "finger_compliance", "placement_bias", "marker_offset", "camera_aspect"});
  EXPECT_EQ(d["verdict"], "effect") << d["headline"];
  ASSERT_EQ(d["effects"].size(), 1u);
  EXPECT_EQ(d["effects"][0]["name"], "camera_distortion");
  // What was tried first stays in the table.
  const auto of_patch = [](const Json& row) { return row["effect"] == "friction_patch"; };
  EXPECT_TRUE(std::any_of(d["screening"].begin(), d["screening"].end(), of_patch));
}

// The scale is free beside an aspect, which then does as well, here by half a nat better.
TEST_F(DiagnosePushes, AScaleIsNotNamedAnAspect) {
  const Json d =
      diagnose_planar("136", {"pose_scale.ratio=1.06"},
                      {"friction_anisotropy", "friction_speed", "friction_patch", "table_tilt",
                       "com_offset", "pressure_distribution", "finger_compliance", "placement_bias",
                       "marker_offset", "camera_distortion"});
  ASSERT_EQ(d["effects"].size(), 1u) << d["headline"];
  EXPECT_EQ(d["effects"][0]["name"], "pose_scale");
  EXPECT_NEAR(d["effects"][0]["parameters"]["ratio"]["value"], 1.06, 0.005);
}

// Both are found, and neither may pass for the other where one alone is fitted.
TEST_F(DiagnosePushes, NamesBothOfTwo) {
  const Json d =
      diagnose_planar("151",
                      {"table_tilt.angle=0.06", "table_tilt.direction=-2", "com_offset.x=-0.006",
                       "com_offset.y=0.004"},
                      {"friction_anisotropy", "friction_speed", "friction_patch",
                       "pressure_distribution", "finger_compliance", "placement_bias",
                       "marker_offset", "camera_distortion", "camera_aspect", "pose_scale"});
  std::set<std::string> names;
  for (const Json& effect : d["effects"]) names.insert(effect["name"]);
  EXPECT_EQ(names, (std::set<std::string>{"com_offset", "table_tilt"})) << d["headline"];
}

TEST_F(DiagnosePushes, OfAFewPushesNothingIsReported) {
  const Json d = diagnose(12, {"com_offset.y=0.008"});
  EXPECT_EQ(d["verdict"], "unusable") << d["headline"];
  EXPECT_TRUE(d["effects"].empty());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "d/model.toml"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "d/tuned.toml"));
}

TEST_F(DiagnosePushes, PlansPushesWithTheFingersWays) {
  const std::string config = folder_.write("c.toml", kConfig);
  const std::string plan = folder_ / "plan/pushes.csv";
  const Finished planned =
      gapfarm_command({"plan", config, "--trials", "12", "--pool", "3", "--effects", "com_offset",
                       "--out", plan, "--workers", "1"});
  ASSERT_EQ(planned.exit_code, 0) << planned.err;
  EXPECT_THAT(planned.out, testing::HasSubstr(folder_ / "plan/tips.csv" + " and " + plan +
                                              ": 12 pushes to make, in this order"));
  EXPECT_THAT(planned.out, testing::Not(testing::HasSubstr("chains")));
  const Finished driven = gapfarm_command({"simulate", config, "--like", plan, "--out",
                                           folder_ / "driven/pushes.csv", "--workers", "1"});
  EXPECT_EQ(driven.exit_code, 0) << driven.err;
  // Each piece is put down where its finger goes, not where the piece before it lies.
  const std::vector<std::string> pieces = {"square", "triangle"};
  const auto log = read_trial_files(std::vector<std::string>{plan}, pieces);
  ASSERT_TRUE(log.ok()) << log.error().message;
  ASSERT_EQ(log->trials.size(), 12u);
  for (std::size_t i = 1; i < log->trials.size(); ++i) {
    EXPECT_NE(log->trials[i].X_WS, log->trials[i - 1].X_WE) << i;
  }
  const Finished chained = gapfarm_command(
      {"plan", config, "--trials", "12", "--chain", "3", "--out", folder_ / "other.csv"});
  EXPECT_EQ(chained.exit_code, 2);
  EXPECT_NE(chained.err.find("put down before every push"), std::string::npos) << chained.err;
}

// What was simulated at the config's own values is only scored again, which costs nothing.
TEST(CheckPushes, MeasuresWhatAnEvaluationOfEvolveCosts) {
  const TemporaryFolder folder;
  ASSERT_EQ(run_program("planar_push_log", {folder.path().string(), "1"}).exit_code, 0);
  const Finished checked = gapfarm_command({"check", GAPFARM_SOURCE_DIR "/configs/push.toml",
                                            "--trials", folder / "trials.csv", "--json"});
  ASSERT_EQ(checked.exit_code, 0) << checked.err;
  // 95 pushes of some hundred steps; a fiftieth of what a quick machine takes.
  EXPECT_GT(Json::parse(checked.out)["evaluation_s"].get<double>(), 0.001);
}

TEST(EvolvePushes, BeginsWithTheWarningsOfCheck) {
  const TemporaryFolder folder;
  ASSERT_EQ(run_program("planar_push_log", {folder.path().string(), "1"}).exit_code, 0);
  const std::vector<std::string> pieces = {"square", "parallelogram", "triangle_s", "triangle_l"};
  auto log = read_trial_files({{folder / "trials.csv"}}, pieces);
  ASSERT_TRUE(log.ok()) << log.error().message;
  for (Trial& trial : log->trials) {
    for (Pose* X : {&trial.X_WS, &trial.X_WE}) *X = {1000 * X->x, 1000 * X->y, X->theta};
    for (TipSample& s : trial.tip) s = {s.t_s, 1000 * s.x, 1000 * s.y};
  }
  ASSERT_TRUE(write_trials(*log, folder / "mm/pushes.csv").ok());
  const Finished plan =
      gapfarm_command({"evolve", GAPFARM_SOURCE_DIR "/configs/push.toml", "--trials",
                       folder / "mm/pushes.csv", "--out", folder / "run", "--dry-run"});
  EXPECT_EQ(plan.exit_code, 0) << plan.err;
  EXPECT_NE(plan.err.find("unit_error: "), std::string::npos) << plan.err;
  EXPECT_NE(plan.err.find("Multiply the positions of pieces and finger by 0.001"),
            std::string::npos)
      << plan.err;
}

}  // namespace gapfarm::diagnose_pushes_test
