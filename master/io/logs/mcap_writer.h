// Messages as JSON in an MCAP file (https://mcap.dev/spec), for Foxglove and PlotJuggler.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace gapfarm {

class McapWriter {
 public:
  // A topic whose messages are of this JSON Schema.  At most 65535.
  std::uint16_t add_channel(const std::string& topic, const std::string& schema_name,
                            const std::string& schema);
  // In any order.  REQUIRES: a channel of add_channel().
  void add_message(std::uint16_t channel, std::uint64_t time_ns, std::string json);
  // The whole file: chunks without compression in the order of time, their index, a summary.
  std::string finish();

 private:
  struct Channel {
    std::string topic;
    std::uint16_t schema = 0;
    std::uint32_t messages = 0;
  };
  struct Message {
    std::uint64_t time_ns = 0;
    std::uint16_t channel = 0;
    std::string json;
  };

  std::string schema_records() const;
  std::string channel_records() const;

  std::vector<std::pair<std::string, std::string>> schemas_;  // name, text
  std::vector<Channel> channels_;
  std::vector<Message> messages_;
};

}  // namespace gapfarm
