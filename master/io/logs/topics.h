// Messages of a bag, put into one table a topic.
#pragma once

#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "master/io/logs/bags.h"

namespace gapfarm {

// ROS messages: their definitions, and the numbers in their bytes.
enum class MessageWire { kRos1, kCdr };

// What stands in one message, by path: "pose.position.x", "velocity[2]", "header.stamp" (s).
struct MessageContent {
  std::vector<std::pair<std::string, double>> numbers;
  std::map<std::string, std::string, std::less<>> texts;
};

class MessageDecoder;

// A type with all types within it.
class MessageSchema {
 public:
  // `definition` as bags and MCAP files hold it: the type's own lines, then "MSG: package/Type"
  // blocks between lines of '='.  Errors: a field whose type is not defined, types within
  // themselves.
  static Result<MessageSchema> parse(const std::string& type, std::string_view definition);
  // Of the types that rosbag2 files name without defining; an error for others.
  static Result<MessageSchema> known(const std::string& type);

  // Errors say at which byte the message ends too soon, or which array is longer than the message.
  Result<MessageContent> decode(std::string_view bytes, MessageWire wire) const;

 private:
  struct Field {
    std::string name;
    bool (MessageDecoder::*read)(const std::string& path) = nullptr;  // of a primitive
    std::string type;                                                 // else one of types_
    bool array = false;
    std::size_t fixed = 0;  // elements of an array; 0: the message says
  };
  using Fields = std::vector<Field>;

  Status check(const std::string& type, int depth) const;

  std::string type_;
  std::map<std::string, Fields, std::less<>> types_;
  friend class MessageDecoder;
};

// "geometry_msgs/Twist" of "geometry_msgs/msg/Twist"; the other way keeps what it is.
std::string short_type(std::string_view type);
// Whether robots that drive need this type.
bool serves_ground_robots(std::string_view type);

// What a bag says of a topic.
struct BagTopic {
  std::string name, type;
  MessageWire wire = MessageWire::kCdr;
  std::optional<MessageSchema> schema = {};  // none: its messages are not read
};

class Topics {
 public:
  Topics(std::string file, std::string format);

  // Keeps a message's numbers in the topic's table, "t" being the time of recording; transforms
  // go to a table for each child frame, joints' values to columns velocity.NAME.  Of topics that
  // are not read, messages are counted only.  Errors: a message that is shorter than its type, more
  // numbers than a log of drives has.
  Status add(const BagTopic& of, double t_s, std::string_view bytes);

  Recording finish();

 private:
  struct Rows {
    std::string type, frame, child;
    std::map<std::string, std::size_t, std::less<>> columns;
    std::vector<std::string> names;
    std::vector<std::vector<std::pair<std::size_t, double>>> rows;
  };
  Status skip(const BagTopic& of);
  // `at`: the path of what the numbers are of, for its frames.
  Status put(const std::string& topic, const std::string& type, double t_s,
             const std::vector<std::pair<std::string, double>>& numbers,
             const MessageContent& content, const std::string& at = "");

  Recording recording_;
  std::map<std::string, Rows> topics_;
  std::map<std::string, std::pair<std::string, std::size_t>> skipped_;
  std::size_t numbers_ = 0;
};

// Seconds of a time that bags keep in ns since 1970: with the digits that a double has for both.
inline double seconds_of(std::uint64_t ns) {
  constexpr std::uint64_t kSecond = 1'000'000'000;
  return static_cast<double>(ns / kSecond) + 1e-9 * static_cast<double>(ns % kSecond);
}

// Takes values off the front of bytes, little-endian; after one that is not there nothing is good.
class ByteCursor {
 public:
  explicit ByteCursor(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  T number() {
    T value{};
    const std::string_view raw = take(sizeof value);
    if (good_) std::memcpy(&value, raw.data(), sizeof value);
    return value;
  }
  // With its length before it.
  std::string_view text() { return take(number<std::uint32_t>()); }
  std::string_view take(std::uint64_t count);
  std::string_view rest() const { return bytes_; }
  bool good() const { return good_; }

 private:
  std::string_view bytes_;
  bool good_ = true;
};

// What readers of bags that are records share; `at`: a place in the file.
class BagRecords {
 protected:
  // `remedy`: of a file that was damaged.
  BagRecords(ByteSource& source, const std::string& file, const char* format, const char* remedy)
      : source_(source), file_(file), remedy_(remedy), topics_(file, format) {}

  Error error(std::uint64_t at, const std::string& found, const std::string& expected,
              const char* remedy = nullptr) const;
  Error cut(std::uint64_t at) const {
    return error(at, "the end of the file within a record", "whole records");
  }
  // `length` bytes at `from`, of the record at `at`.  Errors: there are not, or more than 1 GiB.
  Result<std::string> bytes(std::uint64_t at, std::uint64_t from, std::uint64_t length) const;
  Result<std::string> unpacked(std::uint64_t at, std::string_view packed, const std::string& how,
                               std::uint64_t size) const;
  // A topic's schema by its definition.
  Result<MessageSchema> schema(std::uint64_t at, const std::string& type,
                               const std::string& definition) const;
  Status add(std::uint64_t at, const BagTopic& topic, double t_s, std::string_view message);

  ByteSource& source_;
  const std::string& file_;
  const char* remedy_;
  Topics topics_;
};

// What wheels made up: by the frame of its poses, else by its type.
bool is_odometry(const LogTable& table);

// False of transforms between parts of the robot, and of a localiser's corrections.
bool shows_robot(const Recording& recording, const LogTable& table);

// Adds a table /tf:MAP:CHILD for transforms of odometry that a localiser corrects (MAP to
// odometry's frame): each with the last correction that was recorded.  None where these never
// change.
void add_localised(Recording& recording);

}  // namespace gapfarm
