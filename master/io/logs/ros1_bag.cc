#include <cstring>
#include <map>

#include "common/trials/text/csv.h"
#include "master/io/logs/bags.h"
#include "master/io/logs/topics.h"

namespace gapfarm {
namespace {

constexpr std::string_view kBagMagic = "#ROSBAG V2.0\n";
constexpr std::uint32_t kMostHeader = 1u << 24;
constexpr std::uint32_t kMostChunk = 1u << 30;
constexpr const char* kReindex = "copy the bag again, or mend it by rosbag reindex";

enum BagOp : unsigned char { kBagMessage = 2, kBagChunk = 5, kConnection = 7 };

template <class T>
T number(std::string_view bytes) {
  T value{};
  if (bytes.size() >= sizeof value) std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

using Header = std::map<std::string, std::string, std::less<>>;

// "LENGTH name=value" again and again; false when a length leads out of it.
bool parse_header(std::string_view bytes, Header& to) {
  while (!bytes.empty()) {
    if (bytes.size() < 4) return false;
    const auto length = number<std::uint32_t>(bytes);
    bytes.remove_prefix(4);
    if (length > bytes.size()) return false;
    const std::string_view field = bytes.substr(0, length);
    const std::size_t equals = field.find('=');
    if (equals == field.npos) return false;
    to[std::string(field.substr(0, equals))] = field.substr(equals + 1);
    bytes.remove_prefix(length);
  }
  return true;
}

class BagReader {
 public:
  BagReader(ByteSource& source, const std::string& file)
      : source_(source), file_(file), topics_(file, "a ROS 1 bag") {}

  Result<Recording> run() {
    std::string bytes;
    if (!source_.read(0, kBagMagic.size(), bytes) || bytes != kBagMagic) {
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
  Error error(std::uint64_t at, const std::string& found, const std::string& expected,
              const std::string& remedy) const {
    return Error{file_ + ":" + std::to_string(at + 1) + ": found " + found + ", expected " +
                 expected + "; " + remedy + " (places are bytes)"};
  }
  Error cut(std::uint64_t at) const {
    return error(at, "the end of the file within a record", "whole records", kReindex);
  }

  // A record of the file itself.
  Status record() {
    const std::uint64_t begin = at_;
    std::string bytes;
    if (!source_.read(at_, 4, bytes)) return cut(begin);
    const auto length = number<std::uint32_t>(bytes);
    if (length > kMostHeader || !source_.read(at_ + 4, length, bytes)) return cut(begin);
    Header header;
    if (!parse_header(bytes, header)) {
      return error(begin, "a record's header that makes no sense", "name=value fields", kReindex);
    }
    at_ += 4 + length;
    if (!source_.read(at_, 4, bytes)) return cut(begin);
    const auto data = number<std::uint32_t>(bytes);
    at_ += 4;
    if (data > source_.size() - at_) return cut(begin);
    const unsigned char op = number<unsigned char>(header["op"]);
    const bool read = op == kBagChunk || op == kConnection || op == kBagMessage;
    if (read) {
      if (data > kMostChunk) {
        return error(begin, "a record of " + std::to_string(data) + " bytes", "at most 1 GiB",
                     kReindex);
      }
      if (!source_.read(at_, data, bytes)) return cut(begin);
    }
    at_ += data;
    if (op == kBagChunk) return chunk(begin, header, bytes);
    if (read) return entry(begin, op, header, bytes);
    return {};
  }

  Status chunk(std::uint64_t begin, Header& header, std::string_view bytes) {
    const auto size = number<std::uint32_t>(header["size"]);
    Result<std::string> plain = decompress(bytes, header["compression"], size);
    if (!plain) {
      return Error{file_ + ":" + std::to_string(begin + 1) + ": " + plain.error().message + "; " +
                   kReindex};
    }
    std::string_view rest = *plain;
    while (!rest.empty()) {
      Header inner;
      std::string_view data;
      if (!split(rest, inner, data)) {
        return error(begin, "a chunk whose records do not fill it", "whole records", kReindex);
      }
      RETURN_IF_ERROR(entry(begin, number<unsigned char>(inner["op"]), inner, data));
    }
    return {};
  }

  static bool split(std::string_view& rest, Header& header, std::string_view& data) {
    for (const bool head : {true, false}) {
      if (rest.size() < 4) return false;
      const auto length = number<std::uint32_t>(rest);
      rest.remove_prefix(4);
      if (length > rest.size()) return false;
      if (head && !parse_header(rest.substr(0, length), header)) return false;
      if (!head) data = rest.substr(0, length);
      rest.remove_prefix(length);
    }
    return true;
  }

  Status entry(std::uint64_t begin, unsigned char op, Header& header, std::string_view data) {
    const auto id = number<std::uint32_t>(header["conn"]);
    if (op == kConnection) return connection(begin, id, header["topic"], data);
    if (op != kBagMessage) return {};
    const auto found = connections_.find(id);
    if (found == connections_.end()) {
      return error(begin, "a message of connection " + std::to_string(id),
                   "its connection record before it", kReindex);
    }
    const std::string& time = header["time"];
    const double t =
        number<std::uint32_t>(time) + 1e-9 * number<std::uint32_t>(std::string_view(time).substr(
                                                 std::min<std::size_t>(4, time.size())));
    if (Status s = topics_.add(found->second, t, data); !s) {
      return Error{file_ + ":" + std::to_string(begin + 1) + ": " + s.error().message};
    }
    return {};
  }

  Status connection(std::uint64_t begin, std::uint32_t id, const std::string& topic,
                    std::string_view data) {
    if (connections_.count(id) != 0) return {};
    Header header;
    if (!parse_header(data, header)) {
      return error(begin, "a connection whose header makes no sense", "name=value fields",
                   kReindex);
    }
    BagTopic c{topic, header["type"], MessageWire::kRos1};
    if (serves_ground_robots(c.type)) {
      Result<MessageSchema> schema = MessageSchema::parse(c.type, header["message_definition"]);
      if (!schema) {
        return error(begin, schema.error().message, "a whole definition of the message", kReindex);
      }
      c.schema = *std::move(schema);
    }
    connections_.emplace(id, std::move(c));
    return {};
  }

  ByteSource& source_;
  const std::string& file_;
  Topics topics_;
  std::uint64_t at_ = 0;
  std::map<std::uint32_t, BagTopic> connections_;
};

}  // namespace

Result<Recording> read_ros1_bag(ByteSource& source, const std::string& file) {
  return BagReader(source, file).run();
}

}  // namespace gapfarm
