// A run as a call: what it returns and what its store keeps, over a worker in this process.
#include "master/run/run.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "common/config/model.h"
#include "common/trials/read.h"
#include "master/run/stored_run.h"
#include "tests/integration/demo_config.h"
#include "tests/unit/blind/worker_farm.h"
#include "tests/unit/run/config_of_run.h"
#include "tests/unit/worker/ground_problem.h"

namespace gapfarm::run_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr std::uint64_t kGenerations = 3;

// A worker; what it is asked is counted, and something may go wrong at a batch of tasks.
class ShakyFarm : public tests::WorkerFarm {
 public:
  struct Faults {
    std::size_t no_worker_at = 0;  // batch, from 1; 0: none
    std::size_t gives_up_at = 0;   // same: its first task
  };

  ShakyFarm(const Faults& faults, std::size_t* batches) : faults_(faults), batches_(batches) {}

  Status stream(const std::string& problem, std::vector<v1::Task> tasks, const TakeAnswer& take,
                const OnProgress& on_progress) override {
    if (++*batches_ == faults_.no_worker_at) return Error{"no worker can be had"};
    const bool gives_up = *batches_ == faults_.gives_up_at;
    const auto shaken = [&](std::size_t place, v1::TaskResult result) {
      if (gives_up && place == 0) {
        result.Clear();
        result.set_outcome(v1::WORKER_FAILED);
        ++given_up_;
      }
      return take(place, std::move(result));
    };
    return WorkerFarm::stream(problem, std::move(tasks), shaken, on_progress);
  }

  std::uint64_t given_up() const override { return given_up_; }
  std::string numeric_class() const override { return "here"; }

 private:
  Faults faults_;
  std::size_t* batches_;
  std::uint64_t given_up_ = 0;
};

class Listener : public RunWatcher {
 public:
  void error(const Error& error) override { errors.push_back(error.message); }
  void read(const TrialLog& log) override { apart += log.trials.size(); }
  std::vector<std::string> errors;
  std::size_t apart = 0;
};

class RunTest : public testing::Test {
 protected:
  std::string path(const std::string& name = "run") const { return folder_ / name; }

  Config config(const std::string& sections = "") const {
    Config made = tests::config_of_run(
        demo_config(
            4, 0, "",
            "[evolution.stop]\ngenerations = " + std::to_string(kGenerations) + "\n" + sections),
        folder_ / "config.toml");
    made.seed = 7;
    made.problem.log.trials.resize(12);
    return made;
  }

  // A ground robot's search begins with simulations before its first generation.
  Config ground_config() const {
    std::ofstream(folder_ / "skid.toml") << tests::kSkidFile;
    Config made =
        parse_config(
            "scenario = \"ground\"\n[robot]\nfile = \"skid.toml\"\n[genes]\nlag = \"table\"\n",
            folder_ / "ground.toml")
            .value();
    tests::take_runs(made.problem, {tests::driven_run(made.problem, made.problem.values, 4)});
    return made;
  }

  RunStore begin(const Config& config, const std::string& name = "run") const {
    auto store = RunStore::create(path(name), run_info(config, {}));
    EXPECT_TRUE(store.ok()) << store.error().message;
    return *std::move(store);
  }

  // Stops when so many generations were evaluated, if at all.
  Result<RunSummary> go(RunStore& store, const Config& config, ShakyFarm::Faults faults = {},
                        std::size_t stop_after = 1000) {
    Log log(LogOptions{"test", LogFormat::kText, LogLevel::kOff, ""});
    std::size_t batches = 0;
    const auto open = [&](const auto&) -> Result<std::unique_ptr<Farm>> {
      return std::unique_ptr<Farm>(std::make_unique<ShakyFarm>(faults, &batches));
    };
    return evolve_run(store,
                      {config, config.problem, log, open, [&] { return batches >= stop_after; }},
                      listener_);
  }

  // As `resume` does it.
  Result<RunSummary> go_on(const std::string& name = "run") {
    auto store = RunStore::open(path(name));
    if (!store) return store.error();
    const auto config = stored_config(store->info(), {});
    if (!config) return config.error();
    return go(*store, *config);
  }

  std::string digest(const std::string& name = "run") const {
    return RunReader::open(path(name)).value().generations().value().back().digest;
  }
  Progress progress() const { return RunReader::open(path()).value().progress().value(); }

  TemporaryFolder folder_;
  Listener listener_;
};

TEST_F(RunTest, LeavesItsModelAndPicturesBehind) {
  const Config asked = config();
  RunStore store = begin(asked);
  const RunSummary summary = go(store, asked).value();
  EXPECT_FALSE(summary.stopped());
  EXPECT_EQ(summary.evolved.generations, kGenerations);
  EXPECT_EQ(summary.given_up, 0u);
  EXPECT_THAT(summary.files, SizeIs(4));
  for (const std::string& file : summary.files) EXPECT_TRUE(std::filesystem::exists(file)) << file;
  EXPECT_EQ(progress().state, RunState::kFinished);
  EXPECT_THAT(listener_.errors, IsEmpty());
}

TEST_F(RunTest, ItsModelNamesTheLogsFilesAlsoAfterItWasResumed) {
  Config asked = config();
  asked.trial_files = {"monday.csv", "tuesday.csv"};  // not the config's: as by --trials
  RunStore store = begin(asked);
  ASSERT_TRUE(go(store, asked).ok());
  const auto files = [&] { return read_model(path() + "/model.toml").value().data.files; };
  EXPECT_EQ(files(), asked.trial_files);
  { const RunStore closed = std::move(store); }
  ASSERT_TRUE(go_on().ok());
  EXPECT_EQ(files(), asked.trial_files);
  EXPECT_EQ(current_best(RunReader::open(path()).value()).value().data.files, asked.trial_files);
}

TEST_F(RunTest, StoppedItLeavesNothingAndGoesOnToTheSameGenerations) {
  const Config asked = config();
  RunStore whole = begin(asked, "whole");
  ASSERT_TRUE(go(whole, asked).ok());
  {
    RunStore store = begin(asked);
    const RunSummary summary = go(store, asked, {}, 2).value();
    EXPECT_TRUE(summary.stopped());
    EXPECT_EQ(summary.evolved.generations, 2u);
    EXPECT_THAT(summary.files, IsEmpty());
  }
  EXPECT_EQ(progress().state, RunState::kStopped);
  EXPECT_FALSE(std::filesystem::exists(path() + "/model.toml"));

  const RunSummary summary = go_on().value();
  EXPECT_FALSE(summary.stopped());
  EXPECT_EQ(summary.evolved.generations, kGenerations);
  EXPECT_EQ(digest(), digest("whole"));
}

TEST_F(RunTest, ReportsInItsStoreWhyItFailedAndGoesOn) {
  const Config asked = config();
  {
    RunStore store = begin(asked);
    const auto summary = go(store, asked, {.no_worker_at = 2});
    ASSERT_FALSE(summary.ok());
    EXPECT_EQ(summary.error().message, "no worker can be had");
  }
  EXPECT_EQ(progress().state, RunState::kStopped);
  EXPECT_EQ(progress().stop_reason, "no worker can be had");
  EXPECT_EQ(go_on().value().evolved.generations, kGenerations);
}

// As where the disk is full: all generations are there, the model is not.
TEST_F(RunTest, IsNotFinishedWithoutItsReportAndLeavesItWhenItGoesOn) {
  const Config asked = config();
  const std::string report = path() + "/report.html";
  {
    RunStore store = begin(asked);
    std::filesystem::create_directories(report + "/in the way");
    const auto summary = go(store, asked);
    ASSERT_FALSE(summary.ok());
    EXPECT_THAT(summary.error().message, HasSubstr(report));
    EXPECT_EQ(progress().state, RunState::kStopped);
    EXPECT_EQ(progress().stop_reason, summary.error().message);
  }
  std::filesystem::remove_all(report);
  const RunSummary summary = go_on().value();
  EXPECT_EQ(summary.evolved.generations, kGenerations);
  EXPECT_THAT(summary.files, SizeIs(4));
  EXPECT_EQ(progress().state, RunState::kFinished);
  EXPECT_TRUE(std::filesystem::is_regular_file(report));
}

TEST_F(RunTest, ReportsInItsStoreWhyItFailedBeforeItsFirstGeneration) {
  const Config asked = ground_config();
  RunStore store = begin(asked);
  ASSERT_EQ(progress().state, RunState::kRunning);
  const auto summary = go(store, asked, {.no_worker_at = 2});
  ASSERT_FALSE(summary.ok());
  EXPECT_EQ(summary.error().message, "no worker can be had");
  EXPECT_TRUE(RunReader::open(path()).value().generations().value().empty());
  EXPECT_EQ(progress().state, RunState::kStopped);
  EXPECT_EQ(progress().stop_reason, "no worker can be had");
}

TEST_F(RunTest, ReportsInItsStoreThatNoFarmCouldBeOpened) {
  const Config asked = config();
  RunStore store = begin(asked);
  Log log(LogOptions{"test", LogFormat::kText, LogLevel::kOff, ""});
  const auto open = [](const auto&) -> Result<std::unique_ptr<Farm>> {
    return Error{"the port is taken"};
  };
  ASSERT_FALSE(evolve_run(store, {asked, asked.problem, log, open, {}}, listener_).ok());
  EXPECT_EQ(progress().state, RunState::kStopped);
  EXPECT_EQ(progress().stop_reason, "the port is taken");
}

TEST_F(RunTest, CountsWhatItGaveUpBeforeItWasStopped) {
  const Config asked = config();
  {
    RunStore store = begin(asked);
    ASSERT_TRUE(go(store, asked, {.gives_up_at = 1}, 1).value().stopped());
  }
  EXPECT_EQ(go_on().value().given_up, 1u);
}

TEST_F(RunTest, OpensNoFarmForTrialsHeldOutThatAreNotThere) {
  const Config asked = config("[validation]\ntrials = [\"gone.csv\"]\n");
  RunStore store = begin(asked);
  Log log(LogOptions{"test", LogFormat::kText, LogLevel::kOff, ""});
  const auto open = [](const auto&) -> Result<std::unique_ptr<Farm>> {
    ADD_FAILURE() << "a farm was opened";
    return Error{"none"};
  };
  const auto summary = evolve_run(store, {asked, asked.problem, log, open, {}}, listener_);
  ASSERT_FALSE(summary.ok());
  EXPECT_THAT(summary.error().message, HasSubstr("gone.csv"));
  EXPECT_EQ(progress().state, RunState::kStopped);
  EXPECT_THAT(progress().stop_reason, HasSubstr("gone.csv"));
}

TEST_F(RunTest, HoldsItsBestAgainstTrialsHeldOut) {
  std::filesystem::copy_file(GAPFARM_SOURCE_DIR "/configs/demo/trials.csv", folder_ / "apart.csv");
  const Config asked = config("[validation]\ntrials = [\"apart.csv\"]\n");
  RunStore store = begin(asked);
  const RunSummary summary = go(store, asked).value();
  EXPECT_EQ(summary.held_out, listener_.apart);
  std::vector<std::string> names;
  for (const ScoreRow& row : summary.validated) names.push_back(row.name);
  EXPECT_THAT(names, ElementsAre("the config's own values", "the best"));
}

TEST_F(RunTest, OfBeforeThereWasAnotherDefaultGoesOnByTheGeneticAlgorithm) {
  Config silent = config();
  const std::size_t section = silent.text.find("population = 4\n");
  silent.text.erase(section, std::string("population = 4\n").size());
  silent.evolution.optimiser.kind = OptimiserKind::kAutoSearch;
  RunInfo info = run_info(silent, {});
  EXPECT_EQ(stored_config(info, {})->evolution.optimiser.kind, OptimiserKind::kAutoSearch);
  info.overrides = "{}";
  EXPECT_EQ(stored_config(info, {})->evolution.optimiser.kind, OptimiserKind::kGenetic);
}

TEST(Overrides, OutrankWhatWasStoredAndComeBackFromJson) {
  EvolutionOverrides first, later;
  first.generations = 5;
  first.time_s = 1.5;
  later.generations = 9;
  later.population = 12;
  RunInfo info;
  info.overrides = R"({"folder": "/where/it/began", "generations": 3})";
  info.overrides = merged_overrides(info, first);
  info.overrides = merged_overrides(info, later);
  EXPECT_THAT(info.overrides, HasSubstr("/where/it/began"));
  EvolutionSettings settings;
  EvolutionOverrides::from_json(info.overrides).apply(settings);
  EXPECT_EQ(settings.generations, 9u);
  EXPECT_EQ(settings.time_s, 1.5);
  EXPECT_EQ(settings.population, 12u);
  EXPECT_EQ(settings.optimiser.population, 12u);
  EXPECT_EQ(settings.evaluations, std::nullopt);
  EXPECT_EQ(EvolutionOverrides::from_json("[1]").generations, std::nullopt);
}

// A log that holds a part of the model's trials is no other log: baselines that had learned from
// the very trials that they predict would win.
TEST_F(RunTest, BaselinesHaveSeenNoTrialThatTheyPredict) {
  const std::string file = GAPFARM_SOURCE_DIR "/configs/demo/trials.csv";
  auto model = nominal_model("srv1");
  ASSERT_TRUE(model) << model.error().message;
  const std::vector<std::string> files = {file};
  TrialLog log = *read_trial_files(files, command_names(model->commands));
  model->data.files = files;
  model->data.trials = log.trials.size();
  const auto note_of = [&](const TrialLog& of) {
    const auto note = baseline_note(*model, of, std::vector<double>(of.trials.size(), 10.0));
    EXPECT_TRUE(note) << note.error().message;
    return *note;
  };
  TrialLog part = log, other = log;
  part.trials.resize(log.trials.size() - 1);
  for (Trial& trial : other.trials) trial.X_WE.x += 1e-3;
  EXPECT_THAT(note_of(log), HasSubstr("other sessions or parts of the log"));
  EXPECT_THAT(note_of(part), HasSubstr("other sessions or parts of the log"));
  EXPECT_THAT(note_of(other), HasSubstr("learned from the model's trials"));
}

}  // namespace gapfarm::run_test
