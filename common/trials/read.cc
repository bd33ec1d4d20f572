#include "common/trials/read.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <utility>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/trials/files.h"
#include "common/trials/format.h"
#include "common/trials/text/csv.h"
#include "common/trials/text/mistakes.h"
#include "common/trials/text/trial_parser.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

std::string session_of(const std::string& path) { return fs::path(path).stem().string(); }

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

// The formats that are read as trials.
struct ReadableLog {
  TextFormat format;
  TrialLog (*parse)(std::string_view text, const std::string& file,
                    std::span<const std::string> commands, Mistakes& mistakes);
  bool tips;   // whether a tips.csv must lie beside it
  bool paths;  // whether a paths.csv may
};

template <const LogForm& form>
TrialLog parse_rows(std::string_view text, const std::string& file,
                    std::span<const std::string> commands, Mistakes& mistakes) {
  return parse_log(form, text, file, commands, mistakes);
}

TrialLog parse_run(std::string_view text, const std::string& file,
                   std::span<const std::string> commands, Mistakes& mistakes) {
  auto log = parse_bbautotune(text, file, session_of(file), commands);
  if (log.ok()) return *std::move(log);
  mistakes.add_file(log.error());
  return {};
}

const ReadableLog& readable_log(TextFormat format) {
  // The first is what another format is reported as.
  static const ReadableLog kLogs[] = {
      {TextFormat::kTrialLog, parse_rows<kTrialLogForm>, false, true},
      {TextFormat::kPushLog, parse_rows<kPushLogForm>, true, true},
      {TextFormat::kBbautotune, parse_run, false, false},
  };
  for (const ReadableLog& log : kLogs) {
    if (log.format == format) return log;
  }
  return kLogs[0];
}

// One file of several that are to be one log.
struct Part {
  std::string file;
  std::string text;
  const ReadableLog* form = nullptr;
  TrialLog log;
};

// The companion `name` of each folder with parts that may have one, with those parts.
std::map<fs::path, std::vector<Part*>> companions(std::vector<Part>& parts, const char* name,
                                                  bool ReadableLog::*wanted) {
  std::map<fs::path, std::vector<Part*>> all;
  for (Part& part : parts) {
    if (part.form->*wanted) all[fs::path(part.file).parent_path() / name].push_back(&part);
  }
  return all;
}

using AddSamples = void (*)(std::string_view text, const std::string& file,
                            const std::vector<TrialLog*>& logs, Mistakes& mistakes);

void add_file(const std::string& file, const std::vector<Part*>& parts, AddSamples add,
              std::vector<std::string>& read, Mistakes& mistakes) {
  const auto text = read_text_file(file);
  if (!text.ok()) return mistakes.add_file(text.error());
  std::vector<TrialLog*> logs = mapped(parts, [](Part* part) { return &part->log; });
  read.push_back(file);
  add(*text, file, logs, mistakes);
}

// A push whose finger's way nobody knows, or that takes minutes, is a row with a mistake.
void drop_without_tips(Part& part, const std::string& tips, Mistakes& mistakes) {
  constexpr std::size_t kFewestSamples = 2;
  const bool any = !part.log.trials.empty();
  std::erase_if(part.log.trials, [&](const Trial& trial) {
    if (trial.tip.size() < kFewestSamples) {
      mistakes.add_row({text_error(
          part.file, {trial.line, 1}, "a push with fewer than two samples of the finger's way",
          "all of it in " + tips, "add the rows of its session and trial there, or remove it")});
      return true;
    }
    if (trial.tip.back().t_s - trial.tip.front().t_s <= kLongestFingersWay_s) return false;
    mistakes.add_row({text_error(
        part.file, {trial.line, 1},
        "a push whose finger's way takes more than " + formatted("%g s", kLongestFingersWay_s),
        "t in s in " + tips, "divide it by 1000 if it is in ms")});
    return true;
  });
  if (any && part.log.trials.empty()) mistakes.add_no_row(part.file);
}

void read_tips(std::vector<Part>& parts, std::vector<std::string>& read, Mistakes& mistakes) {
  for (const auto& [file, of] : companions(parts, "tips.csv", &ReadableLog::tips)) {
    if (is_there(file)) {
      add_file(file.string(), of, add_tips, read, mistakes);
      if (!mistakes.status().ok()) continue;
      for (Part* part : of) drop_without_tips(*part, file.string(), mistakes);
      continue;
    }
    const Part& first = *of.front();
    mistakes.add_file(Error{first.file + ": found no tips.csv beside it, expected one, since " +
                            format_name(first.form->format) +
                            " is of no use without; put them together"});
  }
}

// A paths.csv that does not say that it belongs to a log may be anybody's: a simulation's, say.
void read_paths_beside(std::vector<Part>& parts, TrialLog& log, Mistakes& mistakes) {
  for (const auto& [file, of] : companions(parts, "paths.csv", &ReadableLog::paths)) {
    if (!is_there(file)) continue;
    const auto text = read_text_file(file.string());
    if (!text.ok()) {
      mistakes.add_file(text.error());
      continue;
    }
    const std::vector<LogMark> marks = log_marks(*text);
    std::vector<Part*> owners;
    bool stale = false;
    for (Part* part : of) {
      const Belonging belongs = belonging(marks, part->file, part->text);
      if (belongs == Belonging::kYes) owners.push_back(part);
      stale = stale || belongs == Belonging::kStale;
    }
    if (!owners.empty()) {
      add_file(file.string(), owners, add_paths, log.files, mistakes);
      continue;
    }
    const std::string name = fs::path(of.front()->file).filename().string();
    log.notes.push_back(file.string() + ": not read, since " +
                        (stale           ? name + " has changed since it was written"
                         : marks.empty() ? "it does not say which log it belongs to"
                                         : "it says that it belongs to " + marks.front().file) +
                        "; --paths " + file.string() + " reads it all the same" +
                        (marks.empty() ? ", or begin it with the line '# log: " + name + "'" : ""));
  }
}

// By the end of each file's path that no other has: its name, mostly.
void name_sessions(std::vector<Part>& parts) {
  std::vector<fs::path> names, above;
  for (const Part& part : parts) {
    names.emplace_back(session_of(part.file));
    above.push_back(fs::absolute(part.file).lexically_normal().parent_path());
  }
  for (bool changed = true; changed;) {
    changed = false;
    const std::vector<fs::path> before = names;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (std::ranges::count(before, before[i]) < 2 || !above[i].has_filename()) continue;
      names[i] = above[i].filename() / names[i];
      above[i] = above[i].parent_path();
      changed = true;
    }
  }
  for (std::size_t i = 0; i < parts.size(); ++i) {
    for (Trial& t : parts[i].log.trials) t.session = names[i].string() + "/" + t.session;
  }
}

// Puts the parts together.
Status join(std::vector<Part> parts, TrialLog& log) {
  std::map<TrialKey, std::string> file_of;
  std::map<std::string, std::string> session_file;
  bool split = false;
  for (Part& part : parts) {
    for (const Trial& trial : part.log.trials) {
      const TrialKey key{trial.session, trial.trial};
      const auto [at, is_new] = file_of.emplace(key, part.file);
      if (!is_new) {
        return Error{
            part.file + ": found " + key_text(key) + " again, first in " + at->second +
            ", expected each (session, trial) once; name a file once, and give different runs "
            "different session names, or let --session-prefix put the files' names before them"};
      }
      const auto [owner, first] = session_file.emplace(trial.session, part.file);
      split = split || (!first && owner->second != part.file);
    }
    append(std::move(part.log), log);
  }
  if (split) join_sessions(log);
  return {};
}

// What one text holds, for the readers of texts.
Result<TrialLog> finished(TrialLog log, const Mistakes& mistakes) {
  RETURN_IF_ERROR(mistakes.status());
  for (std::string& note : mistakes.notes()) log.notes.push_back(std::move(note));
  return log;
}

}  // namespace

Result<TrialLog> parse_trials(std::string_view text, const std::string& file,
                              std::span<const std::string> commands, const ReadOptions& options) {
  Mistakes mistakes(options.skip_invalid);
  return finished(parse_log(kTrialLogForm, text, file, commands, mistakes), mistakes);
}

Result<TrialLog> read_trial_files(std::span<const std::string> paths,
                                  std::span<const std::string> commands,
                                  const ReadOptions& options) {
  if (paths.empty()) {
    return Error{"no trial files; name some with --trials or as 'trials' in the config"};
  }
  TrialLog log;
  Mistakes mistakes(options.skip_invalid);
  std::vector<Part> parts;
  for (const std::string& path : paths) {
    auto text = read_text_file(path);
    if (!text.ok()) {
      mistakes.add_file(text.error());
      continue;
    }
    Part part{path, *std::move(text), nullptr, {}};
    part.form = &readable_log(sniff_format(part.text));
    part.log = part.form->parse(part.text, path, commands, mistakes);
    log.files.push_back(path);
    parts.push_back(std::move(part));
  }
  read_tips(parts, log.files, mistakes);
  if (options.paths.empty()) read_paths_beside(parts, log, mistakes);
  std::vector<Part*> all = mapped(parts, [](Part& part) { return &part; });
  for (const std::string& file : options.paths) {
    add_file(file, all, add_paths, log.files, mistakes);
  }
  RETURN_IF_ERROR(mistakes.status());
  if (options.name_sessions) name_sessions(parts);
  RETURN_IF_ERROR(join(std::move(parts), log));
  return finished(std::move(log), mistakes);
}

}  // namespace gapfarm
