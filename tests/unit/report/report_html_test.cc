#include "master/report/report_html.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <regex>

#include "common/config/config.h"
#include "master/report/html.h"
#include "master/report/page_frame.h"
#include "master/report/run/run_report.h"
#include "tests/unit/report/example_diagnosis.h"

namespace gapfarm::report_html_test {

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

// What is drawn after an effect that did harm is longer than what was there before: in proportion.
TEST(GapSplit, WhatGetsWorseIsDrawnLonger) {
  Diagnosis d = example_diagnosis();
  d.heading_mrad = {59.7, 83.7, 11.0};
  d.effects[0].heading_mrad_after = 50.0;
  d.effects[1].heading_mrad_after = 83.7;
  const std::string html = gap_split_html(d);
  const auto from = html.find("Heading");
  const auto drawn = [&](const char* name) {
    const auto row = html.find(std::string(">") + name + "</span>", from);
    const std::string bar = html.substr(row, html.find("split-value", row) - row);
    double width = 0;
    const std::regex stretch("<svg x=\"[0-9.]+%\" width=\"([0-9.]+)%\"");
    for (std::sregex_iterator it(bar.begin(), bar.end(), stretch), end; it != end; ++it) {
      width += std::stod((*it)[1]);
    }
    return width;
  };
  EXPECT_NEAR(drawn("after"), 100, 0.1);
  EXPECT_NEAR(drawn("before"), 100 * 59.7 / 83.7, 0.1);
  EXPECT_THAT(html, HasSubstr("#hatch-worse"));
  EXPECT_THAT(html, HasSubstr("▲ worse"));
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
  EXPECT_EQ(number_text(134.2, 2), "130");  // not 1.3e+02
  EXPECT_EQ(number_text(319.6, 2), "320");
  EXPECT_EQ(number_text(0.5), "0.5");
  EXPECT_EQ(number_text(999.96), "1,000");
  EXPECT_EQ(number_text(0.00041), "0.00041");
  EXPECT_EQ(number_text(4.12e-6), "4.12 × 10⁻⁶");
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
  for (const char* id :
       {"summary", "gap", "parameters", "floor", "drives", "poses", "residuals", "screening",
        "shrinkage", "unexplained", "next", "cautions", "provenance", "words"}) {
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
  const std::string label = match[1];
  EXPECT_THAT(label, HasSubstr("default-src 'none'"));
  EXPECT_THAT(label, Not(HasSubstr("unsafe")));
  std::size_t found = 0;
  for (const std::string tag : {"script", "style"}) {
    for (auto at = html.find("<" + tag + ">"); at != std::string::npos;
         at = html.find("<" + tag + ">", at + 1)) {
      const auto from = at + tag.size() + 2;
      const auto to = html.find("</" + tag + ">", from);
      EXPECT_THAT(label, HasSubstr("'" + csp_hash(html.substr(from, to - from)) + "'"));
      ++found;
    }
  }
  EXPECT_EQ(found, page_scripts().size() + page_styles().size());
  EXPECT_THAT(html, Not(HasSubstr(" style=\"")));
  EXPECT_THAT(html, Not(HasSubstr(" onclick=")));
}

TEST(ReportHtml, ParametersHaveIntervalsBoundsAndWhatMakesUpForWhat) {
  const std::string html = report_html(example_diagnosis());
  EXPECT_THAT(html, HasSubstr("<code>full_speed</code>"));
  EXPECT_THAT(html, HasSubstr("0.281 to 0.285"));
  EXPECT_THAT(html, HasSubstr("▲ at its lower bound, 0.02 m"));
  EXPECT_THAT(html, HasSubstr("<code>full_speed</code> and <code>battery_sag.rate</code>: 0.93"));
  EXPECT_THAT(html, HasSubstr("[effects.battery_sag]\nrate = 0.0061"));
}

TEST(ReportHtml, WithoutParametersItNamesTheReason) {
  Diagnosis diagnosis = example_diagnosis();
  diagnosis.parameters.clear();
  EXPECT_THAT(report_html(diagnosis), HasSubstr("None of a config: nothing was named"));
}

TEST(Parameters, AZeroThatEndsASizeIsNoBound) {
  ParameterRow row{"drive_noise_side", "-", "", "", {}, 0, {}, {}, 0, 0.3, "", ""};
  EXPECT_EQ(bound_hit(row), BoundHit::kNone);
  row.after = 0.29999;
  EXPECT_EQ(bound_hit(row), BoundHit::kUpper);
  row.lower = -0.3, row.after = -0.3;
  EXPECT_EQ(bound_hit(row), BoundHit::kLower);
  row.key = "floor_tilt.direction";
  EXPECT_EQ(bound_hit(row), BoundHit::kNone);
}

// What the page offers to paste is a config.
TEST(Parameters, TheSnippetIsReadAsAConfig) {
  std::vector<ParameterRow> rows = example_diagnosis().parameters;
  rows.push_back({"camera_seam.axis", "-", "camera_seam", "", {}, 1, {}, {}, 0, 1, "y", ""});
  rows.push_back(
      {"camera_seam.position", "m", "camera_seam", "", {}, 1.3351234, 1.2, 1.4, -10, 10, "", ""});
  const auto config = parse_config(config_snippet(rows, true), "snippet.toml");
  ASSERT_TRUE(config.ok()) << config.error().message << config_snippet(rows, true);
  const Problem& problem = config->problem;
  for (const ParameterRow& row : rows) {
    const double value = problem.values[problem.table().row(row.key)];
    EXPECT_NEAR(value, row.after, 1e-5 * std::abs(row.after)) << row.key;
  }
}

// Every word that is a link has its explanation on the page, and the headline is one line.
TEST(ReportHtml, TermsAreExplained) {
  for (const std::string& html :
       {report_html(example_diagnosis()), report_html(null_diagnosis()), run_html(RunReport{})}) {
    const std::regex link("href=\"#(term-[a-z-]+)\"");
    for (std::sregex_iterator it(html.begin(), html.end(), link), end; it != end; ++it) {
      EXPECT_THAT(html, HasSubstr("<div id=\"" + std::string((*it)[1]) + "\"><dt>"));
    }
  }
}

TEST(ReportHtml, AnUnusableLogIsReportedWithoutEmptyPlots) {
  Diagnosis d;
  d.verdict = Verdict::kUnusable;
  d.headline = "Not usable as it is: left and right are exchanged.";
  d.sanity = {{"axes_swapped", "Forward drives go sideways.", "Exchange x and y."}};
  const std::string html = report_html(d);
  EXPECT_THAT(html, HasSubstr("Exchange x and y."));
  EXPECT_THAT(html, Not(HasSubstr("id=\"floor\"")));
  EXPECT_THAT(html, Not(HasSubstr("id=\"gap\"")));
}

TEST(RunHtml, KeepsWhatItWasGiven) {
  RunOutcome outcome;
  outcome.trials = null_diagnosis().trials;
  outcome.trials[3].tuned_residual.setConstant(std::nan(""));
  outcome.validation = {{"the best", 9.5}, {"after stage 1", {}}};
  outcome.baselines = {{"constant motion", 6.695}};
  const auto back = parse_run_outcome(to_json(outcome));
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(to_json(*back), to_json(outcome));
  RunReport report;
  report.outcome = *back;
  report.headline = "</h1><script>";
  report.parameters = example_diagnosis().parameters;
  const std::string html = run_html(report);
  EXPECT_THAT(html, Not(HasSubstr("</h1><script>")));
  EXPECT_THAT(html, HasSubstr("constant motion"));
  EXPECT_THAT(html, HasSubstr("▲ at its lower bound"));
  EXPECT_FALSE(parse_run_outcome("{}").ok());
}

TEST(RunHtml, SaysThatThereIsNoBestYet) {
  RunReport report;
  for (const char* why : {"No generation was completed yet.", "No individual has a fitness yet."}) {
    const std::string html = run_html(report);
    EXPECT_THAT(html, HasSubstr("<h2>Parameters</h2><p>" + std::string(why)));
    EXPECT_THAT(html, HasSubstr("<h2>Fitness</h2><p>" + std::string(why)));
    EXPECT_THAT(html, Not(HasSubstr("id=\"progress-plot\"")));
    report.generations = {{1, {}, {}, {}, 24, 1}};
  }
}

TEST(ReportHtml, NamesCannotInject) {
  const std::string attack = "\"'><script>alert(1)</script><!--";
  Diagnosis d = example_diagnosis();
  d.headline = d.action = attack;
  d.findings = {attack};
  d.parameters[0].key = d.parameters[0].summary = d.parameters[0].note = attack;
  d.parameters[3].effect = d.parameters[0].unit = d.parameters[0].choice = attack;
  d.correlations = {{attack, attack, 1}};
  d.effects[0].axis = attack;
  d.drives[0].why = attack;
  d.effects[0].name = d.effects[0].text = d.effects[0].alias_reason = attack;
  d.effects[0].aliases = {attack};
  d.effects[0].parameters[0] = {attack, 1, 0, 2, attack};
  d.where = d.unexplained = {{attack, attack, attack, attack, 1, 0.5, 0.1, attack}};
  d.screening = {{attack, 1, 0.5, attack, {attack}, attack}};
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

}  // namespace gapfarm::report_html_test
