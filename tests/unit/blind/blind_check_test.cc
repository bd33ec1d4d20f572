// The whole check with real simulations and fake diagnoses.
#include "master/experiments/blind_check/blind_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/config/model.h"
#include "common/trials/files.h"
#include "common/trials/read.h"
#include "master/diagnose/result/diagnosis_json.h"
#include "tests/unit/blind/worker_farm.h"

namespace gapfarm::blind_check_test {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

class BlindCheck : public ::testing::Test {
 protected:
  BlindCheck() {
    settings_.out = folder_ / "check";
    settings_.asked = "this";
    settings_.design.effects = {"motor_asymmetry", "marker_offset"};
    settings_.design.sizes = {{"clear", 5}};
    settings_.design.nulls = 1;
    settings_.design.pairs = 1;
    settings_.design.excluded = 1;
    settings_.diagnose.config_path = "small.toml";
    hooks_.start_farm = []() -> Result<std::unique_ptr<Farm>> {
      return std::unique_ptr<Farm>(std::make_unique<tests::WorkerFarm>());
    };
    hooks_.stop = &stop_;
    Model model = *nominal_model("srv1");
    model.commands = config_.problem.commands;
    EXPECT_TRUE(write_model(model, folder_ / "tuned.toml").ok());
    EXPECT_TRUE(write_model(model, folder_ / "model.toml").ok());
  }

  // $1 CONFIG, $3 trials, $5 out; every run leaves a line in runs.txt.
  void fake_diagnose(const Diagnosis& answer, const std::string& before = "") {
    const std::string script =
        "#!/bin/sh\necho \"$5 $*\" >> " + (folder_ / "runs.txt") + "\n" + before + "\ncp " +
        (folder_ / "model.toml") + " $5/model.toml\ncp " + (folder_ / "tuned.toml") +
        " $5/tuned.toml\ncat > $5/diagnosis.json" + " <<'END'\n" + to_json(answer) + "END\n";
    ASSERT_TRUE(write_file_atomically(folder_ / "diagnose.sh", script).ok());
    settings_.diagnose.command = {"/bin/sh", folder_ / "diagnose.sh"};
  }

  std::size_t runs() const {
    std::ifstream in(folder_ / "runs.txt");
    std::size_t count = 0;
    for (std::string line; std::getline(in, line);) ++count;
    return count;
  }

  Result<BlindReport> run() { return run_blind_check(config_, settings_, hooks_); }

  TemporaryFolder folder_;
  Config config_ = tests::small_config();
  BlindCheckSettings settings_;
  BlindCheckHooks hooks_;
  StopSource stop_;
};

Diagnosis with_verdict(Verdict verdict) {
  Diagnosis diagnosis;
  diagnosis.verdict = verdict;
  return diagnosis;
}

Diagnosis asymmetry() {
  Diagnosis diagnosis = with_verdict(Verdict::kEffect);
  NamedEffect& effect = diagnosis.effects.emplace_back();
  effect.name = "motor_asymmetry";
  effect.closed = 0.9;
  effect.parameters = {{"ratio", 0, -1, 1, "-"}};
  return diagnosis;
}

TEST_F(BlindCheck, ScoresWhatTheDiagnosesReport) {
  fake_diagnose(asymmetry(), "ls -a \"$(dirname $3)\" > $5/seen.txt");
  const auto report = run();
  ASSERT_TRUE(report.ok()) << report.error().message;
  ASSERT_EQ(report->cases.size(), 5u);  // two singles, a null, a pair, a omitted effect
  const Tally sum = tally(report->cases);
  EXPECT_EQ(sum.right.hits, 1u);
  EXPECT_EQ(sum.false_alarms.hits, 1u);
  EXPECT_EQ(sum.by_effect.at("motor_asymmetry").at("clear").hits, 1u);
  EXPECT_EQ(sum.covered.hits, sum.covered.total);
  for (const ScoredCase& c : report->cases) {
    // The fake's model is its tuned base: nothing was gained, whatever it promises.
    ASSERT_TRUE(c.fresh.has_value()) << c.truth.id;
    EXPECT_EQ(c.fresh->tuned, c.fresh->final_);
    if (c.truth.kind != CaseKind::kNull) {
      EXPECT_GT(c.fresh->truth, c.fresh->tuned) << c.truth.id;
    }
    // A case's folder holds its log and nothing else.
    EXPECT_EQ(*read_text_file(settings_.out + "/diagnoses/" + c.truth.id + "/seen.txt"),
              ".\n..\ntrials.csv\n");
    const auto names = std::vector<std::string>{"forward", "backward", "turn_ccw",
                                                "turn_cw", "wide_ccw", "wide_cw"};
    const auto log = read_trial_files(
        std::vector<std::string>{settings_.out + "/cases/" + c.truth.id + "/trials.csv"}, names);
    ASSERT_TRUE(log.ok());
    EXPECT_EQ(log->trials.size(), 24u);
  }
  EXPECT_TRUE(fs::exists(settings_.out + "/blind_check.json"));
  EXPECT_TRUE(fs::exists(settings_.out + "/blind_check.md"));
  EXPECT_FALSE(fs::exists(settings_.out + ".truths"));
  // The effect that is omitted is commanded to its case alone.
  const std::string record = *read_text_file(folder_ / "runs.txt");
  EXPECT_EQ(record.find("--exclude"), record.rfind("--exclude"));
  EXPECT_NE(record.find("--exclude"), record.npos);
}

// What is promised is promised of named effects; what is used is the model with its [residual].
TEST_F(BlindCheck, AnEffectThatWasHeldOutIsScoredWithItsResidual) {
  Model model = *read_model(folder_ / "tuned.toml");
  ResidualTerm ahead;
  ahead.covariates = {4};  // duration
  ahead.lengths = {10};
  ahead.centres = Eigen::MatrixXd::Ones(1, 1);
  ahead.weights = {{"", Eigen::RowVector3d(0.05, 0, 0)}};
  model.residual.field = {ahead};
  ASSERT_TRUE(write_model(model, folder_ / "model.toml").ok());
  fake_diagnose(with_verdict(Verdict::kUnknown));
  settings_.design.effects = {"motor_asymmetry"};
  settings_.design.nulls = settings_.design.pairs = 0;
  const auto report = run();
  ASSERT_TRUE(report.ok()) << report.error().message;
  for (const ScoredCase& c : report->cases) {
    EXPECT_FALSE(c.realised.has_value());
    ASSERT_EQ(c.fresh.has_value(), c.truth.kind == CaseKind::kOutside);
    if (!c.fresh) continue;
    EXPECT_EQ(c.fresh->final_, c.fresh->tuned);
    ASSERT_TRUE(c.fresh->corrected.has_value());
    EXPECT_LT(*c.fresh->corrected, c.fresh->final_);  // no robot drives 5 cm farther
  }
  EXPECT_EQ(tally(report->cases).outside_closed.hits, 0u);
  EXPECT_EQ(tally(report->cases).outside_closed.total, 1u);
}

TEST_F(BlindCheck, TruthsAreSealedWhileDiagnosesRun) {
  fake_diagnose(with_verdict(Verdict::kNone),
                "test -e " + settings_.out + "/seals.txt && test ! -e " + settings_.out +
                    "/truth && test ! -e " + settings_.out + ".key && ! grep -rq asymmetry " +
                    settings_.out + "/cases || exit 9");
  const auto report = run();
  ASSERT_TRUE(report.ok()) << report.error().message;
  for (const ScoredCase& c : report->cases) EXPECT_EQ(c.end.state, ChildState::kDone);
}

TEST_F(BlindCheck, ACrashIsACountedOutcome) {
  fake_diagnose(with_verdict(Verdict::kNone), "kill -SEGV $$");
  settings_.design.pairs = settings_.design.excluded = 0;
  const auto report = run();
  ASSERT_TRUE(report.ok()) << report.error().message;
  const Tally sum = tally(report->cases);
  EXPECT_EQ(sum.failed.hits, report->cases.size());
  EXPECT_EQ(sum.right.hits, 0u);
  EXPECT_EQ(sum.confusion.at("none").at("failed"), 1u);
}

TEST_F(BlindCheck, ResumesWithoutRunningFinishedCasesAgain) {
  fake_diagnose(with_verdict(Verdict::kNone));
  hooks_.diagnosed = [this](std::size_t done, std::size_t) {
    if (done == 2) stop_.request();
  };
  const auto stopped = run();
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::kStopped);
  EXPECT_TRUE(fs::exists(settings_.out + ".truths"));

  settings_.asked = "another";
  const auto another = run();
  ASSERT_FALSE(another.ok());
  EXPECT_THAT(another.error().message, HasSubstr("holds another blind check"));

  StopSource fresh_stop;
  hooks_.stop = &fresh_stop;
  hooks_.diagnosed = [](std::size_t, std::size_t) {};
  settings_.asked = "this";
  const auto resumed = run();
  ASSERT_TRUE(resumed.ok()) << resumed.error().message;
  EXPECT_EQ(resumed->cases.size(), 5u);
  // One more may have been cut short by the stop.
  EXPECT_GE(runs(), 5u);
  EXPECT_LE(runs(), 6u);
  EXPECT_FALSE(fs::exists(settings_.out + ".truths"));

  const std::size_t before = runs();
  EXPECT_FALSE(run().ok());
  fs::remove(settings_.out + "/blind_check.json");
  const auto opened = run();  // an opened check is scored again
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  EXPECT_EQ(runs(), before);
  EXPECT_EQ(format_blind_json(*opened), format_blind_json(*resumed));
}

TEST_F(BlindCheck, ResumeRefusesWhatWasTamperedWith) {
  fake_diagnose(with_verdict(Verdict::kNone));
  settings_.design.effects = {"motor_asymmetry"};
  settings_.design.pairs = settings_.design.excluded = 0;
  ASSERT_TRUE(run().ok());
  fs::remove(settings_.out + "/blind_check.json");
  const std::string seals = *read_text_file(settings_.out + "/seals.txt");
  std::string changed = seals;
  changed[10] = changed[10] == '0' ? '1' : '0';
  ASSERT_TRUE(write_file_atomically(settings_.out + "/seals.txt", changed).ok());
  const auto tampered = run();
  ASSERT_FALSE(tampered.ok());
  EXPECT_THAT(tampered.error().message, HasSubstr("does not match its seal"));
}

TEST_F(BlindCheck, RunsOnForeignCases) {
  fake_diagnose(asymmetry());
  for (const char* id : {"case01", "case02", "case03"}) {
    ASSERT_TRUE(
        write_file_atomically(folder_ / ("f/" + std::string(id) + "/trials.csv"), "x").ok());
  }
  ASSERT_TRUE(write_file_atomically(folder_ / "f/truth/case01.json",
                                    R"({"effects": {"motor_asymmetry": {"ratio": 0.1}},
                                        "level": "clear", "answer": "effect"})")
                  .ok());
  ASSERT_TRUE(write_file_atomically(folder_ / "f/truth/case02.json",
                                    R"({"effects": {"crosstalk": {"p0": 0.1}},
                                        "answer": "unknown"})")
                  .ok());
  const auto report = run_foreign_check(folder_ / "f", folder_ / "f/truth", settings_, hooks_);
  ASSERT_TRUE(report.ok()) << report.error().message;
  ASSERT_EQ(report->cases.size(), 3u);
  EXPECT_TRUE(report->cases[0].judgement.right);
  EXPECT_FALSE(report->cases[1].judgement.right);
  EXPECT_FALSE(report->cases[2].has_truth);
  EXPECT_EQ(tally(report->cases).right.total, 2u);
  EXPECT_FALSE(run_foreign_check(folder_ / "nothing", "", settings_, hooks_).ok());
}

}  // namespace gapfarm::blind_check_test
