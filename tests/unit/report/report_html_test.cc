#include "master/report/report_html.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <regex>

#include "master/report/assets.h"
#include "master/report/gap_split.h"
#include "master/report/html.h"
#include "tests/unit/report/example_diagnosis.h"

namespace gapfarm {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

double sum(const GapSplit& split) {
  double total = 0;
  for (const GapPart& part : split.parts) total += part.amount;
  return total;
}

TEST(GapSplit, PartsAddUpToTheTunedGap) {
  for (const GapUnit unit : {GapUnit::kNats, GapUnit::kMillimetres, GapUnit::kMilliradians}) {
    const GapSplit split = split_gap(example_diagnosis(), unit);
    ASSERT_EQ(split.parts.size(), 4u);
    EXPECT_NEAR(sum(split), split.tuned, 1e-12);
    EXPECT_NEAR(split.parts[0].amount + split.parts[1].amount, split.final_, 1e-12);
  }
  const GapSplit nats = split_gap(example_diagnosis(), GapUnit::kNats);
  EXPECT_NEAR(nats.parts[2].amount, 1.31 - 0.62, 1e-12);
  EXPECT_NEAR(nats.parts[3].amount, 0.62 - 0.14, 1e-12);
}

TEST(GapSplit, UnmeasuredStepsShareOnePart) {
  Diagnosis d = example_diagnosis();
  d.effects[0].position_mm_after.reset();
  const GapSplit split = split_gap(d, GapUnit::kMillimetres);
  ASSERT_EQ(split.parts.size(), 3u);
  EXPECT_NEAR(split.parts[2].amount, 10.7 - 3.4, 1e-12);
  EXPECT_NEAR(sum(split), split.tuned, 1e-12);
  EXPECT_EQ(split_gap(d, GapUnit::kMilliradians).parts.size(), 4u);
}

TEST(GapSplit, NothingNamedLeavesAllUnexplained) {
  const GapSplit split = split_gap(null_diagnosis(), GapUnit::kNats);
  ASSERT_EQ(split.parts.size(), 2u);
  EXPECT_NEAR(sum(split), split.tuned, 1e-12);
}

TEST(Html, NumbersReadWell) {
  EXPECT_EQ(number_text(0.41234), "0.412");
  EXPECT_EQ(number_text(-3.25, 2), "−3.2");
  EXPECT_EQ(number_text(1234567), "1,234,567");
  EXPECT_EQ(number_text(-0.0), "0");
  EXPECT_EQ(number_text(std::nan("")), "–");
  EXPECT_EQ(percent_text(0.884), "88 %");
  EXPECT_EQ(percent_text(std::numeric_limits<double>::infinity()), "–");
  EXPECT_EQ(p_text(0), "< 0.0001");
  EXPECT_EQ(p_text(0.0312), "0.031");
}

// The published SHA-256 of "abc" (FIPS 180-2, B.1), in base64.
TEST(Html, HashesLikeTheStandard) {
  EXPECT_EQ(csp_hash("abc"), "sha256-ungWv48Bz+pBQUDeXa4iI7ADYaOWF3qctBD/YfIAFa0=");
}

TEST(ReportHtml, SectionsComeInTheirOrder) {
  const std::string html = report_html(example_diagnosis());
  std::size_t last = 0;
  for (const char* id : {"summary", "gap", "poses", "residuals", "screening", "shrinkage",
                         "unexplained", "next", "cautions", "provenance"}) {
    const auto at = html.find("<section id=\"" + std::string(id) + "\"");
    ASSERT_NE(at, std::string::npos) << id;
    EXPECT_GT(at, last) << id;
    last = at;
  }
  EXPECT_THAT(html, HasSubstr("The battery sags and the floor tilts"));
  EXPECT_EQ(html, report_html(example_diagnosis()));
}

// The policy names every inline script and style by the hash of what stands in the page, and
// nothing else may load.
TEST(ReportHtml, PolicyCoversWhatIsThere) {
  const std::string html = report_html(null_diagnosis());
  const std::regex policy("http-equiv=\"Content-Security-Policy\" content=\"([^\"]*)\"");
  std::smatch match;
  ASSERT_TRUE(std::regex_search(html, match, policy));
  const std::string words = match[1];
  EXPECT_THAT(words, HasSubstr("default-src 'none'"));
  EXPECT_THAT(words, Not(HasSubstr("unsafe")));
  std::size_t found = 0;
  for (const std::string tag : {"script", "style"}) {
    for (auto at = html.find("<" + tag + ">"); at != std::string::npos;
         at = html.find("<" + tag + ">", at + 1)) {
      const auto from = at + tag.size() + 2;
      const auto to = html.find("</" + tag + ">", from);
      EXPECT_THAT(words, HasSubstr("'" + csp_hash(html.substr(from, to - from)) + "'"));
      ++found;
    }
  }
  EXPECT_EQ(found, page_scripts().size() + page_styles().size());
  EXPECT_THAT(html, Not(HasSubstr(" style=\"")));
  EXPECT_THAT(html, Not(HasSubstr(" onclick=")));
}

TEST(ReportHtml, NamesCannotInject) {
  const std::string attack = "\"'><script>alert(1)</script><!--";
  Diagnosis d = example_diagnosis();
  d.headline = attack;
  d.effects[0].name = d.effects[0].text = d.effects[0].alias_reason = attack;
  d.effects[0].aliases = {attack};
  d.effects[0].parameters[0] = {attack, 1, 0, 2, attack};
  d.where = d.unexplained = {{attack, attack, attack, attack, 1, 0.5, 0.1, attack}};
  d.screening = {{attack, 1, 0.5, attack, {attack}, 0.1, 0.1, attack}};
  d.next = {{attack, {attack}, 3}};
  d.cautions = {attack};
  d.trials[0].session = d.trials[0].command = attack;
  d.provenance = {{attack, attack}};
  d.timing_s = {{attack, 1}};
  const std::string html = report_html(d);
  EXPECT_THAT(html, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(html, Not(HasSubstr("\"'>")));
  EXPECT_THAT(html, Not(HasSubstr("<!--")));
}

TEST(ReportHtml, StandsWhatIsNotANumber) {
  const double nan = std::nan("");
  Diagnosis d = example_diagnosis();
  d.gap = d.position_mm = d.heading_mrad = {nan, nan, nan};
  d.effects[0].closed = d.effects[0].closed_lo = d.effects[0].gap_after = nan;
  d.screening[0].gain = nan;
  d.where[0].share = d.where[0].p = nan;
  d.timing_s[0].second = nan;
  d.trials[0].tuned_residual.setConstant(nan);
  const std::string html = report_html(d);
  EXPECT_THAT(html, Not(HasSubstr("nan%")));
  EXPECT_THAT(html, Not(HasSubstr(">nan")));
}

}  // namespace
}  // namespace gapfarm
