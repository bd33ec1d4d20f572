#include "common/trials/text/trial_parser.h"

#include <algorithm>

#include "common/base/text.h"

namespace gapfarm {
namespace {

// Where the last row of each session left off, for the order within it.
struct SessionState {
  std::int64_t trial = 0;
  std::optional<double> t_s;
};

class TrialParser {
 public:
  TrialParser(const LogForm& form, const std::string& file, std::span<const std::string> commands)
      : form_(form), columns_(*form.columns), file_(file), commands_(commands) {}

  TrialLog parse(std::string_view text, Mistakes& mistakes) {
    TrialLog log;
    auto rows = parse_csv(text, file_);
    if (!rows.ok()) return mistakes.add_file(rows.error()), log;
    auto header = CsvHeader::match(rows->front(), columns_, file_, format_name(form_.format));
    if (!header.ok()) return mistakes.add_file(header.error()), log;
    for (const std::size_t i : header->extra()) {
      log.extra_columns.push_back(rows->front().fields[i].text);
    }
    for (std::size_t i = 1; i < rows->size(); ++i) {
      std::vector<Error> errors;
      Trial trial = parse_row((*rows)[i], *header, errors);
      if (errors.empty()) log.trials.push_back(std::move(trial));
      mistakes.add_row(errors);
    }
    if (rows->size() == 1) {
      mistakes.add_file(text_error(file_, rows->front().end, "a header without trials",
                                   "one row a trial below it", "check that the log was written"));
    } else if (log.trials.empty()) {
      mistakes.add_no_row(file_);
    }
    return log;
  }

 private:
  Trial parse_row(const CsvRow& row, const CsvHeader& header, std::vector<Error>& errors) {
    Trial trial;
    trial.line = row.fields.front().place.line;
    if (Status width = check_width(row, header, file_); !width.ok()) {
      errors.push_back(width.error());
      return trial;
    }
    CsvRowReader reader(row, header, columns_, file_);
    trial.session = reader.word(kSession);
    trial.trial = reader.integer(kTrial);
    if (form_.time) trial.t_s = reader.optional_number(*form_.time, 0, kLongestSession_s, "s");
    trial.command = reader.word(form_.command);
    if (std::find(commands_.begin(), commands_.end(), trial.command) == commands_.end()) {
      reader.fail(form_.command, quoted_word(trial.command), form_.command_is,
                  form_.command_remedy + suggestion(trial.command, commands_));
    }
    if (form_.drive) {
      trial.left = reader.optional_number(*form_.drive, -1, 1, "(duty)");
      trial.right = reader.optional_number(*form_.drive + 1, -1, 1, "(duty)");
      trial.duration_s = reader.optional_number(*form_.drive + 2, 0, kLongestCommand_s, "s");
    }
    const std::size_t p = form_.pose;
    trial.X_WS = {reader.coordinate(p), reader.coordinate(p + 1), reader.angle(p + 2)};
    trial.X_WE = {reader.coordinate(p + 3), reader.coordinate(p + 4), reader.angle(p + 5)};
    for (const std::size_t i : header.extra()) trial.extra.push_back(row.fields[i].text);
    // A row with mistakes says nothing of where the next ones stand.
    if (reader.errors().empty()) check_order(trial, reader);
    errors = reader.errors();
    return trial;
  }

  void check_order(const Trial& trial, CsvRowReader& reader) {
    const TrialKey key{trial.session, trial.trial};
    const auto seen = lines_.find(key);
    if (seen != lines_.end()) {
      reader.fail(kTrial,
                  std::to_string(trial.trial) + " of session " + quoted_word(trial.session) +
                      " again, first in line " + std::to_string(seen->second),
                  "each (session, trial) once", "number the trials of a session 0, 1, 2, ...");
      return;
    }
    const auto at = sessions_.find(trial.session);
    if (at != sessions_.end()) check_after(at->second, trial, reader);
    if (!reader.errors().empty()) return;
    lines_.emplace(key, reader.field(kTrial).place.line);
    SessionState& last = sessions_[trial.session];
    last.trial = trial.trial;
    if (trial.t_s) last.t_s = trial.t_s;
  }

  void check_after(const SessionState& last, const Trial& trial, CsvRowReader& reader) const {
    if (trial.trial < last.trial) {
      reader.fail(kTrial, std::to_string(trial.trial) + " after " + std::to_string(last.trial),
                  "numbers that increase within a session", "sort the rows in driving order");
    }
    if (trial.t_s && last.t_s && *trial.t_s < *last.t_s) {
      reader.fail(*form_.time, format_double(*trial.t_s) + " after " + format_double(*last.t_s),
                  "times that do not decrease within a session",
                  "sort the rows in driving order, or leave unknown times empty");
    }
  }

  const LogForm& form_;
  const std::vector<std::string>& columns_;
  const std::string& file_;
  std::span<const std::string> commands_;
  std::map<TrialKey, std::size_t> lines_;
  std::map<std::string, SessionState> sessions_;
};

// Rows (session, trial, t, ...) of a file, to the trials that they name.
template <class Sample>
struct SampleForm {
  TextFormat format;
  const char* expected;
  const char* rows_are;  // "path", for the note on rows without a trial
  const std::vector<std::string>* columns;
  Sample (*read)(CsvRowReader& reader);
  std::vector<Sample> Trial::*member;
  bool times_repeat;  // whether two samples may have one time
};

template <class Sample>
struct ReadSamples {
  std::map<TrialKey, std::vector<Sample>> of;
  std::map<TrialKey, std::size_t> lines;  // of their first rows
  std::map<TrialKey, std::size_t> rows;
};

template <class Sample>
void read_row(const SampleForm<Sample>& form, const CsvRow& row, const CsvHeader& header,
              const std::string& file, ReadSamples<Sample>& samples, Mistakes& mistakes) {
  if (Status width = check_width(row, header, file); !width.ok()) {
    return mistakes.add_row({width.error()});
  }
  CsvRowReader reader(row, header, *form.columns, file);
  const TrialKey key{reader.word(kPathSession), reader.integer(kPathTrial)};
  const Sample sample = form.read(reader);
  if (!reader.errors().empty()) return mistakes.add_row(reader.errors());
  std::vector<Sample>& path = samples.of[key];
  const bool late = path.empty() || sample.t_s > path.back().t_s ||
                    (form.times_repeat && sample.t_s == path.back().t_s);
  if (!late) {
    reader.fail(kPathTime,
                format_double(sample.t_s) + " after " + format_double(path.back().t_s) + " in " +
                    key_text(key),
                form.times_repeat ? "times that do not decrease within a trial"
                                  : "times that increase within a trial",
                "sort the rows by time");
    return mistakes.add_row(reader.errors());
  }
  path.push_back(sample);
  samples.lines.emplace(key, row.fields[0].place.line);
  ++samples.rows[key];
}

// The trials of all logs by key.  Mistake: samples of a trial that two logs hold, or that has some.
template <class Sample>
std::map<TrialKey, Trial*> takers(const SampleForm<Sample>& form, const std::string& file,
                                  const ReadSamples<Sample>& samples,
                                  const std::vector<TrialLog*>& logs, Mistakes& mistakes) {
  std::map<TrialKey, Trial*> takers;
  for (TrialLog* log : logs) {
    for (Trial& trial : log->trials) {
      const TrialKey key{trial.session, trial.trial};
      if (samples.of.count(key) == 0) continue;
      const char* problem = !takers.emplace(key, &trial).second ? ", which two logs hold"
                            : (trial.*form.member).empty()
                                ? nullptr
                                : ", which has one from another file; remove one of them";
      if (problem == nullptr) continue;
      mistakes.add_file(
          Error{file + ": found a " + form.rows_are + " of " + key_text(key) + problem});
      return {};
    }
  }
  return takers;
}

template <class Sample>
void add_samples(const SampleForm<Sample>& form, std::string_view text, const std::string& file,
                 const std::vector<TrialLog*>& logs, Mistakes& mistakes) {
  const TextFormat format = sniff_format(text);
  if (format != form.format) {
    return mistakes.add_file(wrong_format(file, format, form.expected));
  }
  auto rows = parse_csv(text, file);
  if (!rows.ok()) return mistakes.add_file(rows.error());
  auto header = CsvHeader::match(rows->front(), *form.columns, file, form.expected);
  if (!header.ok()) return mistakes.add_file(header.error());
  ReadSamples<Sample> samples;
  for (std::size_t i = 1; i < rows->size(); ++i) {
    read_row(form, (*rows)[i], *header, file, samples, mistakes);
  }
  if (!mistakes.status().ok()) return;
  const std::map<TrialKey, Trial*> trials = takers(form, file, samples, logs, mistakes);
  if (!mistakes.status().ok()) return;
  std::size_t strangers = 0, first_stranger = 0;
  for (auto& [key, path] : samples.of) {
    const auto at = trials.find(key);
    if (at != trials.end()) {
      at->second->*form.member = std::move(path);
      continue;
    }
    const std::size_t line = samples.lines.at(key);
    first_stranger = strangers == 0 ? line : std::min(first_stranger, line);
    strangers += samples.rows.at(key);
  }
  if (strangers == 0) return;
  logs.front()->notes.push_back(file + ":" + std::to_string(first_stranger) + ":1: omitted " +
                                std::to_string(strangers) + " " + form.rows_are +
                                " rows of trials that are not in the log");
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
  return {t_s, reader.coordinate(kPathX), reader.coordinate(kPathY),
          reader.field(kPathTime).place.line};
}

}  // namespace

const LogForm kTrialLogForm{.format = TextFormat::kTrialLog,
                            .columns = &kTrialColumns,
                            .command = kCommand,
                            .command_is = "a command of the scenario",
                            .command_remedy = "write one of those it knows",
                            .pose = kX0,
                            .time = kTime,
                            .drive = kLeft};

const LogForm kPushLogForm{
    .format = TextFormat::kPushLog,
    .columns = &kPushColumns,
    .command = 2,
    .command_is = "a piece of the config",
    .command_remedy = "push logs belong to scenario push, whose [[pieces]] they name",
    .pose = 3,
    .time = {},
    .drive = {}};

std::string key_text(const TrialKey& key) {
  return "trial " + std::to_string(key.second) + " of session " + quoted_word(key.first);
}

TrialLog parse_log(const LogForm& form, std::string_view text, const std::string& file,
                   std::span<const std::string> commands, Mistakes& mistakes) {
  const TextFormat format = sniff_format(text);
  if (format != form.format) {
    mistakes.add_file(wrong_format(file, format, format_name(form.format)));
    return {};
  }
  return TrialParser(form, file, commands).parse(text, mistakes);
}

void add_paths(std::string_view text, const std::string& file, const std::vector<TrialLog*>& logs,
               Mistakes& mistakes) {
  const SampleForm<PathSample> form{TextFormat::kPaths,
                                    "the paths of a trial log (columns session,trial,t,x,y,theta)",
                                    "path",
                                    &kPathColumns,
                                    read_path_sample,
                                    &Trial::path,
                                    true};
  add_samples(form, text, file, logs, mistakes);
}

void add_tips(std::string_view text, const std::string& file, const std::vector<TrialLog*>& logs,
              Mistakes& mistakes) {
  const SampleForm<TipSample> form{TextFormat::kTips,
                                   "the finger paths of a push log (columns session,trial,t,x,y)",
                                   "tip",
                                   &kTipColumns,
                                   read_tip_sample,
                                   &Trial::tip,
                                   false};
  add_samples(form, text, file, logs, mistakes);
  for (TrialLog* log : logs) {
    for (Trial& trial : log->trials) {
      if (!trial.tip.empty() && trial.tip_file.empty()) trial.tip_file = file;
    }
  }
}

}  // namespace gapfarm
