#include "common/recordings/read.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "common/trials/files.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

// A session and a run in it.
using RunKey = std::pair<std::string, std::string>;

// One file of rows "[session,]run,t,NAMES...".
class RunTable {
 public:
  static Result<RunTable> read(const std::string& path, std::span<const std::string> names,
                               const char* format) {
    const auto text = read_text_file(path);
    if (!text) return text.error();
    auto rows = parse_csv(*text, path);
    if (!rows) return rows.error();
    if (rows->empty()) return text_error(path, {}, "an empty file", format);
    RunTable table;
    table.names_ = {"run", "t"};
    table.names_.insert(table.names_.end(), names.begin(), names.end());
    auto header = CsvHeader::match(rows->front(), table.names_, path, format);
    if (!header) return header.error();
    std::optional<std::size_t> session;
    for (const std::size_t column : header->extra()) {
      if (rows->front().fields[column].text == "session") session = column;
    }
    for (std::size_t i = 1; i < rows->size(); ++i) {
      const CsvRow& row = (*rows)[i];
      if (Status s = check_width(row, *header, path); !s) return s.error();
      if (Status s = table.take(row, *header, session, path); !s) return s.error();
    }
    if (table.rows_.empty()) return text_error(path, {2, 1}, "no rows", format);
    return table;
  }

  const std::vector<RunKey>& order() const { return order_; }
  const std::vector<CommandRow>& of(const RunKey& key) const { return rows_.at(key); }
  bool has(const RunKey& key) const { return rows_.count(key) > 0; }

 private:
  Status take(const CsvRow& row, const CsvHeader& header, std::optional<std::size_t> session,
              const std::string& path) {
    CsvRowReader reader(row, header, names_, path);
    const RunKey key{session ? row.fields[*session].text : "", reader.word(0)};
    CommandRow to;
    to.t_s = reader.number(1, -1e12, 1e12, "s");
    for (std::size_t c = 2; c < names_.size(); ++c) {
      to.values.push_back(reader.number(c, -1e9, 1e9, ""));
    }
    if (reader.error()) return *reader.error();
    auto [entry, fresh] = rows_.try_emplace(key);
    if (fresh) order_.push_back(key);
    if (!fresh && to.t_s < entry->second.back().t_s) {
      return text_error(path, reader.field(1).place, reader.field(1).text,
                        "a time of at least " + format_double(entry->second.back().t_s) +
                            " s, which the row before has",
                        "times ascend within a run; sort the rows or name runs apart");
    }
    entry->second.push_back(std::move(to));
    return {};
  }

  std::vector<std::string> names_;
  std::map<RunKey, std::vector<CommandRow>> rows_;
  std::vector<RunKey> order_;
};

// Whether its poses are each in the axes of the one before.
Result<bool> holds_increments(const std::string& path) {
  const auto text = read_text_file(path);
  if (!text) return text.error();
  const auto head = parse_csv(std::string_view(*text).substr(0, text->find('\n')), path);
  if (!head) return head.error();
  return !head->empty() && std::any_of(head->front().fields.begin(), head->front().fields.end(),
                                       [](const CsvField& f) { return f.text == "dx"; });
}

// Rows at the time of the one before are omitted, but for what they moved on.
std::size_t add_poses(const std::vector<CommandRow>& rows, bool increments, LoggedRun* run) {
  std::size_t repeated = 0;
  Pose X_WM;
  for (const CommandRow& row : rows) {
    const Pose read{row.values[0], row.values[1], wrap_angle(row.values[2])};
    // The first one's is from a pose that nobody has.
    X_WM = !increments ? read : run->poses.empty() ? Pose() : X_WM * read;
    if (run->poses.empty() || row.t_s > run->poses.back().t_s) {
      run->poses.push_back({row.t_s, X_WM});
    } else {
      ++repeated;
      if (increments) run->poses.back().X_WM = X_WM;
    }
  }
  return repeated;
}

std::string name_of(const RunKey& key) {
  return key.first.empty() ? key.second : key.first + "/" + key.second;
}

}  // namespace

Result<RunLog> read_runs(const std::string& commands_path, const std::string& poses_path,
                         std::span<const std::string> channels) {
  const auto commands = RunTable::read(commands_path, channels, "a command log");
  if (!commands) return commands.error();
  static const std::vector<std::string> kPose = {"x", "y", "theta"};
  static const std::vector<std::string> kIncrement = {"dx", "dy", "dtheta"};
  const auto increments = holds_increments(poses_path);
  if (!increments) return increments.error();
  const auto poses = RunTable::read(poses_path, *increments ? kIncrement : kPose, "a pose log");
  if (!poses) return poses.error();
  RunLog log;
  log.relative = *increments;
  log.channels.assign(channels.begin(), channels.end());
  for (const RunKey& key : poses->order()) {
    if (!commands->has(key)) {
      return Error{poses_path + ": run " + quoted_word(name_of(key)) + " has no commands in " +
                   commands_path};
    }
    LoggedRun run;
    run.session = key.first;
    run.run = key.second;
    run.commands = commands->of(key);
    const std::size_t repeated = add_poses(poses->of(key), log.relative, &run);
    if (repeated > 0 && !log.relative) {
      log.notes.push_back(poses_path + ": run " + quoted_word(name_of(key)) + ": " +
                          std::to_string(repeated) + " poses at the time of the one before");
    }
    log.runs.push_back(std::move(run));
  }
  for (const RunKey& key : commands->order()) {
    if (!poses->has(key)) {
      log.notes.push_back(commands_path + ": run " + quoted_word(name_of(key)) +
                          " has no poses and is omitted");
    }
  }
  return log;
}

Status read_wheel_speeds(const std::string& path, RunLog* log) {
  const auto text = read_text_file(path);
  if (!text) return text.error();
  const auto head = parse_csv(std::string_view(*text).substr(0, text->find('\n')), path);
  if (!head) return head.error();
  std::vector<std::string> wheels;
  for (std::size_t c = 0; !head->empty() && c < head->front().fields.size(); ++c) {
    const std::string& name = head->front().fields[c].text;
    if (name != "session" && name != "run" && name != "t") wheels.push_back(name);
  }
  const auto table = RunTable::read(path, wheels, "a log of wheel speeds");
  if (!table) return table.error();
  if (!log->wheel_channels.empty() && log->wheel_channels != wheels) {
    return Error{path + ": other wheels than the logs before have; give all logs the same columns"};
  }
  log->wheel_channels = std::move(wheels);
  for (LoggedRun& run : log->runs) {
    const RunKey key{run.session, run.run};
    if (table->has(key)) run.wheel_speeds = table->of(key);
  }
  return {};
}

}  // namespace gapfarm
