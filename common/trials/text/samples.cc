#include "common/trials/text/samples.h"

#include <algorithm>
#include <map>
#include <utility>

#include "common/trials/format.h"
#include "common/trials/text/columns.h"
#include "common/trials/text/csv.h"
#include "common/trials/text/trial_parser.h"

namespace gapfarm {
namespace {

// Rows (session, trial, t, ...) of a file, to the trials that they name.
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
  CsvRowReader reader(row, header, form.columns(), file);
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
  auto header = CsvHeader::match(rows->front(), form.columns(), file, form.expected);
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
  return {t_s, reader.coordinate(kTipX), reader.coordinate(kTipY)};
}

}  // namespace

void add_paths(std::string_view text, const std::string& file, const std::vector<TrialLog*>& logs,
               Mistakes& mistakes) {
  const SampleForm<PathSample> form{TextFormat::kPaths,
                                    "the paths of a trial log (columns session,trial,t,x,y,theta)",
                                    "path",
                                    path_columns,
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
                                   tip_columns,
                                   read_tip_sample,
                                   &Trial::tip,
                                   false};
  add_samples(form, text, file, logs, mistakes);
}

}  // namespace gapfarm
