#include "master/diagnose/places/where.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>

#include "common/effects/catalogue.h"
#include "common/random/stream.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/evidence/session_gains.h"

namespace gapfarm::where_test {
namespace {

constexpr double kSdPosition = 0.003;
constexpr double kSdHeading = 0.012;

// Three sessions of six commands at two durations, residuals of pure noise; faults are put in.
struct Data {
  Problem problem;
  std::vector<Cell> cells;
  std::vector<ResidualTrial> trials;
  std::vector<Eigen::Vector3d> residuals;
  std::vector<Eigen::Matrix3d> covariances;

  std::vector<Where> look() const { return where(trials, residuals, covariances, cells, problem); }
  void disturb(const std::function<void(const ResidualTrial&, Eigen::Vector3d&)>& how) {
    for (std::size_t i = 0; i < trials.size(); ++i) how(trials[i], residuals[i]);
  }
};

Eigen::Vector3d motion(const CommandSpec& c, double path) {
  if (c.left == c.right) return {0.3 * path * c.left, 0, 0};
  if (c.left == -c.right) return {0, 0, 2 * path * c.right};
  return {0.2 * path, 0.1 * path * (c.right - c.left), 1.5 * path * (c.right - c.left)};
}

Data make_data(std::uint64_t seed, std::size_t count = 600) {
  Data d;
  d.problem.commands = default_commands("srv1");
  Stream stream({seed, Purpose::kTest, 0, 0, 0});
  for (std::size_t c = 0; c < 6; ++c) {
    for (const double duration : {1.0, 1.5}) {
      Cell cell;
      cell.command = d.problem.commands[c];
      cell.command.duration_s = duration;
      cell.path = duration;
      d.cells.push_back(cell);
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    ResidualTrial t;
    t.cell = stream.below(d.cells.size());
    t.command = t.cell / 2;
    t.session = 3 * i / count;
    const std::size_t within = i - (t.session * count + 2) / 3;
    t.context.session_time_s = 6.0 * static_cast<double>(within);
    t.context.place_in_run = static_cast<int>(within % 4);
    t.context.moved = t.context.place_in_run == 0;
    if (within > 0) t.context.previous = i - 1;
    t.X_WS = {stream.uniform(0.3, 1.7), stream.uniform(0.3, 1.7),
              stream.uniform(-std::numbers::pi, std::numbers::pi)};
    t.left = t.right = motion(d.cells[t.cell].command, d.cells[t.cell].path) / 2;
    d.trials.push_back(t);
    ++d.cells[t.cell].trials;
    d.residuals.emplace_back(kSdPosition * stream.normal(), kSdPosition * stream.normal(),
                             kSdHeading * stream.normal());
    const Eigen::Vector3d sd(kSdPosition, kSdPosition, kSdHeading);
    d.covariances.push_back(sd.cwiseAbs2().asDiagonal());
  }
  return d;
}

bool is_command(const Data& d, const ResidualTrial& t, const char* name) {
  return d.problem.commands[t.command].name == name;
}

TEST(Where, ReportsNothingOfPureNoise) {
  int alarms = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed)
    alarms += make_data(100 + seed).look().empty() ? 0 : 1;
  RecordProperty("alarms", alarms);
  EXPECT_LE(alarms, 4);  // one in a hundred is promised
}

TEST(Where, ReportsTheBiasOfOneCommandInMillimetres) {
  Data d = make_data(1);
  d.disturb([&](const ResidualTrial& t, Eigen::Vector3d& r) {
    if (is_command(d, t, "forward")) r[1] += 0.004;
  });
  const std::vector<Where> rows = d.look();
  ASSERT_FALSE(rows.empty());
  EXPECT_EQ(rows[0].command, "forward");
  EXPECT_EQ(rows[0].component, "y");
  EXPECT_EQ(rows[0].kind, "bias");
  EXPECT_NEAR(rows[0].size, 4, 1);
  EXPECT_GT(rows[0].share, 0.5);
  EXPECT_NE(rows[0].text.find("too far to the left"), std::string::npos) << rows[0].text;
  EXPECT_EQ(rows.size(), 1u);
}

TEST(Where, ReportsAFactOfAllCommandsOnce) {
  Data d = make_data(2);
  d.disturb([](const ResidualTrial&, Eigen::Vector3d& r) { r[1] -= 0.002; });
  const std::vector<Where> rows = d.look();
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].command, "all");
  EXPECT_EQ(rows[0].kind, "bias");
  EXPECT_NEAR(rows[0].size, 2, 0.5);
}

// A battery that sags: every motion falls short by a share that grows with time, whatever its sign.
TEST(Where, FindsTheTrendOfASaggingBatteryInEveryMotion) {
  Data d = make_data(3);
  d.disturb([](const ResidualTrial& t, Eigen::Vector3d& r) {
    r -= 0.004 * (t.context.session_time_s / 60 - 10) * (t.left + t.right);
  });
  const std::vector<Where> rows = d.look();
  ASSERT_GE(rows.size(), 2u);
  for (const Where& row : rows) {
    EXPECT_EQ(row.command, "all");
    EXPECT_EQ(row.covariate, "time") << row.text;
    EXPECT_NE(row.text.find("with every minute of the session"), std::string::npos);
    EXPECT_NE(row.text.find(" less "), std::string::npos) << row.text;
  }
}

TEST(Where, ReportsTheHarmonicOfTheHeading) {
  for (const int order : {1, 2, 4}) {
    Data d = make_data(4);
    d.disturb([&](const ResidualTrial& t, Eigen::Vector3d& r) {
      r[0] += 0.004 * std::cos(order * t.X_WS.theta + 1) * 1.25;
    });
    const std::vector<Where> rows = d.look();
    ASSERT_FALSE(rows.empty());
    EXPECT_EQ(rows[0].covariate, order == 1   ? "start heading"
                                 : order == 2 ? "start heading, 2nd harmonic"
                                              : "start heading, 4th harmonic");
    EXPECT_EQ(rows[0].component, "x");
    EXPECT_NEAR(rows[0].size, 5 / std::sqrt(2), 0.7);
  }
}

TEST(Where, ReportsSpreadFromOutliers) {
  Data wide = make_data(5);
  wide.disturb([&](const ResidualTrial& t, Eigen::Vector3d& r) {
    if (is_command(wide, t, "turn_cw")) r[2] *= 2;
  });
  const std::vector<Where> spread = wide.look();
  ASSERT_FALSE(spread.empty());
  EXPECT_EQ(spread[0].kind, "spread");
  EXPECT_EQ(spread[0].command, "turn_cw");
  EXPECT_NEAR(spread[0].size, 12 * std::sqrt(3), 7);
  for (const Where& row : spread) EXPECT_NE(row.kind, "outliers") << row.text;

  Data wild = make_data(6);
  for (std::size_t i = 0; i < wild.residuals.size(); i += 41) wild.residuals[i][0] += 0.05;
  const std::vector<Where> outliers = wild.look();
  ASSERT_FALSE(outliers.empty());
  EXPECT_EQ(outliers[0].kind, "outliers");
  EXPECT_EQ(outliers[0].component, "x");
  for (const Where& row : outliers) EXPECT_NE(row.kind, "spread") << row.text;
}

TEST(Where, SurvivesThinData) {
  EXPECT_TRUE(where({}, {}, {}, {}, Problem{}).empty());
  EXPECT_TRUE(make_data(7, 3).look().empty());
  Data same = make_data(8, 40);
  for (ResidualTrial& t : same.trials) t = same.trials[0];
  for (Eigen::Vector3d& r : same.residuals) r.setZero();
  for (const Where& row : same.look()) EXPECT_EQ(row.kind, "spread");
}

// The reference: the columns' rows shuffled within each session.
TEST(TrendTest, AgreesWithAPermutationWithinSessions) {
  Stream stream({11, Purpose::kTest, 0, 0, 0});
  for (const double slope : {0.0, 0.12, 0.2}) {
    constexpr int kCount = 150;
    Eigen::VectorXd values(kCount), scale(kCount);
    Eigen::MatrixXd columns(kCount, 2);
    std::vector<int> groups;
    for (int i = 0; i < kCount; ++i) {
      columns(i, 0) = stream.normal();
      columns(i, 1) = stream.uniform();
      scale[i] = 0.002;
      values[i] = stream.normal() + slope * columns(i, 0);
      groups.push_back(i / 50);
    }
    const TrendTest test = trend_test(values, columns, scale, groups);
    int above = 0;
    constexpr int kShuffles = 2000;
    for (int s = 0; s < kShuffles; ++s) {
      Eigen::MatrixXd shuffled = columns;
      for (int session = 0; session < 3; ++session) {
        const std::vector<std::size_t> order = stream.permutation(50);
        for (int i = 0; i < 50; ++i) {
          shuffled.row(50 * session + i) = columns.row(50 * session + static_cast<int>(order[i]));
        }
      }
      if (trend_test(values, shuffled, scale, groups).squares >= test.squares) ++above;
    }
    const double p = (above + 1.0) / (kShuffles + 1);
    EXPECT_NEAR(test.p, p, 0.03 + 3 * std::sqrt(p / kShuffles)) << slope;
  }
}

TEST(TrendTest, RecoversSlopesUnderUnequalNoiseAndLeavesOutWhatDepends) {
  Eigen::VectorXd scale(6), values(6);
  scale << 1, 2, 1, 4, 1, 2;
  Eigen::MatrixXd columns(6, 3);
  columns.col(0) << 0, 1, 2, 3, 4, 5;
  columns.col(1) = 2 * columns.col(0);
  columns.col(2) << 1, 1, 1, 2, 2, 2;  // the groups themselves
  const std::vector<int> groups = {0, 0, 0, 1, 1, 1};
  for (int i = 0; i < 6; ++i) values[i] = (3 * i + (i < 3 ? 7 : -2)) / scale[i];
  const TrendTest test = trend_test(values, columns, scale, groups);
  EXPECT_EQ(test.dimensions, 1);
  EXPECT_NEAR(test.coefficients[0], 3, 1e-9);
  EXPECT_EQ(test.coefficients[1], 0);
  EXPECT_EQ(test.coefficients[2], 0);
}

NamedEffect sag() {
  NamedEffect e;
  e.name = "battery_sag";
  e.parameters = {{"rate", 0.0035, 0.0031, 0.004, "1/min"}};
  e.closed = 0.88;
  return e;
}

TEST(Findings, ReportEffectsInPlainUnits) {
  EXPECT_EQ(effect_sentence(sag(), drive_effect_diagnoses()),
            "The battery loses 0.35 % (0.31 to 0.4) of its speed a minute; adding that closes 88 % "
            "of the gap in log score.");
  NamedEffect slower;
  slower.name = "motor_asymmetry";
  slower.parameters = {{"ratio", -0.067, -0.07, -0.06, "-"}};
  EXPECT_EQ(effect_sentence(slower, drive_effect_diagnoses()),
            "The right side runs 6.7 % (6 to 7) slower than the left.");
  NamedEffect strange;
  strange.name = "moon_phase";
  strange.parameters = {{"pull", 2, 1, 3, "N"}};
  EXPECT_EQ(effect_sentence(strange, drive_effect_diagnoses()),
            "The data show moon_phase with pull 2 N (1 to 3).");
  for (const Effect& effect : srv1_effects()) {
    NamedEffect e;
    e.name = effect.name;
    for (const Parameter& p : effect.parameters) {
      e.parameters.push_back({p.key, 0.1, 0.05, 0.2, p.unit});
    }
    const std::string text = effect_sentence(e, drive_effect_diagnoses());
    EXPECT_EQ(text.find("The data show"), std::string::npos) << text;  // every effect has its words
    EXPECT_EQ(text.find("%1"), std::string::npos) << text;
    Diagnosis d;
    d.verdict = Verdict::kEffect;
    d.effects = {e};
    EXPECT_NE(action(d).substr(0, 5), "Paste") << effect.name << " has no short words";
  }
}

// What moves no mean cannot be screened by its probes: whoever adds such an effect says here how it
// is looked for.
TEST(Findings, EveryEffectOnTheSpreadIsLookedFor) {
  const std::set<std::string> engine = {"pose_latency", "pose_quantisation"};
  for (const Effect& effect : srv1_effects()) {
    const bool has_row = effect_diagnosis(effect.name).spread != nullptr;
    EXPECT_EQ(has_row, !effect.moves_means() && engine.count(effect.name) == 0) << effect.name;
  }
  for (const EffectDiagnosis* row : drive_effect_diagnoses()) {
    if (row->spread == nullptr) continue;
    EXPECT_STREQ(row->spread->effect, row->effect);
  }
}

TEST(Findings, EveryEffectOfACatalogueHasARow) {
  const std::set<std::string> searched = {"friction_patch", "friction_patch_2",
                                          "camera_seam_2"};  // not by a probe
  for (const Effect& effect : srv1_effects_and_seconds()) {
    const EffectDiagnosis* row = drive_effect_diagnoses().find(effect.name);
    ASSERT_NE(row, nullptr) << effect.name << " has no row in master/diagnose/effects/rows.inc";
    const bool turned = std::ranges::any_of(
        effect.parameters, [](const Parameter& p) { return p.key == "direction"; });
    const bool shown =
        turned || !row->steps.empty() || row->probes != nullptr || row->marks != nullptr;
    EXPECT_EQ(shown, effect.moves_means() && searched.count(effect.name) == 0) << effect.name;
    for (const ProbedStep& step : row->steps) {
      EXPECT_TRUE(std::any_of(effect.parameters.begin(), effect.parameters.end(),
                              [&](const Parameter& p) { return p.key == step.key; }))
          << effect.name << "." << step.key;
    }
    for (const char* alias : row->aliases) {
      const auto& back = drive_effect_diagnoses().row(alias).aliases;
      EXPECT_NE(std::find(back.begin(), back.end(), std::string(effect.name)), back.end())
          << alias << " does not know that it passes for " << effect.name;
    }
  }
  for (const Effect& effect : push_effects()) {
    EXPECT_NE(push_effect_diagnoses().find(effect.name), nullptr) << effect.name;
  }
}

TEST(Findings, ReportAtLengthWhatTheHeadlineIsOf) {
  const auto text = [](const Diagnosis& d) { return listed(findings(d)); };
  Diagnosis d;
  EXPECT_NE(text(d).find("as well as its own noise allows"), std::string::npos);
  d.verdict = Verdict::kUnknown;
  d.where = {{"all", "x", "bias", "", 1, 1, 0, "All motions end 1 mm too far ahead on average."}};
  EXPECT_NE(text(d).find("All motions end 1 mm"), std::string::npos);
  d.effects = {sag(), sag()};
  d.verdict = Verdict::kEffectAndUnknown;
  d.gap = {1, 0.25, 0};
  EXPECT_NE(text(d).find("75 %"), std::string::npos) << text(d);
}

// One line and one action, whatever was found.
TEST(Findings, AHeadlineIsALineAndAnAction) {
  Diagnosis d;
  EXPECT_EQ(headline(d), "Nothing is missing that these data could show.");
  EXPECT_NE(action(d).find("tuned.toml"), std::string::npos);
  d.verdict = Verdict::kUnknown;
  d.where = {{"forward", "x", "trend", "time", 1, 1, 0, "..."}};
  EXPECT_NE(action(d).find("how forward drives depend on time"), std::string::npos) << action(d);
  d.checks = {{"session", -40, 100}, {"place", -9, 20}};
  EXPECT_NE(action(d).find("each session in a file"), std::string::npos) << action(d);
  for (const Effect& effect : srv1_effects()) {
    NamedEffect e;
    e.name = effect.name;
    for (const Parameter& p : effect.parameters) {
      if (p.choices.empty()) e.parameters.push_back({p.key, -0.1, -0.2, -0.05, p.unit});
      if (!p.choices.empty()) e.axis = p.choices[1];
    }
    d.effects = {e, e, e};
    d.verdict = Verdict::kEffectAndUnknown;
    for (const std::string& line : {headline(d), action(d)}) {
      EXPECT_LT(line.size(), 140u) << line;
      EXPECT_EQ(line.find('@'), std::string::npos) << line;
      EXPECT_EQ(line.find('\n'), std::string::npos) << line;
    }
  }
}

// Of which axis a place is.
TEST(Findings, ASeamIsReportedWithItsAxis) {
  NamedEffect seam;
  seam.name = "camera_seam";
  seam.parameters = {{"offset_x", -0.22, -0.3, -0.2, "m"},
                     {"offset_y", 0, -0.1, 0.1, "m"},
                     {"position", 1.335, 1.23, 1.45, "m"}};
  seam.axis = "y";
  EXPECT_NE(effect_sentence(seam, drive_effect_diagnoses()).find("y = 1.33"), std::string::npos)
      << effect_sentence(seam, drive_effect_diagnoses());
  Diagnosis d;
  d.verdict = Verdict::kEffect;
  d.effects = {seam};
  EXPECT_EQ(headline(d), "Two cameras disagree at y = 1.33 m.") << headline(d);
}

TEST(Findings, ReportWhatThinDataCannotShow) {
  Data rich = make_data(9);
  TrialLog log;
  log.trials.resize(600);
  for (Trial& t : log.trials) t.t_s = 1;
  log.trials[0].path.resize(1);
  std::vector<std::string> sentences = cautions(rich.trials, rich.cells, log);
  ASSERT_EQ(sentences.size(), 1u);  // one level
  EXPECT_NE(sentences[0].find("one level"), std::string::npos);

  std::vector<ResidualTrial> poor(5, rich.trials[0]);
  for (ResidualTrial& t : poor) t.context.moved = true;
  sentences = cautions(poor, rich.cells, TrialLog{});
  EXPECT_GE(sentences.size(), 9u);
  EXPECT_EQ(cautions({}, {}, TrialLog{}).size(), 1u);

  const LogVariety variety = log_variety(poor, rich.cells, TrialLog{});
  EXPECT_EQ(variety.commands, 1u);
  // Free commands under one name.
  std::vector<ResidualTrial> free = rich.trials;
  for (ResidualTrial& t : free) t.command = 0;
  rich.cells.back().kind = MotionKind::kWide;
  EXPECT_GT(log_variety(free, rich.cells, log).commands, 1u);
  const std::string text = alias_sentence("com_offset", {"marker_offset"}, 1, lacking(variety));
  EXPECT_NE(text.find("marker_offset would explain about as much as com_offset"), std::string::npos)
      << text;
  EXPECT_NE(text.find("the log lacks several commands, several durations"), std::string::npos)
      << text;
  EXPECT_EQ(alias_sentence("com_offset", {}, 0, lacking(variety)), "");
  const std::string lost = alias_sentence("com_offset", {"marker_offset"}, 0, lacking(variety));
  EXPECT_EQ(lost.find("about as much"), std::string::npos) << lost;
  EXPECT_NE(lost.find("these data prefer com_offset"), std::string::npos) << lost;
}

}  // namespace
}  // namespace gapfarm::where_test
