// Messages of a bag, put into one table a topic.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "master/io/logs/log_table.h"
#include "master/io/logs/message.h"

namespace gapfarm {

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

// Which tables of a bag have the robot's poses in the world, and which only odometry's.

// What wheels made up: by the frame of its poses, else by its type.
bool is_odometry(const LogTable& table);

// False of transforms between parts of the robot, and of a localiser's corrections.
bool shows_robot(const Recording& recording, const LogTable& table);

// Adds a table /tf:MAP:CHILD for transforms of odometry that a localiser corrects (MAP to
// odometry's frame): each with the last correction that was recorded.  None where these never
// change.
void add_localised(Recording& recording);

}  // namespace gapfarm
