#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "common/base/hash.h"
#include "common/base/result.h"
#include "common/base/text.h"
#include "common/base/text_table.h"

namespace gapfarm::base_test {

TEST(Hash, ReportsBoundariesAndBitsApart) {
  EXPECT_EQ(content_hash("abc"), content_hash("abc"));
  EXPECT_EQ(content_hash("abc").size(), 32u);
  EXPECT_NE(Hasher().add("ab").add("c").finish(), Hasher().add("a").add("bc").finish());
  EXPECT_NE(Hasher().add(0.0).finish(), Hasher().add(-0.0).finish());
}

TEST(NaturalOrder, CountsNumbersAndPutsOtherLettersLast) {
  std::vector<std::string> runs = {"über7", "run10", "rün4", "run2", "zug5"};
  std::ranges::sort(runs, comes_before);
  EXPECT_EQ(runs, (std::vector<std::string>{"run2", "run10", "rün4", "zug5", "über7"}));
}

TEST(Suggest, OffersTheNearestWordOnly) {
  const std::vector<std::string> known = {"forward", "backward", "turn_cw"};
  EXPECT_EQ(nearest_word("foward", known), "forward");
  EXPECT_EQ(nearest_word("zzz", known), "");
  EXPECT_EQ(suggestion("bakward", known), "; did you mean 'backward'?");
  EXPECT_EQ(suggestion("q", known), "; known: forward, backward, turn_cw");
}

TEST(Result, CarriesAValueOrAnError) {
  const Result<int> good = 3;
  const Result<int> bad = Error{"no"};
  ASSERT_TRUE(good.ok());
  EXPECT_EQ(*good, 3);
  ASSERT_FALSE(bad.ok());
  EXPECT_EQ(bad.error().message, "no");
}

TEST(Text, IsCutAtMarksLinesAndBlanks) {
  using Views = std::vector<std::string_view>;
  EXPECT_EQ(parts_of("a,,b,", ','), (Views{"a", "", "b", ""}));
  EXPECT_EQ(parts_of("", ','), Views{""});
  EXPECT_EQ(lines_of("a\r\n\nb"), (Views{"a", "", "b"}));
  EXPECT_EQ(lines_of("a\n"), Views{"a"});
  EXPECT_EQ(lines_of(""), Views{});
  EXPECT_EQ(tokens_of(" a\tb  c\r\n"), (Views{"a", "b", "c"}));
  EXPECT_EQ(cut_at("a=b=c", '='), std::pair(std::string("a"), std::optional<std::string>("b=c")));
  EXPECT_FALSE(cut_at("a", '=').second);
}

TEST(TextTable, IsAsWideAsItsCellsInTerminalsAndMarkdown) {
  const TextTable table{{"what", "m", ""}, {{"μ", "0.5", "*"}, {"longer"}}};
  EXPECT_EQ(table.text("<><", "  "),
            "  what      m\n"
            "  μ       0.5  *\n"
            "  longer\n");
  EXPECT_EQ(table.markdown(),
            "| what | m |  |\n| --- | --- | --- |\n| μ | 0.5 | * |\n| longer |\n");
  EXPECT_EQ((TextTable{{"what"}}.text()), "");
}

}  // namespace gapfarm::base_test
