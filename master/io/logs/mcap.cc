#include <boost/crc.hpp>
#include <map>

#include "common/base/ranges.h"
#include "common/trials/text/csv.h"
#include "master/io/logs/bags.h"
#include "master/io/logs/topics.h"

namespace gapfarm {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr const char* kRecover = "copy the file again, or mend it by mcap recover";

enum Op : unsigned char { kFooter = 2, kSchema = 3, kChannel = 4, kMessage = 5, kChunk = 6 };

struct Schema {
  std::string name, encoding, text;
};

class McapReader : BagRecords {
 public:
  McapReader(ByteSource& source, const std::string& file)
      : BagRecords(source, file, "an MCAP file", kRecover) {}

  Result<Recording> run() {
    std::string magic;
    if (!source_.read(0, kMagic.size(), magic) || magic != kMagic) {
      return error(0, "other bytes than MCAP's first eight", "an MCAP file", "check its name");
    }
    std::uint64_t at = kMagic.size();
    while (!ended_) {
      ASSIGN_OR_RETURN(const auto head, bytes(at, at, 9));
      ByteCursor cursor(head);
      const auto op = cursor.number<unsigned char>();
      const auto length = cursor.number<std::uint64_t>();
      if (length > source_.size() - at) return cut(at);
      if (op == kSchema || op == kChannel || op == kMessage || op == kChunk) {
        ASSIGN_OR_RETURN(const auto content, bytes(at, at + 9, length));
        RETURN_IF_ERROR(record(at, op, content));
      }
      ended_ = op == kFooter;
      at += 9 + length;
    }
    return topics_.finish();
  }

 private:
  Error broken(std::uint64_t at) const {
    return error(at, "a record that is shorter than its contents", "whole records");
  }

  Status record(std::uint64_t at, unsigned char op, std::string_view bytes) {
    ByteCursor cursor(bytes);
    if (op == kSchema) return schema(at, cursor);
    if (op == kChannel) return channel(at, cursor);
    if (op == kMessage) return message(at, cursor);
    return op == kChunk ? chunk(at, cursor) : Status();
  }

  Status chunk(std::uint64_t at, ByteCursor& cursor) {
    if (nested_) return broken(at);
    cursor.take(16);  // first and last time
    const auto size = cursor.number<std::uint64_t>();
    const auto checksum = cursor.number<std::uint32_t>();
    const std::string how(cursor.text());
    const std::string_view packed = cursor.take(cursor.number<std::uint64_t>());
    if (!cursor.good()) return broken(at);
    ASSIGN_OR_RETURN(const auto plain, unpacked(at, packed, how, size));
    boost::crc_32_type found;
    found.process_bytes(plain.data(), plain.size());
    if (checksum != 0 && checksum != found.checksum()) {
      return error(at, "a chunk whose bytes do not add up to its checksum", "those recorded");
    }
    nested_ = true;
    ByteCursor inner(plain);
    while (!inner.rest().empty()) {
      const auto op = inner.number<unsigned char>();
      const std::string_view bytes = inner.take(inner.number<std::uint64_t>());
      if (!inner.good()) return broken(at);
      RETURN_IF_ERROR(record(at, op, bytes));
    }
    nested_ = false;
    return {};
  }

  Status schema(std::uint64_t at, ByteCursor& cursor) {
    const auto id = cursor.number<std::uint16_t>();
    const auto word = [&] { return std::string(cursor.text()); };
    Schema read = {word(), word(), word()};  // in this order
    if (!cursor.good()) return broken(at);
    schemas_.emplace(id, std::move(read));
    return {};
  }

  Status channel(std::uint64_t at, ByteCursor& cursor) {
    const auto id = cursor.number<std::uint16_t>();
    const auto schema_id = cursor.number<std::uint16_t>();
    BagTopic read;
    read.name = cursor.text();
    const std::string encoding(cursor.text());
    if (!cursor.good()) return broken(at);
    if (channels_.count(id) != 0) return {};
    if (const Schema* found = find_in(schemas_, schema_id)) {
      const auto& [name, text_encoding, definition] = *found;
      read.type = name;
      read.wire = encoding == "ros1" ? MessageWire::kRos1 : MessageWire::kCdr;
      const bool text = text_encoding == "ros1msg" || text_encoding == "ros2msg";
      const bool serves = serves_ground_robots(name), cdr = encoding == "cdr";
      if ((encoding == "ros1" || cdr) && text && serves && !definition.empty()) {
        ASSIGN_OR_RETURN(read.schema, BagRecords::schema(at, name, definition));
      } else if (cdr && serves && definition.empty()) {
        // rosbag2 found no definition; as in a .db3 the type's name is to do.
        if (auto known = MessageSchema::known(name)) read.schema = *std::move(known);
      }
      if (serves && !read.schema) read.type += ", " + encoding + " without a ROS definition";
    }
    if (read.type.empty()) read.type = encoding;
    channels_.emplace(id, std::move(read));
    return {};
  }

  Status message(std::uint64_t at, ByteCursor& cursor) {
    const auto id = cursor.number<std::uint16_t>();
    cursor.take(4);  // sequence
    const auto log_time = cursor.number<std::uint64_t>();
    cursor.take(8);  // time of publishing
    if (!cursor.good()) return broken(at);
    BagTopic* channel = find_in(channels_, id);
    if (!channel) {
      return error(at, "a message of channel " + std::to_string(id),
                   "its channel record before it");
    }
    return add(at, *channel, seconds_of(log_time), cursor.rest());
  }

  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, BagTopic> channels_;
  bool nested_ = false;
  bool ended_ = false;
};

}  // namespace

Result<Recording> read_mcap(ByteSource& source, const std::string& file) {
  return McapReader(source, file).run();
}

}  // namespace gapfarm
