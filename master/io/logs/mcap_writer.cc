#include <algorithm>
#include <cassert>
#include <limits>
#include <map>

#include "common/base/ranges.h"
#include "master/io/logs/bags.h"

namespace gapfarm {
namespace {

constexpr std::string_view kMcapMagic("\x89MCAP0\r\n", 8);
constexpr std::size_t kChunkBytes = 1 << 20;  // of a chunk's records, about

enum WrittenOp : unsigned char {
  kWrittenHeader = 1,
  kWrittenFooter = 2,
  kWrittenSchema = 3,
  kWrittenChannel = 4,
  kWrittenMessage = 5,
  kWrittenChunk = 6,
  kWrittenMessageIndex = 7,
  kWrittenChunkIndex = 8,
  kWrittenStatistics = 11,
  kWrittenSummaryOffset = 14,
  kWrittenDataEnd = 15,
};

template <class T>
std::string number(T value) {  // little-endian, as this machine is (message.cc)
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

using U16 = std::uint16_t;
using U32 = std::uint32_t;
using U64 = std::uint64_t;

// With its length before it.
std::string sized(std::string_view text) {
  return number(static_cast<U32>(text.size())).append(text);
}

std::string map_bytes(const std::map<U16, U64>& map) {
  return sized(joined(map, "", [](auto& one) { return number(one.first) + number(one.second); }));
}

std::string written(WrittenOp op, std::string_view content) {
  return number(static_cast<unsigned char>(op)) + number(static_cast<U64>(content.size())) +
         std::string(content);
}

// No checksums, as the format allows (0).
constexpr U32 kNoChecksum = 0;

struct ChunkSpan {
  U64 start_ns = std::numeric_limits<U64>::max(), end_ns = 0;
  std::string records;
  std::map<U16, std::string> index;  // of each channel: times and places of its messages
};

// The chunk and its indices behind it; its own row of the summary in `row`.
std::string chunk_bytes(const ChunkSpan& chunk, U64 at, std::string* row) {
  const U64 size = chunk.records.size();
  const std::string body =
      written(kWrittenChunk, number(chunk.start_ns) + number(chunk.end_ns) + number(size) +
                                 number(kNoChecksum) + sized("") + number(size) + chunk.records);
  std::string indices;
  std::map<U16, U64> offsets;
  for (const auto& [channel, entries] : chunk.index) {
    offsets[channel] = at + body.size() + indices.size();
    indices += written(kWrittenMessageIndex, number(channel) + sized(entries));
  }
  *row =
      written(kWrittenChunkIndex, number(chunk.start_ns) + number(chunk.end_ns) + number(at) +
                                      number(static_cast<U64>(body.size())) + map_bytes(offsets) +
                                      number(static_cast<U64>(indices.size())) + sized("") +
                                      number(size) + number(size));
  return body + indices;
}

}  // namespace

std::uint16_t McapWriter::add_channel(const std::string& topic, const std::string& schema_name,
                                      const std::string& schema) {
  assert(channels_.size() < std::numeric_limits<U16>::max());
  const std::pair wanted(schema_name, schema);
  const auto found = std::ranges::find(schemas_, wanted);
  const auto id = static_cast<U16>(found - schemas_.begin() + 1);  // 0 would be none
  if (found == schemas_.end()) schemas_.push_back(wanted);
  channels_.push_back({topic, id});
  return static_cast<U16>(channels_.size() - 1);
}

void McapWriter::add_message(std::uint16_t channel, std::uint64_t time_ns, std::string json) {
  assert(channel < channels_.size());
  messages_.push_back({time_ns, channel, std::move(json)});
}

std::string McapWriter::schema_records() const {
  std::string bytes;
  for (std::size_t k = 0; k < schemas_.size(); ++k) {
    bytes += written(kWrittenSchema, number(static_cast<U16>(k + 1)) + sized(schemas_[k].first) +
                                         sized("jsonschema") + sized(schemas_[k].second));
  }
  return bytes;
}

std::string McapWriter::channel_records() const {
  std::string bytes;
  for (std::size_t k = 0; k < channels_.size(); ++k) {
    bytes += written(kWrittenChannel, number(static_cast<U16>(k)) + number(channels_[k].schema) +
                                          sized(channels_[k].topic) + sized("json") + sized(""));
  }
  return bytes;
}

std::string McapWriter::finish() {
  std::ranges::stable_sort(messages_, {}, &Message::time_ns);
  std::string file(kMcapMagic), chunk_rows;
  file += written(kWrittenHeader, sized("") + sized("gapfarm"));
  U32 chunks = 0;
  std::map<U16, U64> counts;
  ChunkSpan chunk;
  chunk.records = schema_records() + channel_records();
  const auto close = [&] {
    if (chunk.index.empty()) return;
    std::string row;
    file += chunk_bytes(chunk, file.size(), &row);
    chunk_rows += row;
    ++chunks;
    chunk = {};
  };
  for (const Message& m : messages_) {
    chunk.index[m.channel] += number(m.time_ns) + number(static_cast<U64>(chunk.records.size()));
    chunk.records +=
        written(kWrittenMessage, number(m.channel) + number(channels_[m.channel].messages++) +
                                     number(m.time_ns) + number(m.time_ns) + m.json);
    chunk.start_ns = std::min(chunk.start_ns, m.time_ns);
    chunk.end_ns = std::max(chunk.end_ns, m.time_ns);
    ++counts[m.channel];
    if (chunk.records.size() > kChunkBytes) close();
  }
  close();
  file += written(kWrittenDataEnd, number(kNoChecksum));
  const U64 summary = file.size();
  std::string offsets;
  const auto group = [&](WrittenOp op, const std::string& records) {
    if (records.empty()) return;
    offsets += written(kWrittenSummaryOffset, number(static_cast<unsigned char>(op)) +
                                                  number(static_cast<U64>(file.size())) +
                                                  number(static_cast<U64>(records.size())));
    file += records;
  };
  group(kWrittenSchema, schema_records());
  group(kWrittenChannel, channel_records());
  group(kWrittenStatistics,
        written(
            kWrittenStatistics,
            number(static_cast<U64>(messages_.size())) + number(static_cast<U16>(schemas_.size())) +
                number(static_cast<U32>(channels_.size())) + number(U32{0}) + number(U32{0}) +
                number(chunks) + number(messages_.empty() ? U64{0} : messages_.front().time_ns) +
                number(messages_.empty() ? U64{0} : messages_.back().time_ns) + map_bytes(counts)));
  group(kWrittenChunkIndex, chunk_rows);
  const U64 offsets_at = file.size();
  file +=
      offsets + written(kWrittenFooter, number(summary) + number(offsets_at) + number(kNoChecksum));
  return file.append(kMcapMagic);
}

}  // namespace gapfarm
