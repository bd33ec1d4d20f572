#include "master/store/run_store.h"

#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

#include "common/problem/problem.h"
#include "master/store/run_reader.h"
#include "tests/unit/store/store_fixture.h"

namespace gapfarm::run_store_test {

using ::testing::HasSubstr;

class RunStoreTest : public StoreTest {
 protected:
  // A store with generations 1 to `count`.
  RunStore store_with(std::uint64_t count) {
    Result<RunStore> store = RunStore::create(run(), example_info());
    EXPECT_TRUE(store.ok());
    for (std::uint64_t g = 1; g <= count; ++g) {
      EXPECT_TRUE(store->commit(example_generation(g)).ok());
    }
    return std::move(*store);
  }

  void write(const std::filesystem::path& path, const std::string& bytes) const {
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << bytes;
  }

  void sql(const std::string& text) const {
    Result<Database> database = Database::open(file(), Database::Mode::kWrite);
    ASSERT_TRUE(database.ok());
    ASSERT_TRUE(database->exec(text, "test").ok());
  }
};

TEST_F(RunStoreTest, GivesBackWhatWasPutIn) {
  { RunStore store = store_with(2); }
  const Result<RunReader> reader = RunReader::open(run());
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  const RunInfo wanted = example_info();
  EXPECT_EQ(reader->info().seed, wanted.seed);
  EXPECT_EQ(reader->info().problem, wanted.problem);
  EXPECT_EQ(reader->info().config_text, wanted.config_text);
  EXPECT_FALSE(reader->info().fingerprint.empty());
  EXPECT_FALSE(reader->info().created.empty());

  const auto generations = reader->generations();
  ASSERT_TRUE(generations.ok());
  ASSERT_EQ(generations->size(), 2u);
  const StoredGeneration& second = (*generations)[1];
  const StoredGeneration expected = example_generation(2);
  EXPECT_EQ(second.generation, 2u);
  EXPECT_EQ(second.best, 2.0);
  EXPECT_EQ(second.mean, 1.5);
  EXPECT_EQ(second.median, 1.5);
  EXPECT_EQ(second.worst, 1.0);
  EXPECT_EQ(second.operator_probabilities, expected.operator_probabilities);
  EXPECT_EQ(second.evaluations, 6u);

  const auto individuals = reader->individuals(2);
  ASSERT_TRUE(individuals.ok());
  ASSERT_EQ(individuals->size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const StoredIndividual& a = (*individuals)[i];
    const StoredIndividual& b = expected.individuals[i];
    EXPECT_EQ(a.birth_id, b.birth_id);
    EXPECT_EQ(a.genome, b.genome);
    EXPECT_EQ(a.fitness, b.fitness);
    EXPECT_EQ(a.outcome, b.outcome);
    EXPECT_EQ(a.parents, b.parents);
    EXPECT_EQ(a.operators, b.operators);
    EXPECT_EQ(a.values, b.values);
    EXPECT_EQ(a.scores, b.scores);
  }
}

TEST_F(RunStoreTest, ContinuesWhereItStopped) {
  { RunStore store = store_with(2); }
  Result<RunStore> store = RunStore::open(run());
  ASSERT_TRUE(store.ok()) << store.error().message;
  EXPECT_EQ(store->epoch(), 2u);
  const auto last = store->checkpoint();
  ASSERT_TRUE(last.ok());
  ASSERT_TRUE(last->has_value());
  EXPECT_EQ((*last)->generation, 2u);
  EXPECT_EQ((*last)->evaluations, 6u);
  EXPECT_EQ((*last)->wall_s, 1.0);
  EXPECT_EQ((*last)->optimiser_state, example_generation(2).optimiser_state);
  EXPECT_EQ((*store->checkpoint(1))->optimiser_state, example_generation(1).optimiser_state);
  EXPECT_THAT(store->checkpoint(7).error().message, HasSubstr("the last one is 2"));
}

TEST_F(RunStoreTest, DigestDoesNotCareAboutInterruptionsOrTimes) {
  std::string straight;
  {
    RunStore store = store_with(4);
    straight = (*store.checkpoint())->digest;
  }
  std::filesystem::remove_all(run());
  { RunStore store = store_with(2); }
  {
    Result<RunStore> store = RunStore::open(run());
    StoredGeneration slow = example_generation(3);
    slow.wall_s = 99;
    ASSERT_TRUE(store->commit(slow).ok());
    EXPECT_EQ(*store->commit(example_generation(4)), straight);
  }
}

TEST_F(RunStoreTest, DigestSeesEveryGenomeAndScore) {
  const StoredGeneration base = example_generation(1);
  const std::string digest = generation_digest("", base);
  const auto changed = [&](auto change) {
    StoredGeneration other = base;
    change(other.individuals[1]);
    return generation_digest("", other);
  };
  EXPECT_NE(changed([](StoredIndividual& i) { i.genome[0] += 1e-16; }), digest);
  EXPECT_NE(changed([](StoredIndividual& i) { *i.fitness += 1e-15; }), digest);
  EXPECT_NE(changed([](StoredIndividual& i) { i.fitness.reset(); }), digest);
  EXPECT_NE(changed([](StoredIndividual& i) { i.scores = 3; }), digest);
  EXPECT_NE(changed([](StoredIndividual& i) { i.birth_id = 0; }), digest);
  EXPECT_NE(changed([](StoredIndividual& i) { i.outcome = "FELL_OVER"; }), digest);
  EXPECT_NE(generation_digest("x", base), digest);
}

TEST_F(RunStoreTest, RefusesASecondRunInTheSameFolder) {
  { RunStore store = store_with(1); }
  const Result<RunStore> again = RunStore::create(run(), example_info());
  ASSERT_FALSE(again.ok());
  EXPECT_THAT(again.error().message, HasSubstr("holds a run already"));
  EXPECT_THAT(again.error().message, HasSubstr("gapfarm resume"));
}

TEST_F(RunStoreTest, RefusesASecondMasterAndNamesTheFirst) {
  const RunStore store = store_with(1);
  const Result<RunStore> second = RunStore::open(run());
  ASSERT_FALSE(second.ok());
  EXPECT_THAT(second.error().message, HasSubstr("in use by process " + std::to_string(::getpid())));
  EXPECT_EQ(run_lock_held(run()), true);
}

TEST_F(RunStoreTest, RefusesAGap) {
  RunStore store = store_with(1);
  EXPECT_FALSE(store.commit(example_generation(3)).ok());
  EXPECT_FALSE(store.commit(example_generation(1)).ok());
  EXPECT_EQ((*store.checkpoint())->generation, 1u);
}

TEST_F(RunStoreTest, CommitsAllOfAGenerationOrNothing) {
  RunStore store = store_with(1);
  sql("CREATE TRIGGER fault BEFORE INSERT ON individuals WHEN NEW.rank = 2 "
      "BEGIN SELECT raise(ABORT, 'injected'); END");
  EXPECT_THAT(store.commit(example_generation(2)).error().message, HasSubstr("injected"));
  sql("DROP TRIGGER fault");
  EXPECT_EQ((*store.checkpoint())->generation, 1u);
  EXPECT_EQ(RunReader::open(run())->individuals(2)->size(), 0u);
  EXPECT_TRUE(store.commit(example_generation(2)).ok());
}

TEST_F(RunStoreTest, BranchesFromAnEarlierGenerationAndKeepsTheTail) {
  RunStore store = store_with(5);
  const std::string whole = (*store.checkpoint())->digest;
  const std::string third = (*store.checkpoint(3))->digest;
  const auto backup = store.truncate_after(3);
  ASSERT_TRUE(backup.ok()) << backup.error().message;
  EXPECT_EQ(backup->filename(), "run.generation-5.sqlite");
  EXPECT_EQ((*store.checkpoint())->digest, third);
  EXPECT_EQ(RunReader::open(run())->individuals(4)->size(), 0u);
  EXPECT_EQ(RunReader::open(*backup)->generations()->back().digest, whole);

  // The same future gives the same digest, and a second branch another backup.
  ASSERT_TRUE(store.commit(example_generation(4)).ok());
  EXPECT_EQ(*store.commit(example_generation(5)), whole);
  EXPECT_EQ(store.truncate_after(1)->filename(), "run.generation-5.2.sqlite");
  EXPECT_TRUE(store.truncate_after(1)->empty());
  EXPECT_FALSE(store.truncate_after(2).ok());
}

TEST_F(RunStoreTest, ReportsWhatIsWrongWithAFile) {
  write(file(), "this is not a database at all, not even close to one, however long it gets");
  EXPECT_THAT(RunReader::open(run()).error().message, HasSubstr("not a SQLite file"));
  EXPECT_THAT(RunStore::open(run()).error().message, HasSubstr("not a SQLite file"));

  std::filesystem::remove(file());
  EXPECT_THAT(RunReader::open(run()).error().message, HasSubstr("holds no run"));
  EXPECT_THAT(RunStore::open(run()).error().message, HasSubstr("gapfarm evolve"));

  write(file(), "");
  EXPECT_THAT(RunReader::open(run()).error().message, HasSubstr("interrupted"));
  EXPECT_TRUE(RunStore::create(run(), example_info()).ok()) << "an interrupted creation is free";

  sql("PRAGMA user_version = 99");
  EXPECT_THAT(RunReader::open(run()).error().message, HasSubstr("newer gapfarm (schema 99"));
  EXPECT_THAT(RunStore::open(run()).error().message, HasSubstr("newer gapfarm"));

  sql("PRAGMA application_id = 7");
  EXPECT_THAT(RunReader::open(run()).error().message, HasSubstr("another program"));
}

TEST_F(RunStoreTest, NoticesDamageBeforeItGoesOn) {
  { RunStore store = store_with(40); }
  const auto size = std::filesystem::file_size(file());
  {
    std::fstream damaged(file(), std::ios::in | std::ios::out | std::ios::binary);
    damaged.seekp(static_cast<std::streamoff>(size / 2));
    damaged << std::string(size / 4, '\xff');
  }
  const Result<RunStore> store = RunStore::open(run());
  ASSERT_FALSE(store.ok());
  EXPECT_THAT(store.error().message, HasSubstr("damaged"));
}

// A master killed in the middle of a commit leaves a journal; the next reader rolls it back.
TEST_F(RunStoreTest, SurvivesAKillInTheMiddleOfACommit) {
  std::string digest;
  {
    RunStore store = store_with(2);
    digest = (*store.checkpoint())->digest;
  }
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    Result<Database> database = Database::open(file(), Database::Mode::kWrite);
    // A cache of nearly nothing spills half of the transaction into the file.
    static_cast<void>(database->exec(
        "PRAGMA cache_size = 1; BEGIN IMMEDIATE; DELETE FROM individuals; UPDATE generations SET "
        "optimiser_state = zeroblob(500000); ",
        "die"));
    ::kill(::getpid(), SIGKILL);
  }
  int how = 0;
  ASSERT_EQ(::waitpid(child, &how, 0), child);
  ASSERT_TRUE(WIFSIGNALED(how));
  ASSERT_TRUE(std::filesystem::exists(run() / "run.sqlite-journal"));

  const Result<RunReader> reader = RunReader::open(run());
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  EXPECT_EQ(reader->individuals(2)->size(), 3u);
  EXPECT_EQ((*RunStore::open(run())->checkpoint())->digest, digest);
}

FarmTally example_tally() {
  FarmTally tally;
  std::uint64_t value = 1;
  for (const FarmTally::Row& row : FarmTally::kRows) tally.*row.count = value++;
  return tally;
}

TEST_F(RunStoreTest, CountsTheFarmsTroublesOverAllMasters) {
  Progress progress;
  progress.farm = example_tally();
  {
    RunStore store = store_with(1);
    ASSERT_TRUE(store.set_progress(progress).ok());
    ASSERT_TRUE(store.set_progress(progress).ok());  // the same once more, not twice as much
  }
  for (std::uint64_t lives = 2; lives <= 3; ++lives) {
    Result<RunStore> store = RunStore::open(run());
    ASSERT_TRUE(store.ok()) << store.error().message;
    EXPECT_EQ(RunReader::open(run())->progress()->farm.retries, lives - 1) << "before it says more";
    ASSERT_TRUE(store->set_progress(progress).ok());
    const FarmTally all = RunReader::open(run())->progress()->farm;
    for (const FarmTally::Row& row : FarmTally::kRows) {
      EXPECT_EQ(all.*row.count, lives * (progress.farm.*row.count)) << row.key;
    }
  }
}

TEST_F(RunStoreTest, KeepsWhatWasGivenUpWithItsGeneration) {
  const auto texts = [this] {
    std::string all;
    const auto incidents = RunReader::open(run())->incidents();
    for (const Incident& incident : *incidents) {
      all += incident_name(incident.kind) + std::to_string(incident.generation) + incident.text;
    }
    return all;
  };
  {
    RunStore store = store_with(1);
    ASSERT_TRUE(store.add_incident(IncidentKind::kQuarantine, "a").ok());
    ASSERT_TRUE(store.add_incident(IncidentKind::kAlarm, "b").ok());
    StoredGeneration second = example_generation(2);
    second.quarantined = 1;
    ASSERT_TRUE(store.commit(second).ok());
    ASSERT_TRUE(store.add_incident(IncidentKind::kQuarantine, "c").ok());
    ASSERT_TRUE(store.add_incident(IncidentKind::kAlarm, "d").ok());
    EXPECT_EQ(*store.quarantined(), 1u);
    EXPECT_EQ(texts(), "quarantine2aalarm2bquarantine3calarm3d");
  }
  // Generation 3 is evaluated again; what is wrong with a machine stays wrong.
  Result<RunStore> store = RunStore::open(run());
  ASSERT_TRUE(store.ok()) << store.error().message;
  EXPECT_EQ(*store->quarantined(), 1u);
  EXPECT_EQ(texts(), "quarantine2aalarm2balarm3d");
  ASSERT_TRUE(store->truncate_after(1).ok());
  EXPECT_EQ(*store->quarantined(), 0u);
  EXPECT_EQ(texts(), "alarm2balarm3d");
}

TEST_F(RunStoreTest, ReadsAndUpgradesAnOlderSchema) {
  { RunStore store = store_with(3); }
  const auto schema_text = [this] {
    const auto database = Database::open(file(), Database::Mode::kQueryOnly);
    auto select = database->prepare("SELECT sql FROM sqlite_master ORDER BY name", "test");
    std::string text;
    while (*select->step()) text += select->text(0) + "\n";
    return text;
  };
  const std::string newest = schema_text();
  downgrade_to_schema_1();
  ASSERT_NE(schema_text(), newest);
  {
    const Result<RunReader> reader = RunReader::open(run());
    ASSERT_TRUE(reader.ok()) << reader.error().message;
    EXPECT_EQ(reader->generations()->size(), 3u);
    EXPECT_EQ(reader->progress()->epoch, 1u);
    EXPECT_EQ(reader->progress()->farm.retries, 0u);
    EXPECT_TRUE(reader->incidents()->empty());
    EXPECT_NE(schema_text(), newest) << "reading changes nothing";
  }
  Result<RunStore> store = RunStore::open(run());
  ASSERT_TRUE(store.ok()) << store.error().message;
  EXPECT_EQ(schema_text(), newest);
  EXPECT_EQ(store->epoch(), 2u);
  EXPECT_EQ((*store->checkpoint())->generation, 3u);
  EXPECT_TRUE(store->add_incident(IncidentKind::kAlarm, "x").ok());
  EXPECT_TRUE(store->commit(example_generation(4)).ok());
}

TEST_F(RunStoreTest, ObjectivesComeBackToTheBitAndCountInTheDigest) {
  RunStore store = store_with(0);
  StoredGeneration generation = example_generation(1);
  generation.individuals.front().objectives = {{"position", 0.1 + 0.2}, {"heading", -1e-300}};
  EXPECT_NE(generation_digest("", generation), generation_digest("", example_generation(1)));
  ASSERT_TRUE(store.commit(generation).ok());
  EXPECT_EQ(RunReader::open(run())->individuals(1)->front().objectives,
            generation.individuals.front().objectives);
}

TEST_F(RunStoreTest, ReadsBesideAWriter) {
  RunStore store = store_with(1);
  const Result<RunReader> reader = RunReader::open(run());
  for (std::uint64_t g = 2; g <= 10; ++g) {
    ASSERT_TRUE(store.commit(example_generation(g)).ok());
    EXPECT_EQ(reader->generations()->size(), g);
  }
}

TEST_F(RunStoreTest, ReadsAReadOnlyFolder) {
  { RunStore store = store_with(2); }
  namespace fs = std::filesystem;
  fs::permissions(folder_, fs::perms::all);
  fs::permissions(file(), fs::perms::owner_read | fs::perms::group_read | fs::perms::others_read);
  fs::permissions(run(), fs::perms::all & ~(fs::perms::owner_write | fs::perms::group_write |
                                            fs::perms::others_write));
  const bool root = ::geteuid() == 0;  // to whom permissions mean nothing
  if (root) {
    ASSERT_EQ(::seteuid(65534), 0);
  }
  {
    const Result<RunReader> reader = RunReader::open(run());
    EXPECT_TRUE(reader.ok());
    if (reader.ok()) {
      EXPECT_EQ(reader->generations()->size(), 2u);
    }
    EXPECT_EQ(run_lock_held(run()), false);
    EXPECT_FALSE(RunStore::open(run()).ok());
  }
  if (root) {
    ASSERT_EQ(::seteuid(0), 0);
  }
  fs::permissions(run(), fs::perms::all);
}

TEST(ReadableValues, NamesGenesAndChoices) {
  Problem problem;
  problem.values = problem.table().nominal();
  problem.commands = default_commands("srv1");
  const auto gene = [&](const char* key) {
    const std::size_t row = problem.table().row(key);
    const Parameter& p = problem.table()[row];
    problem.genes.push_back({row, p.lower, p.upper, ParameterScale::kLinear});
  };
  gene("robot");
  gene("mass");
  const Parameter& mass = problem.table()[problem.table().row("mass")];
  const std::string json = readable_values(problem, {1.0, 0.0});
  EXPECT_THAT(json, HasSubstr(R"("robot":"wheels")"));
  EXPECT_THAT(json, HasSubstr(R"("mass":)"));
  EXPECT_GT(mass.upper, mass.lower);
}

}  // namespace gapfarm::run_store_test
