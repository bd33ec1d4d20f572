// The same small drive in every kind of bag (data/, written by make_logs.py) reads as one run.
#include "master/io/logs/bags.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/crc.hpp>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <numbers>

#include "common/trials/files.h"
#include "master/io/logs/column_map.h"
#include "master/io/logs/topics.h"
#include "tests/fuzz/memory_source.h"

namespace gapfarm::bags_test {

namespace fs = std::filesystem;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

const char* const kFiles[] = {"ros1_none.bag", "ros1_bz2.bag",  "ros1_lz4.bag", "cdr_plain.mcap",
                              "cdr_zstd.mcap", "ros1_lz4.mcap", "cdr.db3"};

std::string data(const std::string& name) {
  return std::string(GAPFARM_SOURCE_DIR) + "/tests/unit/input/data/" + name;
}

class Bags : public testing::TestWithParam<const char*> {};

TEST_P(Bags, GiveTheDriveThatWasWritten) {
  const Result<Recording> recording = read_recording(data(GetParam()));
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_THAT(recording->notes, Contains(HasSubstr("/camera (")));
  const LogMap map = guess_map({*recording});
  EXPECT_EQ(map.poses.source, "/pose");
  EXPECT_EQ(map.poses.find("t")->column, "header.stamp");
  EXPECT_EQ(map.commands.source, "/cmd_vel");
  EXPECT_EQ(map.commands.find("t")->column, "t");
  const Result<ImportedRuns> imported = to_runs({*recording}, map);
  ASSERT_TRUE(imported) << imported.error().message;
  ASSERT_EQ(imported->log.runs.size(), 1u);
  const LoggedRun& run = imported->log.runs[0];
  EXPECT_THAT(imported->log.channels, ElementsAre("v", "omega"));
  EXPECT_EQ(imported->clock_start_s, 1'700'000'000);
  ASSERT_EQ(run.poses.size(), 12u);
  for (std::size_t i = 0; i < 12; ++i) {
    const double k = static_cast<double>(i);
    EXPECT_NEAR(run.poses[i].t_s, 0.5 + 0.1 * k, 1e-6);
    EXPECT_NEAR(run.poses[i].X_WM.x, 0.1 * k, 1e-12);
    EXPECT_NEAR(run.poses[i].X_WM.y, -0.05 * k, 1e-12);
    EXPECT_NEAR(run.poses[i].X_WM.theta, 0.3 * k - 1.5, 1e-12);
  }
  ASSERT_EQ(run.commands.size(), 24u);
  EXPECT_NEAR(run.commands[7].t_s, 0.501 + 0.05 * 7, 1e-6);
  EXPECT_NEAR(run.commands[7].values[0], 0.57, 1e-12);
  EXPECT_NEAR(run.commands[7].values[1], -0.04, 1e-12);
  EXPECT_THAT(imported->log.wheel_channels, ElementsAre("left", "right"));
  ASSERT_EQ(run.wheel_speeds.size(), 12u);
  EXPECT_NEAR(run.wheel_speeds[5].values[1], -15, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Formats, Bags, testing::ValuesIn(kFiles), [](const auto& param) {
  std::string name = param.param;
  for (char& c : name) c = c == '.' ? '_' : c;
  return name;
});

// Transforms x ahead, turned by `yaw`; each message has what is given, {parent, child, x, yaw}.
struct Placed {
  std::string parent, child;
  double x, yaw;
};
class Transforms {
 public:
  void add(double t_s, const std::vector<Placed>& placed) {
    bytes_.assign("\0\1\0\0", 4);
    number<std::uint32_t>(placed.size());
    for (const Placed& one : placed) {
      number<std::uint32_t>(t_s);
      number<std::uint32_t>(0);
      for (const std::string& frame : {one.parent, one.child}) {
        number<std::uint32_t>(frame.size() + 1);
        bytes_ += frame + '\0';
      }
      for (const double v : {one.x, 0., 0., 0., 0., std::sin(one.yaw / 2), std::cos(one.yaw / 2)}) {
        number<double>(v);
      }
    }
    EXPECT_TRUE(topics_.add(tf_, t_s, bytes_));
  }
  Recording finish() { return topics_.finish(); }

 private:
  template <class T, class V>
  void number(V value) {
    const T raw = static_cast<T>(value);
    bytes_.append((4 - bytes_.size() % sizeof raw + sizeof raw) % sizeof raw, '\0');
    bytes_.append(reinterpret_cast<const char*>(&raw), sizeof raw);
  }
  BagTopic tf_{"/tf", "tf2_msgs/msg/TFMessage", MessageWire::kCdr,
               *MessageSchema::known("tf2_msgs/msg/TFMessage")};
  Topics topics_{"f", "a bag"};
  std::string bytes_;
};

TEST(Frames, OdometryIsCorrectedByTheLocaliserOrWarnedOf) {
  const Placed wheel = {"base_link", "a_wheel", 0.2, 0}, robot = {"odom", "base_link", 1, 0};
  Transforms alone, corrected;
  for (int t = 0; t < 4; ++t) {
    alone.add(t, {wheel, robot, {"map", "odom", 5, 0}});
    corrected.add(t, {wheel, robot});
    if (t == 1) corrected.add(t, {{"map", "odom", 5, 0}});
    if (t == 2) corrected.add(t, {{"map", "odom", 5, std::numbers::pi / 2}});
  }
  // A constant place of the odometry's frame corrects nothing.
  const LogMap odometry = guess_map({alone.finish()});
  EXPECT_EQ(odometry.poses.source, "/tf:base_link");
  EXPECT_THAT(odometry.notes, ElementsAre(HasSubstr("poses are odometry (f /tf:base_link)")));
  const Recording recording = corrected.finish();
  const LogMap map = guess_map({recording});
  EXPECT_EQ(map.poses.source, "/tf:map:base_link");
  EXPECT_TRUE(map.notes.empty());
  const LogTable& poses = recording.tables.back();
  const auto x = poses.find("transform.translation.x"), y = poses.find("transform.translation.y");
  ASSERT_EQ(poses.rows(), 3u);  // from the first correction on
  EXPECT_NEAR(poses.at(0, *x), 6, 1e-12);
  EXPECT_NEAR(poses.at(1, *x), 5, 1e-12);
  EXPECT_NEAR(poses.at(1, *y), 1, 1e-12);
}

TEST(Stamps, ThatShareNoMomentWithTheRecorderAreNotTaken) {
  const auto time = [](double ahead_s) {
    const LogTable table{"f",
                         "/pose",
                         "geometry_msgs/PoseStamped",
                         {"t", "header.stamp", "x", "y", "yaw"},
                         {0, ahead_s, 1, 2, 3, 30, 30 + ahead_s, 1, 2, 3}};
    return guess_map({{"f", "a bag", {table}, "", {}}}).poses.find("t")->column;
  };
  EXPECT_EQ(time(20), "header.stamp");
  EXPECT_EQ(time(40), "t");
  EXPECT_EQ(time(-40), "t");
}

TEST(Frames, OdometryTopicsInTheWorldAreNoOdometry) {
  const auto notes = [](const std::string& frame) {
    LogTable table{"f", "/state", "nav_msgs/Odometry", {"t", "x", "y", "yaw"}, {0, 1, 2, 3}};
    table.frame = frame;
    return guess_map({{"f", "a bag", {table}, "", {}}}).notes.size();
  };
  EXPECT_EQ(notes("odom"), 1u);
  EXPECT_EQ(notes(""), 1u);
  EXPECT_EQ(notes("map"), 0u);
  EXPECT_EQ(notes("ground_truth"), 0u);
}

// A file that broke off anywhere is an error with its place; nothing is half-read.
// Of six by six numbers those of x, y and the turn about z are columns.
TEST(Messages, GiveTheCovarianceOnTheFloor) {
  const auto schema = MessageSchema::known("geometry_msgs/PoseWithCovariance");
  ASSERT_TRUE(schema) << schema.error().message;
  std::string bytes("\0\1\0\0", 4);
  for (int k = -7; k < 36; ++k) {
    const double value = k;
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  const auto content = schema->decode(bytes, MessageWire::kCdr);
  ASSERT_TRUE(content) << content.error().message;
  std::vector<double> covariance;
  for (const auto& [path, value] : content->numbers) {
    if (path.starts_with("covariance")) covariance.push_back(value);
  }
  EXPECT_THAT(covariance, ElementsAre(0, 1, 5, 7, 11, 35));
}

TEST(BrokenBags, AreErrorsWithTheirPlace) {
  for (const char* name : {"ros1_none.bag", "ros1_bz2.bag", "cdr_zstd.mcap", "cdr_plain.mcap"}) {
    const Result<std::string> whole = read_text_file(data(name));
    ASSERT_TRUE(whole);
    const bool bag = std::string(name).ends_with(".bag");
    std::size_t fine = 0;
    for (std::size_t length = 1; length < whole->size(); length += 7) {
      MemorySource source(std::string_view(*whole).substr(0, length));
      const auto read = bag ? read_ros1_bag(source, "f") : read_mcap(source, "f");
      if (read) {
        ++fine;
        continue;
      }
      EXPECT_THAT(read.error().message, testing::MatchesRegex("f:[0-9]+: found .*expected .*"));
    }
    // Cut between two records of its own a bag is a shorter bag; an MCAP file lacks its footer.
    EXPECT_LE(fine, bag ? 3u : 2u) << name;
  }
}

// rosbag2 writes schemas without a text where it found no definition.
TEST(Mcap, TypesWithoutADefinitionAreKnownByName) {
  const auto number = [](std::uint64_t value, std::size_t bytes) {
    return std::string(reinterpret_cast<const char*>(&value), bytes);
  };
  const auto text = [&](const std::string& name) { return number(name.size(), 4) + name; };
  const auto record = [&](char op, const std::string& bytes) {
    return op + number(bytes.size(), 8) + bytes;
  };
  for (const std::string encoding : {"cdr", "json"}) {
    const std::string file =
        "\x89MCAP0\r\n" +
        record(3, number(1, 2) + text("geometry_msgs/msg/Twist") + text("") + text("")) +
        record(4, number(1, 2) + number(1, 2) + text("/cmd_vel") + text(encoding) + text("")) +
        record(5, number(1, 2) + std::string(20, 0) + number(256, 4) + std::string(48, '\0')) +
        record(2, std::string(20, '\0'));
    MemorySource source(file);
    const auto read = read_mcap(source, "f");
    ASSERT_TRUE(read) << read.error().message;
    if (encoding == "cdr") {
      ASSERT_EQ(read->tables.size(), 1u);
      EXPECT_TRUE(read->tables[0].find("angular.z"));
    } else {
      EXPECT_THAT(read->notes, ElementsAre(HasSubstr("json without a ROS definition, 1 messages")));
    }
  }
}

TEST(BrokenBags, ChunksAreHeldAgainstTheirChecksums) {
  McapWriter writer;
  writer.add_message(writer.add_channel("/a", "A", "{}"), 1, "{}");
  std::string file = writer.finish();
  std::uint64_t at = 8, length = 0;  // of the chunk's record
  for (; file[at] != 6; at += 9 + length) std::memcpy(&length, &file[at + 1], 8);
  std::memcpy(&length, &file[at + 1], 8);
  boost::crc_32_type crc;
  crc.process_bytes(&file[at + 9 + 40], length - 40);
  for (const auto& [checksum, fine] : {std::pair<std::uint32_t, bool>{0, true},
                                       {crc.checksum(), true},
                                       {crc.checksum() + 1, false}}) {
    std::memcpy(&file[at + 9 + 24], &checksum, 4);
    MemorySource source(file);
    const auto read = read_mcap(source, "f");
    ASSERT_EQ(read.ok(), fine);
    if (fine) continue;
    EXPECT_THAT(read.error().message, HasSubstr("f:" + std::to_string(at + 1) + ": found a chunk"));
  }
}

TEST(BrokenBags, ClaimsAreNotBelieved) {
  EXPECT_FALSE(decompress("abc", "lz4", 1ull << 40));
  EXPECT_FALSE(decompress("abc", "lz4", 1u << 20));
  EXPECT_FALSE(decompress("abc", "bz2", 16));
  EXPECT_FALSE(decompress("abc", "xz", 3));
  EXPECT_TRUE(decompress("abc", "none", 3));
}

TEST(RealBag, HoldsWhatAnotherReaderCounted) {
  const fs::path bag = fs::path(GAPFARM_SOURCE_DIR) / "../shared/data/ground/bags/bag1.bag";
  if (!fs::exists(bag)) GTEST_SKIP() << "no " << bag;
  const Result<Recording> recording = read_recording(bag.string());
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->tables.size(), 2u);
  EXPECT_EQ(recording->tables[0].topic, "/robot/pose");
  EXPECT_EQ(recording->tables[0].rows(), 9924u);
  EXPECT_EQ(recording->tables[1].topic, "/wheel_states");
  EXPECT_EQ(recording->tables[1].rows(), 2871u);
  const LogTable& poses = recording->tables[0];
  EXPECT_NEAR(poses.at(0, 0), 1649348542.221, 0.1);
  EXPECT_NEAR(poses.at(poses.rows() - 1, 0), 1649348600.988, 0.1);
}

}  // namespace gapfarm::bags_test
