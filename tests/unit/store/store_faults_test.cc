// Every call by which a run store changes its files is made to fail, once and for good; whoever
// opens the store afterwards finds it as it was before the change or after it, and whole.
#include <gmock/gmock.h>

#include <cerrno>
#include <filesystem>
#include <functional>

#include "master/store/run_reader.h"
#include "master/store/run_store.h"
#include "master/store/schema.h"
#include "tests/unit/store/io_faults.h"
#include "tests/unit/store/store_fixture.h"

namespace gapfarm::store_faults_test {

namespace fs = std::filesystem;
using ::testing::AnyOf;
using ::testing::HasSubstr;

// The file's schema and the digests of what is committed; "none": there is no run.
using State = std::vector<std::string>;

class StoreFaults : public StoreTest {
 protected:
  // What a new program finds.  Also checks that it could go on.
  State found() {
    if (!fs::exists(file())) return {"none"};
    if (was_interrupted()) {
      EXPECT_TRUE(RunStore::create(run(), example_info()).ok()) << "may be started again";
      return {"none"};
    }
    State state;
    {
      const auto database = Database::open(file(), Database::Mode::kQueryOnly);
      const auto schema = run_store_schema(*database);
      EXPECT_TRUE(schema.ok()) << schema.error().message;
      if (schema.ok()) state.push_back("schema " + std::to_string(*schema));
    }
    const auto store = RunStore::open(run());
    EXPECT_TRUE(store.ok()) << store.error().message;
    if (!store.ok()) return {"unusable"};
    const auto reader = RunReader::open(run());
    const auto generations = reader->generations();
    for (const StoredGeneration& generation : *generations) {
      state.push_back(generation.digest);
      EXPECT_EQ(reader->individuals(generation.generation)->size(), 3u);
    }
    return state;
  }

  bool was_interrupted() const {
    const auto reader = RunReader::open(run());
    return !reader && reader.error().message.find("was interrupted") != std::string::npos;
  }

  // Runs `change` on a fresh copy of the run with a fault at every index.  `change` says what it
  // believes to have committed by returning its status.
  void fail_everywhere(const std::function<Status()>& change, int error) {
    const fs::path kept = folder_ / "kept";
    fs::remove_all(kept);
    if (fs::exists(run())) fs::copy(run(), kept, fs::copy_options::recursive);
    const State before = found();
    put_back(kept);
    IoFaults::watch(run().string());
    ASSERT_TRUE(change().ok());
    const long calls = IoFaults::calls();
    IoFaults::rest();
    const State after = found();
    ASSERT_NE(before, after);
    ASSERT_GT(calls, 10) << "nothing is interposed";

    for (const bool for_good : {false, true}) {
      for (long index = 0; index < calls; ++index) {
        put_back(kept);
        IoFaults::fail(run().string(), index, for_good, error);
        const Status status = change();
        const std::string fault = IoFaults::failed();
        IoFaults::rest();
        SCOPED_TRACE((for_good ? "for good from " : "once at ") + fault);
        const State state = found();
        if (status) {
          ASSERT_EQ(state, after) << "it reported that all is well";
        } else {
          ASSERT_THAT(state, AnyOf(before, after)) << status.error().message;
          ASSERT_THAT(status.error().message, HasSubstr(run().string())) << "names the place";
        }
      }
    }
  }

  void put_back(const fs::path& kept) {
    fs::remove_all(run());
    if (fs::exists(kept)) fs::copy(kept, run(), fs::copy_options::recursive);
  }

  void make_run(std::uint64_t generations) {
    auto store = RunStore::create(run(), example_info());
    for (std::uint64_t g = 1; g <= generations; ++g) {
      ASSERT_TRUE(store->commit(example_generation(g)).ok());
    }
  }

  // As a master that dies with its store in hand would leave it: what the destructor tries while
  // the disk is gone fails as well.
  Status commit_next() {
    auto store = RunStore::open(run());
    if (!store) return store.error();
    const auto digest = store->commit(example_generation(3));
    return digest ? Status{} : digest.error();
  }
};

TEST_F(StoreFaults, ACommitIsAllOrNothing) {
  make_run(2);
  fail_everywhere([this] { return commit_next(); }, EIO);
}

TEST_F(StoreFaults, ACommitOnAFullDiskIsAllOrNothing) {
  make_run(2);
  fail_everywhere([this] { return commit_next(); }, ENOSPC);
}

TEST_F(StoreFaults, ARunIsCreatedOrNot) {
  fail_everywhere(
      [this] {
        const auto store = RunStore::create(run(), example_info());
        return store ? Status{} : store.error();
      },
      EIO);
}

TEST_F(StoreFaults, ARunThatCannotBeCreatedLeavesNoFolder) {
  IoFaults::watch(run().string());
  ASSERT_TRUE(RunStore::create(run(), example_info()).ok());
  const long calls = IoFaults::calls();
  fs::remove_all(run());
  IoFaults::fail(run().string(), calls / 2, false, ENOSPC);
  const auto store = RunStore::create(run(), example_info());
  IoFaults::rest();
  ASSERT_FALSE(store.ok());
  EXPECT_FALSE(fs::exists(run())) << store.error().message;
}

TEST_F(StoreFaults, GoingBackIsAllOrNothing) {
  make_run(4);
  fail_everywhere(
      [this]() -> Status {
        auto store = RunStore::open(run());
        if (!store) return store.error();
        const auto backup = store->truncate_after(2);
        return backup ? Status{} : backup.error();
      },
      EIO);
}

TEST_F(StoreFaults, AnOlderStoreIsUpgradedOrNot) {
  make_run(2);
  downgrade_to_schema_1();
  fail_everywhere(
      [this] {
        const auto store = RunStore::open(run());
        return store ? Status{} : store.error();
      },
      EIO);
}

TEST_F(StoreFaults, AFullDiskIsCalledThat) {
  make_run(2);
  IoFaults::watch(run().string());
  auto store = RunStore::open(run());
  ASSERT_TRUE(store.ok());
  const long opened = IoFaults::calls();
  ASSERT_GT(opened, 0);
  for (const long index : {0, 1, 5}) {  // no room for the journal's name, its bytes, the pages
    IoFaults::fail(run().string(), index, true, ENOSPC);
    const auto digest = store->commit(example_generation(3));
    IoFaults::rest();
    ASSERT_FALSE(digest.ok());
    EXPECT_THAT(digest.error().message, HasSubstr("free some disk space"));
  }
}

}  // namespace gapfarm::store_faults_test
