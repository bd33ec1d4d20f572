// Files of McapWriter by the format's own words (https://mcap.dev/spec), read by a walk of its own.
#include <gtest/gtest.h>

#include <cstring>
#include <map>

#include "master/io/logs/bags.h"

namespace gapfarm::mcap_writer_test {
namespace {

struct Record {
  int op = 0;
  std::size_t at = 0;  // in what it stands in
  std::string content;
};

template <class T>
T number_at(const std::string& bytes, std::size_t at) {
  T value{};
  EXPECT_LE(at + sizeof value, bytes.size());
  if (at + sizeof value <= bytes.size()) std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

std::vector<Record> records_of(const std::string& bytes, std::size_t from, std::size_t to) {
  std::vector<Record> records;
  for (std::size_t at = from; at + 9 <= to;) {
    const auto size = number_at<std::uint64_t>(bytes, at + 1);
    EXPECT_LE(at + 9 + size, to);
    records.push_back({bytes[at], at, bytes.substr(at + 9, size)});
    at += 9 + size;
  }
  return records;
}

std::vector<Record> of_op(const std::vector<Record>& records, int op) {
  std::vector<Record> found;
  for (const Record& r : records) {
    if (r.op == op) found.push_back(r);
  }
  return found;
}

TEST(McapWriter, IndexesEveryMessageWhereItStands) {
  constexpr int kMessages = 30000;  // more than a chunk
  McapWriter writer;
  const auto a = writer.add_channel("/a", "pose", "{}");
  const auto b = writer.add_channel("/b", "pose", "{}");
  for (int k = kMessages; k-- > 0;) {  // backwards
    writer.add_message(k % 3 == 0 ? b : a, 10u * static_cast<unsigned>(k),
                       "{\"k\": " + std::to_string(k) + ", \"is a\": " + std::to_string(k % 3) +
                           std::string(20, ' ') + "}");
  }
  const std::string file = writer.finish();
  ASSERT_EQ(file.substr(0, 8), std::string("\x89MCAP0\r\n", 8));
  ASSERT_EQ(file.substr(file.size() - 8), file.substr(0, 8));
  const auto all = records_of(file, 8, file.size() - 8);
  EXPECT_EQ(all.front().op, 1);
  ASSERT_EQ(all.back().op, 2);
  EXPECT_EQ(of_op(all, 3).size(), 1u);  // of the summary: one schema for both
  EXPECT_EQ(of_op(all, 4).size(), 2u);
  const auto summary = number_at<std::uint64_t>(all.back().content, 0);
  const auto offsets = number_at<std::uint64_t>(all.back().content, 8);
  EXPECT_EQ(file[summary], 3);
  EXPECT_EQ(file[offsets], 14);
  for (const Record& r : of_op(all, 14)) {  // each group begins with what it is of
    EXPECT_EQ(file[number_at<std::uint64_t>(r.content, 1)], r.content[0]);
  }
  std::uint64_t seen = 0, last = 0;
  std::map<std::uint64_t, std::uint32_t> sequence;
  const auto rows = of_op(all, 8);
  ASSERT_GT(rows.size(), 1u);
  for (const Record& row : rows) {
    const auto at = number_at<std::uint64_t>(row.content, 16);
    const auto length = number_at<std::uint64_t>(row.content, 24);
    const Record chunk = records_of(file, at, at + length).at(0);
    ASSERT_EQ(chunk.op, 6);
    const std::string inside = chunk.content.substr(8 + 8 + 8 + 4 + 4 + 8);
    EXPECT_EQ(number_at<std::uint64_t>(chunk.content, 16), inside.size());
    for (const Record& m : of_op(records_of(inside, 0, inside.size()), 5)) {
      const auto time = number_at<std::uint64_t>(m.content, 6);
      EXPECT_GE(time, last);
      last = time;
      EXPECT_EQ(time, 10 * seen++);
      const auto channel = number_at<std::uint16_t>(m.content, 0);
      EXPECT_EQ(number_at<std::uint32_t>(m.content, 2), sequence[channel]++);
    }
    // Two channels: a map of their indices' places behind its length.
    ASSERT_EQ(number_at<std::uint32_t>(row.content, 32), 20u);
    for (const std::size_t entry : {36u, 46u}) {
      const auto place = number_at<std::uint64_t>(row.content, entry + 2);
      const std::string index = file.substr(place + 9, number_at<std::uint64_t>(file, place + 1));
      EXPECT_EQ(file[place], 7);
      EXPECT_EQ(index.substr(0, 2), row.content.substr(entry, 2));
      const auto message = number_at<std::uint64_t>(index, 6 + 8);
      EXPECT_EQ(inside[message], 5);
      EXPECT_EQ(inside.substr(message + 9, 2), index.substr(0, 2));
      EXPECT_EQ(number_at<std::uint64_t>(inside, message + 9 + 6),
                number_at<std::uint64_t>(index, 6));
    }
  }
  EXPECT_EQ(seen, kMessages);
  EXPECT_EQ(number_at<std::uint64_t>(of_op(all, 11).at(0).content, 0), kMessages);
}

}  // namespace
}  // namespace gapfarm::mcap_writer_test
