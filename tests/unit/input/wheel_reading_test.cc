// What columns of wheels hold, by the motions of the robot beside them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/random/stream.h"
#include "master/io/logs/column_map.h"

namespace gapfarm::wheel_reading_test {

using testing::HasSubstr;

constexpr double kRadius_m = 0.02, kSeparation_m = 0.09, kAhead_m = 0.03, kDt_s = 0.2;
constexpr std::size_t kRows = 100;

enum class Columns { kSpeeds, kChanges, kCounts };

// A sensor ahead of the wheels, whose matches err by 1 mm and 3 mrad.
Recording calibration_set(const std::string& head, Columns columns, bool times = true,
                          bool placed = false) {
  Stream stream({5, Purpose::kTest, 0, 0, 0});
  std::string text = (times ? "dt," : "") + head + "\n";
  double left = 0, right = 0, counted[2] = {7, -3};
  Pose X;
  for (std::size_t k = 0; k < kRows; ++k) {
    if (k % 7 == 0) left = 6 * stream.uniform();
    if (k % 5 == 0) right = 6 * stream.uniform();
    const double turned[2] = {left * kDt_s, right * kDt_s};
    const Pose ahead{kAhead_m, 0, 0};
    const double way = kRadius_m * (turned[0] + turned[1]) / 2;
    const double turn = kRadius_m * (turned[1] - turned[0]) / kSeparation_m;
    Pose step = inverse(ahead) * exp(Twist(way, 0, turn)) * ahead;
    step.x += 1e-3 * stream.normal();
    step.y += 1e-3 * stream.normal();
    step.theta += 3e-3 * stream.normal();
    X = X * step;
    std::vector<double> row = times ? std::vector{kDt_s} : std::vector<double>();
    for (int side = 0; side < 2; ++side) {
      counted[side] += turned[side];
      row.push_back(columns == Columns::kSpeeds    ? turned[side] / kDt_s
                    : columns == Columns::kChanges ? turned[side]
                                                   : counted[side]);
    }
    const Pose& said = placed ? X : step;
    row.insert(row.end(), {said.x, said.y, said.theta});
    for (std::size_t c = 0; c < row.size(); ++c) {
      text += (c > 0 ? "," : "") + std::to_string(row[c]);
    }
    text += "\n";
  }
  return *parse_text_log(text, "set.csv");
}

constexpr const char* kMatched = "phi_l,phi_r,sx,sy,stheta";

std::string map_of(const std::string& poses, const std::string& wheels) {
  return "[poses]\ndt = \"dt\"\nx = \"sx\"\ny = \"sy\"\ntheta = \"stheta\"\n" + poses +
         "[commands]\ndt = \"dt\"\nleft = { column = \"phi_l\"" + wheels +
         " }\nright = { column = \"phi_r\"" + wheels + " }\n";
}

std::string refusal(Columns columns, const std::string& poses, const std::string& wheels) {
  const auto map = parse_map(map_of(poses, wheels), "m.toml");
  EXPECT_TRUE(map) << map.error().message;
  const auto runs = to_runs({calibration_set(kMatched, columns)}, *map);
  return runs ? "" : runs.error().message;
}

TEST(WheelReading, NamesThatDifferByTheSideAreReadAsTheyExplainTheMotions) {
  for (const Columns columns : {Columns::kSpeeds, Columns::kChanges, Columns::kCounts}) {
    for (const bool times : {true, false}) {
      const std::string head =
          columns == Columns::kSpeeds ? "omega left,omega right,sm_x,sm_y,sm_theta" : kMatched;
      const std::vector<Recording> set = {calibration_set(head, columns, times)};
      LogMap map = guess_map(set);
      EXPECT_TRUE(map.poses.increments);
      std::swap(map.commands, map.wheels);
      const auto runs = to_runs(set, map);
      ASSERT_TRUE(runs) << runs.error().message;
      EXPECT_EQ(format_map(*parse_map(format_map(map), "m.toml")), format_map(map));
      const LoggedRun& run = runs->log.runs.at(0);
      const bool counts = columns == Columns::kCounts;  // the first of which says nothing
      ASSERT_EQ(run.commands.size(), kRows - (counts ? 1 : 0));
      EXPECT_EQ(run.poses.size(), kRows + 1);
      // Turned by in a row, whatever its length: the same.
      const double rows_s = times ? kDt_s : 1;
      const auto again =
          to_runs({calibration_set(kMatched, Columns::kChanges)},
                  *parse_map(map_of("increments = true\n", ", increment = true"), "m.toml"));
      const double turned = again->log.runs[0].commands[20].values[1] * kDt_s;
      const double speed = run.commands[counts ? 19 : 20].values[1];
      EXPECT_NEAR(speed * (columns == Columns::kSpeeds ? kDt_s : rows_s), turned, 1e-4);
    }
  }
}

TEST(WheelReading, PosesOfOneNameAreIncrementsOrNot) {
  const std::string head = "left_angle,right_angle,x,y,yaw";
  for (const bool placed : {false, true}) {
    const LogMap map = guess_map({calibration_set(head, Columns::kCounts, true, placed)});
    EXPECT_EQ(map.poses.increments, !placed);
    EXPECT_TRUE(map.wheels.find("left")->rate);
  }
}

TEST(WheelReading, AMapThatSaysOtherwiseIsRefusedWithTheRemedy) {
  const std::string relative = "increments = true\n", changes = ", increment = true";
  EXPECT_EQ(refusal(Columns::kChanges, relative, changes), "");
  EXPECT_EQ(refusal(Columns::kCounts, relative, ", rate = true"), "");
  EXPECT_EQ(refusal(Columns::kSpeeds, relative, ""), "");
  for (const std::string wheels : {"", ", increment = true"}) {
    EXPECT_THAT(refusal(Columns::kCounts, relative, wheels), HasSubstr("expected rate = true"));
  }
  EXPECT_THAT(refusal(Columns::kChanges, relative, ", rate = true"),
              HasSubstr("expected increment = true"));
  EXPECT_THAT(refusal(Columns::kChanges, "", changes), HasSubstr("increments = true of [poses]"));
}

TEST(WheelReading, RowsMayAllLastOneNumberOfSeconds) {
  const std::string text = map_of("increments = true\n", ", increment = true");
  std::string constant = text;
  for (std::size_t at; (at = constant.find("dt = \"dt\"")) != constant.npos;) {
    constant.replace(at, 9, "dt = 0.2");
  }
  const std::vector<Recording> set = {calibration_set(kMatched, Columns::kChanges)};
  const auto map = parse_map(constant, "m.toml");
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_EQ(format_map(*parse_map(format_map(*map), "m.toml")), format_map(*map));
  const RunFiles files = format_runs(to_runs(set, *map)->log);
  EXPECT_EQ(files.commands, format_runs(to_runs(set, *parse_map(text, "m.toml"))->log).commands);
  EXPECT_FALSE(parse_map("[poses]\ndt = -1\nx = \"x\"\ny = \"y\"\ntheta = \"a\"\n", "m.toml"));
}

}  // namespace gapfarm::wheel_reading_test
