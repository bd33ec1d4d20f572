#include "common/trials/read.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include "common/trials/bbautotune.h"
#include "common/trials/columns.h"
#include "common/trials/csv.h"
#include "common/trials/files.h"
#include "common/trials/format.h"
#include "common/trials/trial_parser.h"

namespace gapfarm {
namespace {

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

// What lies beside a log and comes to its trials by (session, trial).
struct Companion {
  const char* file;
  bool required;
  Status (*parse)(std::string_view text, const std::string& file, TrialLog& log);
};
constexpr Companion kPathsBeside{"paths.csv", false, parse_paths};
constexpr Companion kTipsBeside{"tips.csv", true, parse_tips};

// The formats that are read as trials.
struct ReadableLog {
  TextFormat format;
  Result<TrialLog> (*parse)(std::string_view text, const std::string& file,
                            std::span<const std::string> commands);
  std::vector<Companion> beside;
};

Result<TrialLog> parse_run(std::string_view text, const std::string& file,
                           std::span<const std::string> commands) {
  return parse_bbautotune(text, file, session_of(file), commands);
}

const ReadableLog& readable_log(TextFormat format) {
  // The first is what another format is told to be.
  static const std::vector<ReadableLog> kLogs = {
      {TextFormat::kTrialLog, parse_trials, {kPathsBeside}},
      {TextFormat::kPushLog, parse_pushes, {kTipsBeside, kPathsBeside}},
      {TextFormat::kBbautotune, parse_run, {}},
  };
  for (const ReadableLog& log : kLogs) {
    if (log.format == format) return log;
  }
  return kLogs.front();
}

// Reads what lies beside each file, once a folder.
Status read_beside(const std::vector<std::pair<std::string, const ReadableLog*>>& files,
                   TrialLog& log) {
  std::set<std::filesystem::path> seen;
  for (const auto& [file, form] : files) {
    for (const Companion& companion : form->beside) {
      const std::filesystem::path beside =
          std::filesystem::path(file).parent_path() / companion.file;
      std::error_code code;
      if (!seen.insert(beside).second) continue;
      if (!std::filesystem::exists(beside, code)) {
        if (!companion.required) continue;
        return Error{file + ": found no " + companion.file + " beside it, expected one, since " +
                     format_name(form->format) + " is of no use without; put them together"};
      }
      auto text = read_text_file(beside.string());
      if (!text.ok()) return text.error();
      Status status = companion.parse(*text, beside.string(), log);
      if (!status.ok()) return status;
    }
  }
  return {};
}

// Rows (session, trial, t, ...) of a file beside a log, to the trials that they name.
template <class Sample>
struct SampleForm {
  TextFormat format;
  const char* expected;
  const char* rows_are;  // "path", for the note on rows without a trial
  const std::vector<std::string>& (*columns)();
  Sample (*read)(CsvRowReader& reader);
  std::vector<Sample> Trial::*member;
  bool times_repeat;  // whether two samples may have one time
};

template <class Sample>
Status parse_samples(const SampleForm<Sample>& form, std::string_view text, const std::string& file,
                     TrialLog& log) {
  const TextFormat format = sniff_format(text);
  if (format != form.format) return wrong_format(file, format, form.expected);
  auto rows = parse_csv(text, file);
  if (!rows.ok()) return rows.error();
  auto header = CsvHeader::match(rows->front(), form.columns(), file, form.expected);
  if (!header.ok()) return header.error();

  std::map<TrialKey, std::size_t> index;
  for (std::size_t i = 0; i < log.trials.size(); ++i) {
    index.emplace(TrialKey{log.trials[i].session, log.trials[i].trial}, i);
  }
  std::map<TrialKey, std::vector<Sample>> samples;
  std::size_t strangers = 0, first_stranger = 0;
  for (std::size_t i = 1; i < rows->size(); ++i) {
    const CsvRow& row = (*rows)[i];
    Status width = check_width(row, *header, file);
    if (!width.ok()) return width;
    CsvRowReader reader(row, *header, form.columns(), file);
    const TrialKey key{reader.word(kPathSession), reader.integer(kPathTrial)};
    Sample sample = form.read(reader);
    std::vector<Sample>& path = samples[key];
    const bool late = path.empty() || sample.t_s > path.back().t_s ||
                      (form.times_repeat && sample.t_s == path.back().t_s);
    if (!late) {
      reader.fail(kPathTime,
                  format_double(sample.t_s) + " after " + format_double(path.back().t_s) + " in " +
                      key_text(key),
                  form.times_repeat ? "times that do not decrease within a trial"
                                    : "times that increase within a trial",
                  "sort the rows by time");
    }
    if (reader.error()) return *reader.error();
    path.push_back(sample);
    if (index.count(key) == 0 && strangers++ == 0) first_stranger = row.fields[0].place.line;
  }
  for (const auto& [key, at] : index) {
    if (samples.count(key) != 0 && !(log.trials[at].*form.member).empty()) {
      return Error{file + ": found a " + form.rows_are + " of " + key_text(key) +
                   ", which has one from another file; remove one of them"};
    }
  }
  for (auto& [key, path] : samples) {
    const auto at = index.find(key);
    if (at != index.end()) log.trials[at->second].*form.member = std::move(path);
  }
  if (strangers > 0) {
    log.notes.push_back(file + ":" + std::to_string(first_stranger) + ":1: left out " +
                        std::to_string(strangers) + " " + form.rows_are +
                        " rows of trials that are not in the log");
  }
  return {};
}

double sample_time(CsvRowReader& reader) {
  return reader.number(kPathTime, -kLongestCommand_s, kLongestSession_s, "s");
}

PathSample read_path_sample(CsvRowReader& reader) {
  return {sample_time(reader),
          {reader.coordinate(kPathX), reader.coordinate(kPathY), reader.angle(kPathTheta)}};
}

TipSample read_tip_sample(CsvRowReader& reader) {
  const double t_s = sample_time(reader);
  return {t_s, reader.coordinate(kTipX), reader.coordinate(kTipY)};
}

}  // namespace

Result<TrialLog> parse_trials(std::string_view text, const std::string& file,
                              std::span<const std::string> commands) {
  return parse_log(kTrialLogForm, text, file, commands);
}

Result<TrialLog> parse_pushes(std::string_view text, const std::string& file,
                              std::span<const std::string> commands) {
  return parse_log(kPushLogForm, text, file, commands);
}

Status parse_paths(std::string_view text, const std::string& file, TrialLog& log) {
  const SampleForm<PathSample> form{TextFormat::kPaths,
                                    "the paths of a trial log (columns session,trial,t,x,y,theta)",
                                    "path",
                                    path_columns,
                                    read_path_sample,
                                    &Trial::path,
                                    true};
  return parse_samples(form, text, file, log);
}

Status parse_tips(std::string_view text, const std::string& file, TrialLog& log) {
  const SampleForm<TipSample> form{TextFormat::kTips,
                                   "the finger paths of a push log (columns session,trial,t,x,y)",
                                   "tip",
                                   tip_columns,
                                   read_tip_sample,
                                   &Trial::tip,
                                   false};
  return parse_samples(form, text, file, log);
}

Result<TrialLog> read_trials(const std::string& path, std::span<const std::string> commands) {
  auto text = read_text_file(path);
  if (!text.ok()) return text.error();
  const ReadableLog& form = readable_log(TextFormat::kTrialLog);
  auto log = form.parse(*text, path, commands);
  if (!log.ok()) return log;
  Status status = read_beside({{path, &form}}, *log);
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
  std::vector<std::pair<std::string, const ReadableLog*>> files;
  bool split = false;
  for (const std::string& path : paths) {
    auto text = read_text_file(path);
    if (!text.ok()) return text.error();
    const ReadableLog& form = readable_log(sniff_format(*text));
    auto part = form.parse(*text, path, commands);
    if (!part.ok()) return part;
    files.emplace_back(path, &form);
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
  Status status = read_beside(files, log);
  if (!status.ok()) return status.error();
  return log;
}

}  // namespace gapfarm
