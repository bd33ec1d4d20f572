#include "master/io/logs/topics.h"

#include <limits>

#include "common/base/ranges.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

// Ten hours of a hundred topics' numbers at 50 Hz; memory for it is there.
constexpr std::size_t kMostNumbers = 100'000'000;
constexpr std::size_t kMostColumns = 512;  // of one topic

std::string text_in(const MessageContent& content, const std::string& path) {
  const std::string* found = find_in(content.texts, path);
  return found ? *found : "";
}

// "velocity[3]" to its array and element.
bool element_of(const std::string& path, std::string& array, std::string& index) {
  if (path.empty() || path.back() != ']') return false;
  const std::size_t open = path.rfind('[');
  array = path.substr(0, open);
  index = path.substr(open + 1, path.size() - open - 2);
  return true;
}

}  // namespace

Topics::Topics(std::string file, std::string format) {
  recording_.file = std::move(file);
  recording_.format = std::move(format);
}

Status Topics::put(const std::string& topic, const std::string& type, double t_s,
                   const std::vector<std::pair<std::string, double>>& numbers,
                   const MessageContent& content, const std::string& at) {
  Rows& rows = topics_[topic];
  if (rows.names.empty()) {
    rows.type = type;
    rows.frame = text_in(content, at + "header.frame_id");
    rows.child = at.empty() ? "" : text_in(content, at + "child_frame_id");
    // "/map" of tf 1 is "map".
    for (std::string* frame : {&rows.frame, &rows.child}) {
      if (frame->starts_with('/')) frame->erase(0, 1);
    }
    rows.names.emplace_back("t");
    rows.columns["t"] = 0;
  }
  std::vector<std::pair<std::size_t, double>> row = {{0, t_s}};
  for (const auto& [path, value] : numbers) {
    auto found = rows.columns.find(path);
    if (found == rows.columns.end()) {
      if (rows.names.size() >= kMostColumns) continue;
      found = rows.columns.emplace(path, rows.names.size()).first;
      rows.names.push_back(path);
    }
    row.emplace_back(found->second, value);
  }
  numbers_ += row.size();
  if (numbers_ > kMostNumbers) {
    return Error{"found more than " + std::to_string(kMostNumbers) +
                 " numbers, expected a log of drives; cut the recording or filter its topics"};
  }
  rows.rows.push_back(std::move(row));
  return {};
}

Status Topics::add(const BagTopic& of, double t_s, std::string_view bytes) {
  if (!of.schema) return skip(of);
  const std::string &topic = of.name, &type = of.type;
  ASSIGN_OR_RETURN(MessageContent content,
                   under("topic " + quoted_word(topic), of.schema->decode(bytes, of.wire)));
  const std::string_view name = std::string_view(type).substr(type.rfind('/') + 1);
  if (name == "String") {
    const auto data = content.texts.find("data");
    if (data == content.texts.end() || topic.find("robot_description") == topic.npos) {
      return skip(of);
    }
    recording_.robot_description = data->second;
    return {};
  }
  if (name == "JointState") {
    std::string array, index;
    for (auto& [path, value] : content.numbers) {
      if (!element_of(path, array, index)) continue;
      const auto joint = content.texts.find("name[" + index + "]");
      path = array + "." + (joint == content.texts.end() ? index : joint->second);
    }
  }
  if (name != "TFMessage") return put(topic, type, t_s, content.numbers, content);
  // One message holds transforms of many frames.
  std::map<std::string, std::vector<std::pair<std::string, double>>> frames;  // by path
  for (const auto& [path, value] : content.numbers) {
    const std::size_t dot = path.find("].");
    if (dot == path.npos) continue;
    frames[path.substr(0, dot + 2)].emplace_back(path.substr(dot + 2), value);
  }
  for (const auto& [at, numbers] : frames) {
    const std::string table = topic + ":" + text_in(content, at + "child_frame_id");
    RETURN_IF_ERROR(put(table, type, t_s, numbers, content, at));
  }
  return {};
}

Status Topics::skip(const BagTopic& of) {
  auto& [kind, count] = skipped_[of.name];
  kind = of.type;
  ++count;
  return {};
}

Recording Topics::finish() {
  for (auto& [topic, rows] : topics_) {
    LogTable table{recording_.file + " " + topic, topic, short_type(rows.type), rows.names, {}};
    table.values.assign(rows.rows.size() * rows.names.size(),
                        std::numeric_limits<double>::quiet_NaN());
    for (std::size_t r = 0; r < rows.rows.size(); ++r) {
      for (const auto& [column, value] : rows.rows[r]) {
        table.values[r * rows.names.size() + column] = value;
      }
    }
    table.frame = std::move(rows.frame);
    table.child = std::move(rows.child);
    rows.rows = {};
    recording_.tables.push_back(std::move(table));
  }
  add_localised(recording_);
  for (const auto& [topic, what] : skipped_) {
    recording_.notes.push_back("left: " + recording_.file + " " + topic + " (" + what.first + ", " +
                               std::to_string(what.second) + " messages)");
  }
  return std::move(recording_);
}

std::string_view ByteCursor::take(std::uint64_t count) {
  good_ = good_ && count <= bytes_.size();
  if (!good_) return {};
  const std::string_view front = bytes_.substr(0, count);
  bytes_.remove_prefix(count);
  return front;
}

Error BagRecords::error(std::uint64_t at, const std::string& found, const std::string& expected,
                        const char* remedy) const {
  return Error{file_ + ":" + std::to_string(at + 1) + ": found " + found + ", expected " +
               expected + "; " + (remedy == nullptr ? remedy_ : remedy) + " (places are bytes)"};
}

Result<std::string> BagRecords::bytes(std::uint64_t at, std::uint64_t from,
                                      std::uint64_t length) const {
  constexpr std::uint64_t kMostRecord = 1ull << 30;
  if (from > source_.size() || length > source_.size() - from) return cut(at);
  if (length > kMostRecord) {
    return error(at, "a record of " + std::to_string(length) + " bytes", "at most 1 GiB");
  }
  std::string bytes;
  if (!source_.read(from, length, bytes)) return cut(at);
  return bytes;
}

Result<std::string> BagRecords::unpacked(std::uint64_t at, std::string_view packed,
                                         const std::string& how, std::uint64_t size) const {
  auto plain = decompress(packed, how, size);
  if (plain) return plain;
  return Error{file_ + ":" + std::to_string(at + 1) + ": " + plain.error().message + "; " +
               remedy_};
}

Result<MessageSchema> BagRecords::schema(std::uint64_t at, const std::string& type,
                                         const std::string& definition) const {
  auto read = MessageSchema::parse(type, definition);
  if (read) return read;
  return error(at, read.error().message, "a whole definition of the message");
}

Status BagRecords::add(std::uint64_t at, const BagTopic& topic, double t_s,
                       std::string_view message) {
  return under(file_ + ":" + std::to_string(at + 1), topics_.add(topic, t_s, message));
}

}  // namespace gapfarm
