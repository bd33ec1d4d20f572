#include "master/run/run_farm_history.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <ctime>
#include <fstream>
#include <iterator>
#include <map>
#include <utility>

#include "common/base/try.h"
#include "common/progress/number_text.h"
#include "master/store/run_lock.h"
#include "master/store/run_status.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMostIncidents = 50;
constexpr std::size_t kMostFailures = 30;
constexpr std::size_t kMostGivenUp = 30;
constexpr std::size_t kMostLogLines = 20;
constexpr std::streamoff kLogTail = 8192;
constexpr std::size_t kMostEvents = 20000;  // that are read
constexpr std::size_t kMostCounts = 2000;
constexpr std::size_t kMostMarks = 300;
constexpr std::size_t kMostSpans = 40;
constexpr std::size_t kMostRows = 200;  // in the table

// Every count of a farm, for people.
constexpr std::pair<std::uint64_t FarmTally::*, const char*> kTallyLabels[] = {
    {&FarmTally::retries, "retries: jobs given out again"},
    {&FarmTally::copies, "copies: jobs given to a second worker, the first took long"},
    {&FarmTally::compared, "audits and copies: answers held against another worker's"},
    {&FarmTally::alarms, "alarms: those of them that differed"},
    {&FarmTally::hung, "workers killed because their simulation stood still"},
    {&FarmTally::handed_over, "answers that workers kept from one master to the next"},
    {&FarmTally::late, "late: answers to jobs that had one"},
    {&FarmTally::foreign, "foreign: answers to nothing that was asked"},
    {&FarmTally::malformed, "malformed: messages that made no sense"},
    {&FarmTally::links, "TCP connections"},
    {&FarmTally::refused_keys, "of them refused: keys that are not listed"},
    {&FarmTally::failed_handshakes, "of them failed: handshakes"},
    {&FarmTally::dropped_links, "of them closed by the limits"}};
static_assert(std::size(kTallyLabels) == std::tuple_size_v<decltype(FarmTally::kRows)>);

std::vector<std::string> log_tail(const std::filesystem::path& run) {
  std::ifstream file(run / "log.txt", std::ios::binary | std::ios::ate);
  if (!file) return {};
  const std::streamoff size = file.tellg();
  const std::streamoff from = std::max<std::streamoff>(0, size - kLogTail);
  file.seekg(from);
  std::vector<std::string> lines;
  std::string line;
  if (from > 0) std::getline(file, line);  // a part of one
  while (std::getline(file, line)) lines.push_back(line);
  if (lines.size() > kMostLogLines) {
    lines.erase(lines.begin(), lines.end() - static_cast<std::ptrdiff_t>(kMostLogLines));
  }
  return lines;
}

std::string day_and_time(double unix_s) {
  const auto seconds = static_cast<std::time_t>(unix_s);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  return fmt::format("{:02}-{:02} {:02}:{:02} UTC", utc.tm_mon + 1, utc.tm_mday, utc.tm_hour,
                     utc.tm_min);
}

void add_facts(const RunStatus& status, RunFarm* farm) {
  const auto add = [&](const std::string& label, const std::string& value) {
    farm->facts.emplace_back(label, value);
  };
  const Progress& progress = status.progress;
  add("evaluations", std::to_string(status.evaluations));
  if (status.state == RunState::kRunning) {
    add("rate", fmt::format("{:.3g} evaluations/s", status.rate_per_s));
    add("tasks of this generation", fmt::format("{} of {}", progress.done, progress.total));
    if (status.time_left_s) add("time left", "about " + format_duration(*status.time_left_s));
  }
  add("last heard of", day_and_time(progress.heartbeat_unix_s) + " on " + progress.host);
  if (progress.epoch > 1) add("masters so far", std::to_string(progress.epoch));
  if (status.quarantined > 0) add("tasks given up", std::to_string(status.quarantined));
  for (const auto& [count, tally_label] : kTallyLabels) {
    farm->tally.emplace_back(tally_label, std::to_string(progress.farm.*count));
  }
}

bool is_failure(const StoredWorkerEvent& event) {
  return event.kind == "died" || event.kind == "silent" || event.kind == "refused";
}

std::string sentence_of(const StoredWorkerEvent& event) {
  return day_and_time(event.unix_s) + ": " + (event.worker.empty() ? "" : event.worker + " ") +
         (event.host.empty() ? "" : "(" + event.host + ") ") + event.text;
}

// Whoever came and has not gone yet.
class Present {
 public:
  explicit Present(RunTimeline* timeline) : timeline_(timeline) {}

  void take(const StoredWorkerEvent& event) {
    if (event.kind == "master" || event.kind == "end") return leave_all(event);
    if (event.kind == "joined" || event.kind == "returned") {
      if (there_.contains(event.worker)) return;
      there_[event.worker] = timeline_->spans.size();
      timeline_->spans.push_back({event.worker, event.host, event.unix_s, event.unix_s, ""});
      return count(event, "joined");
    }
    const auto one = there_.find(event.worker);
    if (one != there_.end()) {
      leave(one->second, event.unix_s, is_failure(event) ? event.text : "");
      there_.erase(one);
    }
    count(event, is_failure(event) ? "failed" : "left");
  }
  void end_at(double unix_s) {
    for (const auto& [name, span] : there_) leave(span, unix_s, "");
  }
  std::size_t size() const { return there_.size(); }

 private:
  void leave(std::size_t span, double unix_s, const std::string& how) {
    timeline_->spans[span].to_unix_s = unix_s;
    timeline_->spans[span].end = how;
  }
  // With a master its workers go, or stay away from the next until they join it.
  void leave_all(const StoredWorkerEvent& event) {
    end_at(event.unix_s);
    there_.clear();
    count(event, "master");
  }
  void count(const StoredWorkerEvent& event, const char* kind) {
    const auto workers = static_cast<unsigned>(there_.size());
    timeline_->counts.push_back({event.unix_s, workers});
    timeline_->marks.push_back({event.unix_s, workers, kind, sentence_of(event)});
  }

  RunTimeline* timeline_;
  std::map<std::string, std::size_t> there_;  // place among the spans
};

Status add_workers(const RunReader& reader, bool running, RunFarm* farm) {
  ASSIGN_OR_RETURN(const auto progress, reader.progress());
  ASSIGN_OR_RETURN(const auto events, reader.worker_events(kMostEvents));
  std::map<std::string, std::string> failures;  // the last of each
  for (const StoredWorkerEvent& event : events) {
    if (!is_failure(event)) continue;
    failures[event.worker] = day_and_time(event.unix_s) + ": " + event.text;
  }
  for (auto it = events.rbegin(); it != events.rend(); ++it) {
    if (farm->failures.size() == kMostFailures) break;
    if (is_failure(*it)) farm->failures.push_back(sentence_of(*it));
  }
  for (const StoredWorker& w : progress.workers) {
    if (farm->workers.size() == kMostRows) break;
    const auto failure = failures.find(w.name);
    // Whoever is not watched any more is neither busy nor idle.
    farm->workers.push_back(
        {w.name, w.host, running || w.state == "gone" ? w.state : "was " + w.state, w.jobs,
         w.finished, w.rate_per_s, failure == failures.end() ? "" : failure->second});
  }
  farm->timeline = timeline_of(events, progress.heartbeat_unix_s, running);
  return {};
}

}  // namespace

RunTimeline timeline_of(const std::vector<StoredWorkerEvent>& events, double heartbeat_unix_s,
                        bool alive) {
  RunTimeline timeline;
  if (events.empty()) return timeline;
  Present present(&timeline);
  for (const StoredWorkerEvent& event : events) present.take(event);
  timeline.end_unix_s = std::max(heartbeat_unix_s, events.back().unix_s);
  present.end_at(timeline.end_unix_s);
  const unsigned left = alive ? static_cast<unsigned>(present.size()) : 0;
  timeline.counts.push_back({timeline.end_unix_s, left});
  timeline.counts = decimated(timeline.counts, kMostCounts, [](const RunTimeline::Count& count) {
    return static_cast<double>(count.workers);
  });
  if (timeline.marks.size() > kMostMarks) {
    timeline.marks.erase(timeline.marks.begin(),
                         timeline.marks.end() - static_cast<std::ptrdiff_t>(kMostMarks));
  }
  if (timeline.spans.size() > kMostSpans) timeline.spans.clear();
  return timeline;
}

Status add_farm(const RunReader& reader, RunReport* report) {
  ASSIGN_OR_RETURN(const auto status, run_status(reader, unix_now_s()));
  RunFarm& farm = report->farm;
  farm.state = run_state_name(status.state);
  const bool running = status.state == RunState::kRunning;
  farm.message = running ? status.progress.waiting : status.stop_reason;
  add_facts(status, &farm);
  RETURN_IF_ERROR(add_workers(reader, running, &farm));
  for (auto it = status.incidents.rbegin(); it != status.incidents.rend(); ++it) {
    if (farm.incidents.size() == kMostIncidents) break;
    farm.incidents.push_back(fmt::format("{}, generation {}, {}: {}", day_and_time(it->unix_s),
                                         it->generation, incident_name(it->kind), it->text));
  }
  ASSIGN_OR_RETURN(const auto lost, reader.given_up(kMostGivenUp));
  for (const RunReader::Member& member : lost) {
    const StoredIndividual& one = member.individual;
    farm.given_up.push_back({one.birth_id,
                             member.generation,
                             one.fitness,
                             one.outcome,
                             one.operators,
                             one.parents,
                             {}});
  }
  farm.log = log_tail(reader.run());
  return {};
}

}  // namespace gapfarm
