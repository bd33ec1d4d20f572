#include "common/trials/read.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include "common/base/suggest.h"
#include "common/trials/bbautotune.h"
#include "common/trials/columns.h"
#include "common/trials/csv.h"
#include "common/trials/files.h"
#include "common/trials/format.h"

namespace gapfarm {
namespace {

// A session is a battery charge and a command is atomic: greater numbers are milliseconds.
constexpr double kLongestSession_s = 1e6;
constexpr double kLongestCommand_s = 60;

using TrialKey = std::pair<std::string, std::int64_t>;

std::string key_text(const TrialKey& key) {
  return "trial " + std::to_string(key.second) + " of session " + quoted_word(key.first);
}

// Where the last row of each session left off, for the order within it.
struct SessionState {
  std::int64_t trial = 0;
  std::optional<double> t_s;
};

class TrialParser {
 public:
  TrialParser(const std::string& file, std::span<const std::string> commands)
      : file_(file), commands_(commands) {}

  Result<TrialLog> parse(std::string_view text) {
    auto rows = parse_csv(text, file_);
    if (!rows.ok()) return rows.error();
    auto header = CsvHeader::match(rows->front(), trial_columns(), file_, "a trial log");
    if (!header.ok()) return header.error();
    TrialLog log;
    for (const std::size_t i : header->extra()) {
      log.extra_columns.push_back(rows->front().fields[i].text);
    }
    for (std::size_t i = 1; i < rows->size(); ++i) {
      auto trial = parse_row((*rows)[i], *header);
      if (!trial.ok()) return trial.error();
      log.trials.push_back(std::move(*trial));
    }
    if (log.trials.empty()) {
      return text_error(file_, rows->front().end, "a header without trials",
                        "one row a trial below it", "check that the log was written");
    }
    return log;
  }

 private:
  Result<Trial> parse_row(const CsvRow& row, const CsvHeader& header) {
    Status width = check_width(row, header, file_);
    if (!width.ok()) return width.error();
    CsvRowReader reader(row, header, trial_columns(), file_);
    Trial trial;
    trial.session = reader.word(kSession);
    trial.trial = reader.integer(kTrial);
    trial.t_s = reader.optional_number(kTime, 0, kLongestSession_s, "s");
    trial.command = reader.word(kCommand);
    if (std::find(commands_.begin(), commands_.end(), trial.command) == commands_.end()) {
      reader.fail(kCommand, quoted_word(trial.command), "a command of the scenario",
                  "write one of those it knows" + suggestion(trial.command, commands_));
    }
    trial.left = reader.optional_number(kLeft, -1, 1, "(duty)");
    trial.right = reader.optional_number(kRight, -1, 1, "(duty)");
    trial.duration_s = reader.optional_number(kDuration, 0, kLongestCommand_s, "s");
    trial.X_WS = {reader.coordinate(kX0), reader.coordinate(kY0), reader.angle(kTheta0)};
    trial.X_WE = {reader.coordinate(kX1), reader.coordinate(kY1), reader.angle(kTheta1)};
    for (const std::size_t i : header.extra()) trial.extra.push_back(row.fields[i].text);
    check_order(trial, reader);
    if (reader.error()) return *reader.error();
    return trial;
  }

  void check_order(const Trial& trial, CsvRowReader& reader) {
    const TrialKey key{trial.session, trial.trial};
    const auto [seen, is_new] = lines_.emplace(key, reader.field(kTrial).place.line);
    if (!is_new) {
      reader.fail(kTrial,
                  std::to_string(trial.trial) + " of session " + quoted_word(trial.session) +
                      " again, first in line " + std::to_string(seen->second),
                  "each (session, trial) once", "number the trials of a session 0, 1, 2, ...");
    }
    const auto [at, first] = sessions_.emplace(trial.session, SessionState{trial.trial, trial.t_s});
    if (first) return;
    SessionState& last = at->second;
    if (trial.trial < last.trial) {
      reader.fail(kTrial, std::to_string(trial.trial) + " after " + std::to_string(last.trial),
                  "numbers that increase within a session", "sort the rows in driving order");
    }
    if (trial.t_s && last.t_s && *trial.t_s < *last.t_s) {
      reader.fail(kTime, format_double(*trial.t_s) + " after " + format_double(*last.t_s),
                  "times that do not decrease within a session",
                  "sort the rows in driving order, or leave unknown times empty");
    }
    last.trial = trial.trial;
    if (trial.t_s) last.t_s = trial.t_s;
  }

  const std::string& file_;
  std::span<const std::string> commands_;
  std::map<TrialKey, std::size_t> lines_;
  std::map<std::string, SessionState> sessions_;
};

std::string session_of(const std::string& path) {
  return std::filesystem::path(path).stem().string();
}

// Puts `part` behind `log`.  Columns that only one of them has stay empty in the other's trials.
void append(TrialLog part, TrialLog& log) {
  std::vector<std::size_t> to(part.extra_columns.size());
  for (std::size_t i = 0; i < to.size(); ++i) {
    auto& columns = log.extra_columns;
    to[i] = static_cast<std::size_t>(
        std::find(columns.begin(), columns.end(), part.extra_columns[i]) - columns.begin());
    if (to[i] == columns.size()) columns.push_back(part.extra_columns[i]);
  }
  for (Trial& trial : log.trials) trial.extra.resize(log.extra_columns.size());
  for (Trial& trial : part.trials) {
    std::vector<std::string> extra(log.extra_columns.size());
    for (std::size_t i = 0; i < to.size(); ++i) extra[to[i]] = std::move(trial.extra[i]);
    trial.extra = std::move(extra);
    log.trials.push_back(std::move(trial));
  }
  log.notes.insert(log.notes.end(), part.notes.begin(), part.notes.end());
}

// A session's trials side by side and in order, sessions by first appearance.
void join_sessions(TrialLog& log) {
  std::map<std::string, std::size_t> rank;
  for (const Trial& trial : log.trials) rank.emplace(trial.session, rank.size());
  std::stable_sort(log.trials.begin(), log.trials.end(), [&](const Trial& a, const Trial& b) {
    return std::make_pair(rank.at(a.session), a.trial) <
           std::make_pair(rank.at(b.session), b.trial);
  });
}

// Reads the paths.csv beside each of `trial_files`, once a folder.
Status read_paths_beside(const std::vector<std::string>& trial_files, TrialLog& log) {
  std::set<std::filesystem::path> seen;
  for (const std::string& file : trial_files) {
    const std::filesystem::path beside = std::filesystem::path(file).parent_path() / "paths.csv";
    std::error_code code;
    if (!seen.insert(beside).second || !std::filesystem::exists(beside, code)) continue;
    auto text = read_text_file(beside.string());
    if (!text.ok()) return text.error();
    Status status = parse_paths(*text, beside.string(), log);
    if (!status.ok()) return status;
  }
  return {};
}

}  // namespace

Result<TrialLog> parse_trials(std::string_view text, const std::string& file,
                              std::span<const std::string> commands) {
  const TextFormat format = sniff_format(text);
  if (format != TextFormat::kTrialLog) return wrong_format(file, format, "a trial log");
  return TrialParser(file, commands).parse(text);
}

Status parse_paths(std::string_view text, const std::string& file, TrialLog& log) {
  const TextFormat format = sniff_format(text);
  if (format != TextFormat::kPaths) {
    return wrong_format(file, format,
                        "the paths of a trial log (columns session,trial,t,x,y,theta)");
  }
  auto rows = parse_csv(text, file);
  if (!rows.ok()) return rows.error();
  auto header = CsvHeader::match(rows->front(), path_columns(), file, "a path log");
  if (!header.ok()) return header.error();

  std::map<TrialKey, std::size_t> index;
  for (std::size_t i = 0; i < log.trials.size(); ++i) {
    index.emplace(TrialKey{log.trials[i].session, log.trials[i].trial}, i);
  }
  std::map<TrialKey, std::vector<PathSample>> paths;
  std::size_t strangers = 0, first_stranger = 0;
  for (std::size_t i = 1; i < rows->size(); ++i) {
    const CsvRow& row = (*rows)[i];
    Status width = check_width(row, *header, file);
    if (!width.ok()) return width;
    CsvRowReader reader(row, *header, path_columns(), file);
    const TrialKey key{reader.word(kPathSession), reader.integer(kPathTrial)};
    PathSample sample;
    sample.t_s = reader.number(kPathTime, -kLongestCommand_s, kLongestSession_s, "s");
    sample.pose = {reader.coordinate(kPathX), reader.coordinate(kPathY), reader.angle(kPathTheta)};
    std::vector<PathSample>& path = paths[key];
    if (!path.empty() && sample.t_s < path.back().t_s) {
      reader.fail(kPathTime,
                  format_double(sample.t_s) + " after " + format_double(path.back().t_s) + " in " +
                      key_text(key),
                  "times that do not decrease within a trial", "sort the rows by time");
    }
    if (reader.error()) return *reader.error();
    path.push_back(sample);
    if (index.count(key) == 0 && strangers++ == 0) first_stranger = row.fields[0].place.line;
  }
  for (const auto& [key, at] : index) {
    if (paths.count(key) != 0 && !log.trials[at].path.empty()) {
      return Error{file + ": found a path of " + key_text(key) +
                   ", which has one from another file; remove one of them"};
    }
  }
  for (auto& [key, path] : paths) {
    const auto at = index.find(key);
    if (at != index.end()) log.trials[at->second].path = std::move(path);
  }
  if (strangers > 0) {
    log.notes.push_back(file + ":" + std::to_string(first_stranger) + ":1: left out " +
                        std::to_string(strangers) + " path rows of trials that are not in the log");
  }
  return {};
}

Result<TrialLog> read_trials(const std::string& path, std::span<const std::string> commands) {
  auto text = read_text_file(path);
  if (!text.ok()) return text.error();
  auto log = parse_trials(*text, path, commands);
  if (!log.ok()) return log;
  Status status = read_paths_beside({path}, *log);
  if (!status.ok()) return status.error();
  return log;
}

Result<TrialLog> read_trial_files(std::span<const std::string> paths,
                                  std::span<const std::string> commands) {
  if (paths.empty()) {
    return Error{"no trial files; name some with --trials or as 'trials' in the config"};
  }
  TrialLog log;
  std::map<TrialKey, std::string> file_of;
  std::map<std::string, std::string> session_file;
  std::vector<std::string> with_paths;
  bool split = false;
  for (const std::string& path : paths) {
    auto text = read_text_file(path);
    if (!text.ok()) return text.error();
    const TextFormat format = sniff_format(*text);
    const bool foreign = format == TextFormat::kBbautotune;
    auto part = foreign ? parse_bbautotune(*text, path, session_of(path), commands)
                        : parse_trials(*text, path, commands);
    if (!part.ok()) return part;
    if (!foreign) with_paths.push_back(path);
    for (const Trial& trial : part->trials) {
      const TrialKey key{trial.session, trial.trial};
      const auto [at, is_new] = file_of.emplace(key, path);
      if (!is_new) {
        return Error{path + ": found " + key_text(key) + " again, first in " + at->second +
                     ", expected each (session, trial) once; name a file once, and give "
                     "different runs different session names"};
      }
      const auto [owner, first] = session_file.emplace(trial.session, path);
      split = split || (!first && owner->second != path);
    }
    append(std::move(*part), log);
  }
  if (split) join_sessions(log);
  Status status = read_paths_beside(with_paths, log);
  if (!status.ok()) return status.error();
  return log;
}

}  // namespace gapfarm
