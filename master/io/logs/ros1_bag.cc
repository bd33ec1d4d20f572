#include <map>
#include <utility>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/trials/text/csv.h"
#include "master/io/logs/bags.h"
#include "master/io/logs/topics.h"

namespace gapfarm {
namespace {

constexpr std::string_view kBagMagic = "#ROSBAG V2.0\n";
constexpr std::uint32_t kMostHeader = 1u << 24;
constexpr const char* kReindex = "copy the bag again, or mend it by rosbag reindex";

enum BagOp : unsigned char { kBagMessage = 2, kBagChunk = 5, kConnection = 7 };

using Header = std::map<std::string, std::string, std::less<>>;

// "LENGTH name=value" again and again; false when a length leads out of it.
bool parse_header(std::string_view bytes, Header& to) {
  for (ByteCursor cursor(bytes); !cursor.rest().empty();) {
    const auto [name, value] = cut_at(cursor.text(), '=');
    if (!value) return false;
    to[name] = *value;
  }
  return true;
}

template <class T>
T number(const Header& header, std::string_view name) {
  const auto found = header.find(name);
  return found == header.end() ? T() : ByteCursor(found->second).number<T>();
}

class BagReader : BagRecords {
 public:
  BagReader(ByteSource& source, const std::string& file)
      : BagRecords(source, file, "a ROS 1 bag", kReindex) {}

  Result<Recording> run() {
    std::string magic;
    if (!source_.read(0, kBagMagic.size(), magic) || magic != kBagMagic) {
      return error(0, "other bytes than '#ROSBAG V2.0'", "a bag of version 2.0",
                   "older bags: rosbag fix");
    }
    at_ = kBagMagic.size();
    while (at_ < source_.size()) {
      RETURN_IF_ERROR(record());
    }
    return topics_.finish();
  }

 private:
  // A record of the file itself.
  Status record() {
    const std::uint64_t begin = at_;
    ASSIGN_OR_RETURN(const auto length, number_at(begin));
    if (length > kMostHeader) return cut(begin);
    ASSIGN_OR_RETURN(const auto head, bytes(begin, at_, length));
    Header header;
    if (!parse_header(head, header)) {
      return error(begin, "a record's header that makes no sense", "name=value fields");
    }
    at_ += length;
    ASSIGN_OR_RETURN(const auto size, number_at(begin));
    if (size > source_.size() - at_) return cut(begin);
    const auto op = number<unsigned char>(header, "op");
    const std::uint64_t from = std::exchange(at_, at_ + size);
    if (op != kBagChunk && op != kConnection && op != kBagMessage) return {};
    ASSIGN_OR_RETURN(const auto data, bytes(begin, from, size));
    return op == kBagChunk ? chunk(begin, header, data) : entry(begin, op, header, data);
  }

  // The next four bytes of the file.
  Result<std::uint32_t> number_at(std::uint64_t begin) {
    ASSIGN_OR_RETURN(const auto read, bytes(begin, at_, 4));
    at_ += 4;
    return ByteCursor(read).number<std::uint32_t>();
  }

  Status chunk(std::uint64_t begin, Header& header, std::string_view packed) {
    ASSIGN_OR_RETURN(const auto plain, unpacked(begin, packed, header["compression"],
                                                number<std::uint32_t>(header, "size")));
    for (ByteCursor rest(plain); !rest.rest().empty();) {
      Header inner;
      const std::string_view head = rest.text(), data = rest.text();
      if (!rest.good() || !parse_header(head, inner)) {
        return error(begin, "a chunk whose records do not fill it", "whole records");
      }
      RETURN_IF_ERROR(entry(begin, number<unsigned char>(inner, "op"), inner, data));
    }
    return {};
  }

  Status entry(std::uint64_t begin, unsigned char op, Header& header, std::string_view data) {
    const auto id = number<std::uint32_t>(header, "conn");
    if (op == kConnection) return connection(begin, id, header["topic"], data);
    if (op != kBagMessage) return {};
    BagTopic* topic = find_in(connections_, id);
    if (!topic) {
      return error(begin, "a message of connection " + std::to_string(id),
                   "its connection record before it");
    }
    ByteCursor time(header["time"]);
    const auto s = time.number<std::uint32_t>(), ns = time.number<std::uint32_t>();
    return add(begin, *topic, s + 1e-9 * ns, data);
  }

  Status connection(std::uint64_t begin, std::uint32_t id, const std::string& topic,
                    std::string_view data) {
    if (connections_.count(id) != 0) return {};
    Header header;
    if (!parse_header(data, header)) {
      return error(begin, "a connection whose header makes no sense", "name=value fields");
    }
    BagTopic c{topic, header["type"], MessageWire::kRos1};
    if (serves_ground_robots(c.type)) {
      ASSIGN_OR_RETURN(c.schema, schema(begin, c.type, header["message_definition"]));
    }
    connections_.emplace(id, std::move(c));
    return {};
  }

  std::uint64_t at_ = 0;
  std::map<std::uint32_t, BagTopic> connections_;
};

}  // namespace

Result<Recording> read_ros1_bag(ByteSource& source, const std::string& file) {
  return BagReader(source, file).run();
}

}  // namespace gapfarm
