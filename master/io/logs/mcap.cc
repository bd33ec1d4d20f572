#include <boost/crc.hpp>
#include <cstring>
#include <map>

#include "common/trials/text/csv.h"
#include "master/io/logs/bags.h"
#include "master/io/logs/topics.h"

namespace gapfarm {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr std::uint64_t kMostRecord = 1ull << 30;
constexpr const char* kRecover = "copy the file again, or mend it by mcap recover";

enum Op : unsigned char { kFooter = 2, kSchema = 3, kChannel = 4, kMessage = 5, kChunk = 6 };

// Takes values off the front; after one that is not there nothing is good.
class Cursor {
 public:
  explicit Cursor(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  T number() {
    T value{};
    const std::string_view raw = take(sizeof value);
    if (good_) std::memcpy(&value, raw.data(), sizeof value);
    return value;
  }
  std::string_view text() { return take(number<std::uint32_t>()); }
  std::string_view take(std::uint64_t count) {
    if (!good_ || count > bytes_.size()) {
      good_ = false;
      return {};
    }
    const std::string_view front = bytes_.substr(0, count);
    bytes_.remove_prefix(count);
    return front;
  }
  std::string_view rest() const { return bytes_; }
  bool good() const { return good_; }

 private:
  std::string_view bytes_;
  bool good_ = true;
};

struct Schema {
  std::string name, encoding, text;
};

class McapReader {
 public:
  McapReader(ByteSource& source, const std::string& file)
      : source_(source), file_(file), topics_(file, "an MCAP file") {}

  Result<Recording> run() {
    std::string bytes;
    if (!source_.read(0, kMagic.size(), bytes) || bytes != kMagic) {
      return error(0, "other bytes than MCAP's first eight", "an MCAP file", "check its name");
    }
    std::uint64_t at = kMagic.size();
    while (!ended_) {
      if (!source_.read(at, 9, bytes)) return cut(at);
      const auto op = static_cast<unsigned char>(bytes[0]);
      std::uint64_t length = 0;
      std::memcpy(&length, bytes.data() + 1, 8);
      if (length > source_.size() - at) return cut(at);
      const bool read = op == kSchema || op == kChannel || op == kMessage || op == kChunk;
      if (read) {
        if (length > kMostRecord) {
          return error(at, "a record of " + std::to_string(length) + " bytes", "at most 1 GiB",
                       kRecover);
        }
        if (!source_.read(at + 9, length, bytes)) return cut(at);
        RETURN_IF_ERROR(record(at, op, bytes));
      }
      ended_ = op == kFooter;
      at += 9 + length;
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
    return error(at, "the end of the file within a record", "whole records and a footer", kRecover);
  }
  Error broken(std::uint64_t at) const {
    return error(at, "a record that is shorter than its contents", "whole records", kRecover);
  }

  Status record(std::uint64_t at, unsigned char op, std::string_view bytes) {
    Cursor cursor(bytes);
    switch (op) {
      case kSchema:
        return schema(at, cursor);
      case kChannel:
        return channel(at, cursor);
      case kMessage:
        return message(at, cursor);
      case kChunk:
        return chunk(at, cursor);
      default:
        return {};
    }
  }

  Status chunk(std::uint64_t at, Cursor& cursor) {
    if (nested_) return broken(at);
    cursor.take(16);  // first and last time
    const auto size = cursor.number<std::uint64_t>();
    const auto checksum = cursor.number<std::uint32_t>();
    const std::string how(cursor.text());
    const std::string_view packed = cursor.take(cursor.number<std::uint64_t>());
    if (!cursor.good()) return broken(at);
    const Result<std::string> plain = decompress(packed, how, size);
    if (!plain) {
      return Error{file_ + ":" + std::to_string(at + 1) + ": " + plain.error().message + "; " +
                   kRecover};
    }
    boost::crc_32_type found;
    found.process_bytes(plain->data(), plain->size());
    if (checksum != 0 && checksum != found.checksum()) {
      return error(at, "a chunk whose bytes do not add up to its checksum", "those recorded",
                   kRecover);
    }
    nested_ = true;
    Cursor inner(*plain);
    while (!inner.rest().empty()) {
      const auto op = inner.number<unsigned char>();
      const std::string_view bytes = inner.take(inner.number<std::uint64_t>());
      if (!inner.good()) return broken(at);
      RETURN_IF_ERROR(record(at, op, bytes));
    }
    nested_ = false;
    return {};
  }

  Status schema(std::uint64_t at, Cursor& cursor) {
    const auto id = cursor.number<std::uint16_t>();
    Schema read;
    read.name = cursor.text();
    read.encoding = cursor.text();
    read.text = cursor.text();
    if (!cursor.good()) return broken(at);
    schemas_.emplace(id, std::move(read));
    return {};
  }

  Status channel(std::uint64_t at, Cursor& cursor) {
    const auto id = cursor.number<std::uint16_t>();
    const auto schema_id = cursor.number<std::uint16_t>();
    BagTopic read;
    read.name = cursor.text();
    const std::string encoding(cursor.text());
    if (!cursor.good()) return broken(at);
    if (channels_.count(id) != 0) return {};
    const auto found = schemas_.find(schema_id);
    if (found != schemas_.end()) {
      const Schema& s = found->second;
      read.type = s.name;
      read.wire = encoding == "ros1" ? MessageWire::kRos1 : MessageWire::kCdr;
      const bool text = s.encoding == "ros1msg" || s.encoding == "ros2msg";
      const bool serves = serves_ground_robots(s.name), cdr = encoding == "cdr";
      if ((encoding == "ros1" || cdr) && text && serves && !s.text.empty()) {
        Result<MessageSchema> parsed = MessageSchema::parse(s.name, s.text);
        if (!parsed) {
          return error(at, parsed.error().message, "a whole definition of the message", kRecover);
        }
        read.schema = *std::move(parsed);
      } else if (cdr && serves && s.text.empty()) {
        // rosbag2 found no definition; as in a .db3 the type's name is to do.
        if (auto known = MessageSchema::known(s.name)) read.schema = *std::move(known);
      }
      if (serves && !read.schema) read.type += ", " + encoding + " without a ROS definition";
    }
    if (read.type.empty()) read.type = encoding;
    channels_.emplace(id, std::move(read));
    return {};
  }

  Status message(std::uint64_t at, Cursor& cursor) {
    const auto id = cursor.number<std::uint16_t>();
    cursor.take(4);  // sequence
    const auto log_time = cursor.number<std::uint64_t>();
    cursor.take(8);  // time of publishing
    if (!cursor.good()) return broken(at);
    const auto found = channels_.find(id);
    if (found == channels_.end()) {
      return error(at, "a message of channel " + std::to_string(id), "its channel record before it",
                   kRecover);
    }
    const double t = static_cast<double>(log_time / 1'000'000'000) +
                     1e-9 * static_cast<double>(log_time % 1'000'000'000);
    if (Status s = topics_.add(found->second, t, cursor.rest()); !s) {
      return Error{file_ + ":" + std::to_string(at + 1) + ": " + s.error().message};
    }
    return {};
  }

  ByteSource& source_;
  const std::string& file_;
  Topics topics_;
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
