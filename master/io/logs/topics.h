// Messages of a bag, put into one table a topic.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "master/io/logs/log_table.h"
#include "master/io/logs/message.h"

namespace gapfarm {

class Topics {
 public:
  Topics(std::string file, std::string format);

  // Keeps the message's numbers in the topic's table, "t" being the time of recording; transforms
  // go to a table for each child frame, joints' values to columns velocity.NAME.  Types that serve
  // no robot are counted only.  Errors: a message that is shorter than its type, more numbers than
  // a log of drives has.
  Status add(const std::string& topic, const std::string& type, const MessageSchema& schema,
             MessageWire wire, double t_s, std::string_view bytes);
  // Counts a message of a topic that is not read.
  void skip(const std::string& topic, const std::string& type);

  Recording finish();

 private:
  struct Rows {
    std::string type;
    std::map<std::string, std::size_t, std::less<>> columns;
    std::vector<std::string> names;
    std::vector<std::vector<std::pair<std::size_t, double>>> rows;
  };
  Status put(const std::string& topic, const std::string& type, double t_s,
             const std::vector<std::pair<std::string, double>>& numbers);

  Recording recording_;
  std::map<std::string, Rows> topics_;
  std::map<std::string, std::pair<std::string, std::size_t>> skipped_;
  std::size_t numbers_ = 0;
};

}  // namespace gapfarm
