// ROS messages: their definitions, and the numbers in their bytes.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/result.h"

namespace gapfarm {

enum class MessageWire { kRos1, kCdr };

// What stands in one message, by path: "pose.position.x", "velocity[2]", "header.stamp" (s).
struct MessageContent {
  std::vector<std::pair<std::string, double>> numbers;
  std::map<std::string, std::string, std::less<>> texts;
};

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
    int primitive = -1;  // index in the table of primitives
    std::string type;    // else a type of types_
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

// The type's definition with those of the types within, ROS 2's fields; empty for other types.
std::string message_text(const std::string& type);

}  // namespace gapfarm
