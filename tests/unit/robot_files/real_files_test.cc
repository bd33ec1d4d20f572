// Every URDF in the folder of real robots, where it lies beside the sources: understood, or refused
// with the reason and the remedy.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "common/trials/files.h"
#include "master/io/robot_files/understand.h"
#include "master/report/figures/figures.h"

namespace gapfarm::real_files_test {

namespace fs = std::filesystem;

fs::path folder() { return fs::path(GAPFARM_SOURCE_DIR) / "../shared/data/ground/urdf"; }

Result<RobotReading> read(const fs::path& path) {
  const auto text = read_text_file(path.string());
  if (!text) return text.error();
  const auto model = parse_urdf(*text, path.filename().string());
  if (!model) return model.error();
  return understand_robot(*model, {});
}

TEST(RealUrdfs, UnderstoodOrRefusedWithAReason) {
  if (!fs::is_directory(folder())) GTEST_SKIP() << "no " << folder();
  int files = 0, understood = 0;
  for (const auto& entry : fs::directory_iterator(folder())) {
    if (entry.path().extension() != ".urdf") continue;
    ++files;
    const auto reading = read(entry.path());
    if (!reading) {
      const std::string& message = reading.error().message;
      EXPECT_EQ(message.rfind(entry.path().filename().string() + ":", 0), 0u) << message;
      EXPECT_THAT(message, testing::HasSubstr("found "));
      EXPECT_THAT(message, testing::HasSubstr("expected "));
      EXPECT_THAT(message, testing::HasSubstr("; "));
      continue;
    }
    ++understood;
    GroundRobot completed = reading->robot;
    const Status status = complete_robot(&completed);
    EXPECT_TRUE(status) << entry.path() << (status ? "" : ": " + status.error().message);
    EXPECT_FALSE(reading->evidence.empty());
    EXPECT_FALSE(draw_robot(*reading, completed).empty());
    if (!reading->robot.mass_kg) continue;
    double sum = 0;
    for (const double load : standing_loads(completed)) sum += load;
    EXPECT_NEAR(sum, 9.81 * *reading->robot.mass_kg, 1e-6 * sum) << entry.path();
  }
  EXPECT_GT(files, 0);
  EXPECT_GE(understood, 2 * files / 3);
}

// What the makers' data sheets say.
TEST(RealUrdfs, SizesAreTheRobots) {
  if (!fs::is_directory(folder())) GTEST_SKIP() << "no " << folder();
  struct Expected {
    const char* file;
    DriveKind drive;
    double radius_m;
    double track_m;
  };
  for (const Expected& e :
       {Expected{"oems_jackal.urdf", DriveKind::kSkid, 0.098, 0.3756},
        Expected{"bullet_husky.urdf", DriveKind::kSkid, 0.17775, 0.5708},
        Expected{"oems_turtlebot3_waffle.urdf", DriveKind::kDifferential, 0.033, 0.288},
        Expected{"robotis_turtlebot3_burger.urdf", DriveKind::kDifferential, 0.033, 0.16},
        Expected{"matlab_amrPioneer3DX.urdf", DriveKind::kDifferential, 0.09, 0.3},
        Expected{"bullet_racecar.urdf", DriveKind::kAckermann, 0.05, 0.245}}) {
    if (!fs::exists(folder() / e.file)) continue;
    const auto r = read(folder() / e.file);
    ASSERT_TRUE(r) << r.error().message;
    EXPECT_EQ(r->robot.drive, e.drive) << e.file;
    double left = 0, right = 0;
    for (const RobotWheel& wheel : r->robot.wheels) {
      if (!wheel.driven) continue;
      EXPECT_NEAR(*wheel.radius_m, e.radius_m, 1e-6) << e.file;
      left = std::max(left, *wheel.y_m);
      right = std::min(right, *wheel.y_m);
    }
    EXPECT_NEAR(left - right, e.track_m, 1e-4) << e.file;
  }
}

}  // namespace gapfarm::real_files_test
