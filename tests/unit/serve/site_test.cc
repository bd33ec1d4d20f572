// What a site answers of real stores, by a clock of the test's own.
#include "master/serve/site.h"

#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "master/store/answer_store.h"
#include "master/store/records.h"
#include "tests/unit/store/store_fixture.h"

namespace gapfarm::site_test {

using testing::HasSubstr;
using testing::Not;

class SiteTest : public StoreTest {
 protected:
  SiteTest() : site_(sources()) {}

  SiteSources sources() {
    SiteSources sources;
    sources.folders = {folder_};
    sources.unix_now_s = [this] { return now_s_; };
    sources.cpu_now_s = [this] { return cpu_s_; };
    sources.read_run = [this](const RunQuestion& question) -> Result<RunReport> {
      ++made_;
      cpu_s_ += cost_s_;
      if (!trouble_.empty()) return Error{trouble_};
      RunReport report;
      report.headline = "made " + std::to_string(made_);
      report.name = question.run.string();
      return report;
    };
    sources.drive = [](const DriveQuestion&) -> Result<std::string> { return Error{"none"}; };
    return sources;
  }
  RunStore make(const std::string& name, std::uint64_t seed = 1) const {
    RunInfo info = example_info();
    info.seed = seed;
    auto store = RunStore::create(folder_ / name, info);
    EXPECT_TRUE(store.ok()) << store.error().message;
    EXPECT_TRUE(store->commit(example_generation(1)).ok());
    return *std::move(store);
  }
  HttpResponse get(const std::string& target, const std::string& known = "") {
    return site_.answer({"GET", target, "localhost", known});
  }
  std::string view(const std::string& name) const {
    return "/view?of=" + percent_encoded((folder_ / name).string());
  }
  // Long enough for anything that was made to be old.
  void wait() { now_s_ += 1e6; }

  double now_s_ = 1e9, cpu_s_ = 0, cost_s_ = 0;
  int made_ = 0;
  std::string trouble_;  // of reading a run
  Site site_;
};

TEST_F(SiteTest, ListsFiltersAndSorts) {
  const RunStore first = make("alpha", 70001), second = make("beta", 30003);
  const std::string all = get("/").body;
  EXPECT_THAT(all, HasSubstr("2 here, 2 running"));
  EXPECT_THAT(all, HasSubstr("configs/srv1.toml"));
  const std::string filtered = get("/?q=ALPH").body;
  EXPECT_THAT(filtered, HasSubstr("1 shown"));
  EXPECT_THAT(filtered, HasSubstr("/alpha</a>"));
  EXPECT_THAT(filtered, Not(HasSubstr("/beta</a>")));
  EXPECT_THAT(get("/?q=seed+30003").body, Not(HasSubstr("/alpha</a>")));
  EXPECT_THAT(get("/?state=finished").body, HasSubstr("0 shown"));
  // What is chosen stays while it is sorted.
  EXPECT_THAT(get("/?q=a&state=running").body, HasSubstr("?sort=seed&amp;q=a&amp;state=running"));
  const std::string sorted = get("/?sort=seed").body;
  EXPECT_LT(sorted.find("/beta</a>"), sorted.find("/alpha</a>"));
  EXPECT_THAT(get("/?q=%3Cb%3Ex").body, Not(HasSubstr("<b>x")));
}

TEST_F(SiteTest, ReportsThatNothingChangedUntilItDoes) {
  RunStore store = make("run");
  const HttpResponse first = get(view("run"));
  EXPECT_EQ(first.status, 200u);
  EXPECT_EQ(get(view("run"), first.etag).status, 304u);
  ASSERT_TRUE(store.commit(example_generation(2)).ok());
  const HttpResponse second = get(view("run"), first.etag);
  EXPECT_EQ(second.status, 200u);
  EXPECT_THAT(second.body, HasSubstr("made 2"));
}

TEST_F(SiteTest, WhatTookLongIsGoodForLong) {
  RunStore store = make("run");
  cost_s_ = 0.5;
  const HttpResponse first = get(view("run"));
  ASSERT_TRUE(store.commit(example_generation(2)).ok());
  now_s_ += 40;
  EXPECT_EQ(get(view("run"), first.etag).status, 304u) << "half a second is good for fifty";
  now_s_ += 20;
  EXPECT_THAT(get(view("run"), first.etag).body, HasSubstr("made 2"));
  // That a run has ended is sent at once.
  Progress end;
  end.state = RunState::kFinished;
  ASSERT_TRUE(store.set_progress(end).ok());
  now_s_ += 6;  // the list looks after its state
  EXPECT_THAT(get(view("run"), first.etag).body, HasSubstr("made 3"));
}

TEST_F(SiteTest, EventsReportWhatThePageStandsAt) {
  RunStore store = make("run");
  const std::string of = percent_encoded((folder_ / "run").string());
  const HttpResponse stream = get("/events?at=/view&of=" + of);
  ASSERT_TRUE(stream.watched);
  const HttpResponse page = get(view("run"));
  EXPECT_EQ("\"" + stream.watched() + "\"", page.etag);
  ASSERT_TRUE(store.commit(example_generation(2)).ok());
  wait();
  const std::string after = stream.watched();
  EXPECT_NE("\"" + after + "\"", page.etag);
  EXPECT_EQ(get(view("run")).etag, "\"" + after + "\"");
  EXPECT_EQ(get("/events?at=/metrics").status, 404u);
  EXPECT_EQ(get("/events?at=/view&of=nothing").status, 404u);
  EXPECT_TRUE(get("/events?at=/").watched);
}

// The folders are searched less often than those that were found are looked at: a short diagnosis
// ends while it is still taken for any command.
TEST_F(SiteTest, WhatAFolderIsTakenForCountsToo) {
  std::ofstream(folder_ / "diagnosis.json") << R"({"headline": "One motor is slower."})";
  double now_s = 1e9;
  WorkEntries entries([&] { return now_s; }, [] { return 0.0; });
  FoundWork found{FoundWork::Kind::kCommand, "d", folder_};
  const std::string as_command = entries.now({found}).front().stamp;
  found.kind = FoundWork::Kind::kDiagnosis;
  now_s += 1e6;
  const WorkEntry as_diagnosis = entries.now({found}).front();
  EXPECT_EQ(as_diagnosis.status_text, "One motor is slower.");
  EXPECT_NE(as_diagnosis.stamp, as_command);
}

TEST_F(SiteTest, ADiagnosisAtWorkReportsWhatItHasFound) {
  const std::filesystem::path d = folder_ / "d";
  std::filesystem::create_directories(d);
  auto answers = AnswerStore::open(answer_file(d), "build");
  ASSERT_TRUE(answers.ok()) << answers.error().message;
  CommandRecord record;
  record.command = "diagnose";
  record.state = RunState::kStopped;
  record.stage = "screen";
  record.number = 2, record.stages = 3;
  record.plan = {{"tune", 1e9 - 40}, {"screen", 1e9 - 30}, {"refit", 0}};
  record.heartbeat_unix_s = 1e9 - 5;
  record.findings = {
      {"tune", {"the noise", "1.5 nats a trial <b>", {"noise", "size"}, {{"k", "2 mm"}}}}};
  ASSERT_TRUE(answers->set_command(to_json(record).dump()).ok());
  const std::string page = get(view("d")).body;
  EXPECT_THAT(page, HasSubstr("tune <small>done in 10 s"));
  EXPECT_THAT(page, HasSubstr("screen <small>stopped after 25 s"));
  EXPECT_THAT(page, HasSubstr("refit <small>not reached"));
  EXPECT_THAT(page,
              HasSubstr(R"(1.5 <a class="term" href="#term-nat">nats a trial</a> &lt;b&gt;)"));
  EXPECT_THAT(page, HasSubstr(R"(<th scope="row">k</th>)"));
  // What is found next is new.
  const std::string known = get(view("d")).etag;
  record.findings.push_back({"screen", {"the catalogue", "A seam.", {}, {}}});
  ASSERT_TRUE(answers->set_command(to_json(record).dump()).ok());
  wait();
  EXPECT_THAT(get(view("d"), known).body, HasSubstr("A seam."));
}

TEST_F(SiteTest, ReportsWhatCannotBeRead) {
  const RunStore sound = make("sound");
  make("foreign");
  make("damaged");
  { std::ofstream(folder_ / "foreign/run.sqlite", std::ios::binary) << std::string(9000, 'x'); }
  {
    std::fstream file(folder_ / "damaged/run.sqlite",
                      std::ios::binary | std::ios::in | std::ios::out);
    file.seekp(4096);
    file << std::string(40000, 'x');
  }
  make("held");
  auto holder = Database::open(folder_ / "held/run.sqlite", Database::Mode::kWrite);
  ASSERT_TRUE(holder.ok());
  ASSERT_TRUE(holder->exec("BEGIN EXCLUSIVE", "hold").ok());
  set_database_patience_ms(20);
  const std::string list = get("/").body;
  EXPECT_THAT(list, HasSubstr("/sound</a>"));
  EXPECT_THAT(list, HasSubstr("not a SQLite file"));
  EXPECT_THAT(list, HasSubstr("restore a copy"));
  EXPECT_THAT(list, HasSubstr("another program holds the file"));
  ASSERT_TRUE(holder->exec("COMMIT", "hold").ok());
  wait();
  EXPECT_THAT(get("/").body, testing::Not(HasSubstr("another program holds the file")));
  set_database_patience_ms(60000);
}

TEST_F(SiteTest, APageThatCannotBeMadeReportsWhyAndLooksAgain) {
  const RunStore store = make("run");
  trouble_ = "run.sqlite: another program holds the file <b>";
  const HttpResponse page = get(view("run"));
  EXPECT_EQ(page.status, 503u);
  EXPECT_THAT(page.body, HasSubstr("another program holds the file &lt;b&gt;"));
  EXPECT_THAT(page.body, HasSubstr(R"(<a href="/">)"));
  trouble_.clear();
  EXPECT_EQ(get(view("run"), page.etag).status, 200u);
}

TEST_F(SiteTest, FindsNothingOutsideOfItsFolders) {
  const RunStore store = make("run");
  for (const char* name : {"/etc", "..", "run/../run", ""}) {
    EXPECT_EQ(get("/view?of=" + percent_encoded(name)).status, 404u) << name;
    EXPECT_EQ(get("/compare?of=" + percent_encoded(name)).status, 404u) << name;
  }
}

TEST_F(SiteTest, FiguresHaveLabels) {
  RunStore store = make("ru\"n");
  Progress progress;
  progress.workers = {{"w", "h", "busy", 1, 2, 3}};
  progress.farm.retries = 5;
  ASSERT_TRUE(store.set_progress(progress).ok());
  const std::string text = get("/metrics").body;
  const std::string label = "{of=\"" + folder_.string() + "/ru\\\"n\"";
  EXPECT_THAT(text, HasSubstr("# TYPE gapfarm_retries_total counter\n"));
  EXPECT_THAT(text, HasSubstr("gapfarm_retries_total" + label + "} 5\n"));
  EXPECT_THAT(text, HasSubstr("gapfarm_generation" + label + "} 1\n"));
  EXPECT_THAT(text, HasSubstr("gapfarm_workers" + label + ",state=\"busy\"} 1\n"));
}

TEST(ListPage, DrawsABestThatRoseOnceAndStayed) {
  WorkEntry entry;
  entry.best_by_generation.assign(11, 5);
  entry.best_by_generation.front() = 0;
  const std::string page = list_page({entry}, {}, {});
  EXPECT_THAT(page, HasSubstr("M0 18.4L10 2.0"));
  EXPECT_THAT(page, Not(HasSubstr(" nan")));
}

TEST(ListPage, KnowsWhichFitnessIsBetter) {
  WorkEntry bad, good;
  for (WorkEntry* entry : {&bad, &good}) {
    entry->higher_is_better = false;
    entry->fitness = "rmse";
  }
  bad.name = "bad";
  bad.best = 2;
  good.name = "good";
  good.best = 1;
  // The worst tenth is the first, and the last of the improvements shows.
  good.best_by_generation = {100, 9, 8, 7, 6, 5, 4, 3, 2, 1};
  const std::string page = list_page({bad, good}, {"best", "", ""}, {});
  EXPECT_LT(page.find(">good</a>"), page.find(">bad</a>"));
  EXPECT_THAT(page, HasSubstr("M0 2.0L11 2.0L22 4.0"));
  EXPECT_THAT(page, HasSubstr("L100 18.4"));
}

}  // namespace gapfarm::site_test
