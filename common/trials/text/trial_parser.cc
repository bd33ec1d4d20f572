#include "common/trials/text/trial_parser.h"

#include <algorithm>

#include "common/base/suggest.h"
#include "common/trials/text/columns.h"

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
      : form_(form), columns_(form.columns()), file_(file), commands_(commands) {}

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

}  // namespace

const LogForm kTrialLogForm{.format = TextFormat::kTrialLog,
                            .columns = trial_columns,
                            .command = kCommand,
                            .command_is = "a command of the scenario",
                            .command_remedy = "write one of those it knows",
                            .pose = kX0,
                            .time = kTime,
                            .drive = kLeft};

const LogForm kPushLogForm{
    .format = TextFormat::kPushLog,
    .columns = push_columns,
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

}  // namespace gapfarm
