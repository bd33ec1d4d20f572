#include "common/trials/format.h"

#include <algorithm>
#include <filesystem>

#include "common/base/hash.h"
#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

// The first line that is not blank, without its byte-order mark; the line after a log's comments.
// Of text that may be TOML a comment is a line like others.
std::string_view first_line(std::string_view text) {
  if (text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);
  const bool assigns = text.find(" = ") != text.npos;
  while (true) {
    const std::size_t begin = text.find_first_not_of(" \t\r\n");
    if (begin == text.npos) return {};
    text.remove_prefix(begin);
    const std::string_view line = text.substr(0, text.find_first_of("\r\n"));
    const bool mark = line.substr(0, 6) == "# log:";
    if (!is_comment(line) || (assigns && !mark)) return line;
    text.remove_prefix(line.size());
  }
}

bool has(std::string_view text, std::string_view part) { return text.find(part) != text.npos; }

// Names between commas, blanks and quotes cut off.
std::vector<std::string> names_of(std::string_view line) {
  const auto rows = parse_csv(line, "");
  if (!rows.ok() || rows->empty()) return {};
  return mapped(rows->front().fields, &CsvField::text);
}

TextFormat sniff_table(std::string_view line) {
  const std::vector<std::string> names = names_of(line);
  const auto column = [&](std::string_view name) { return contains(names, name); };
  if (column("millisecond") && column("x")) return TextFormat::kRacquetball;
  if (column("cov_xx")) return TextFormat::kPrediction;
  if (column("object")) return TextFormat::kPushLog;
  // A trial log with a column missing is still a trial log: the reader says what is missing.
  int of_trials = 0;
  for (const char* name :
       {"command", "left", "right", "duration", "x0", "y0", "theta0", "x1", "y1", "theta1"}) {
    of_trials += column(name) ? 1 : 0;
  }
  if (of_trials >= 2) return TextFormat::kTrialLog;
  if (column("session") && column("trial") && column("x")) {
    return column("theta") ? TextFormat::kPaths : TextFormat::kTips;
  }
  return column("session") || column("trial") ? TextFormat::kTrialLog : TextFormat::kUnknown;
}

struct FormatTexts {
  TextFormat format;
  const char* name;
  const char* remedy;  // $FILE stands for the file
};

constexpr FormatTexts kTexts[] = {
    {TextFormat::kEmpty, "an empty file", "check that the log was written"},
    {TextFormat::kTrialLog, "a trial log", "give it as a trial file, it needs no import"},
    {TextFormat::kPaths, "the paths of a trial log",
     "name the trials.csv beside it; its paths.csv is read with it"},
    {TextFormat::kPushLog, "a push log", "give it as a trial file to a config of scenario push"},
    {TextFormat::kTips, "the finger paths of a push log", "name the pushes.csv beside it"},
    {TextFormat::kBbautotune, "a bbautotune log", "run 'gapfarm import bbautotune $FILE'"},
    {TextFormat::kBlendersim, "a blendersim way-point log",
     "it holds no commands, so no trials can be had from it"},
    {TextFormat::kRacquetball, "a racquetball trajectory",
     "it belongs to scenario racquetball, not to this one"},
    {TextFormat::kPrediction, "a prediction", "name the trial log that it was made for"},
    {TextFormat::kToml, "a config or a model", "give it as CONFIG or MODEL"},
    {TextFormat::kJson, "JSON", "export the log as CSV"},
    {TextFormat::kHtml, "HTML", "export the log as CSV"},
    {TextFormat::kRunStore, "a run store", "give it as RUN"},
    {TextFormat::kOtherSeparator, "a table without commas",
     "separate columns by commas and write decimals with a point"},
    {TextFormat::kUtf16, "UTF-16 text", "save it as UTF-8"},
    {TextFormat::kBinary, "binary data", "export the log as CSV"},
    {TextFormat::kUnknown, "text of an unknown format",
     "a trial log begins with a line of column names (docs/formats.md)"},
};

const FormatTexts& texts_of(TextFormat format) {
  const FormatTexts* texts = find_by(kTexts, format, &FormatTexts::format);
  return texts == nullptr ? kTexts[std::size(kTexts) - 1] : *texts;
}

}  // namespace

TextFormat sniff_format(std::string_view text) {
  if (text.substr(0, 15) == "SQLite format 3") return TextFormat::kRunStore;
  const std::string_view mark = text.substr(0, 2);
  if (mark == "\xFF\xFE" || mark == "\xFE\xFF") return TextFormat::kUtf16;
  if (text.substr(0, 4096).find('\0') != text.npos) return TextFormat::kBinary;
  const std::string_view line = first_line(text);
  if (line.empty()) return TextFormat::kEmpty;
  if (has(line, "CAMPOSE") || has(line, "WAYPOINTS")) return TextFormat::kBlendersim;
  if (line[0] == '<') return TextFormat::kHtml;
  if (line[0] == '{' || line == "[" || line.starts_with("[{")) return TextFormat::kJson;
  const bool table_head = line[0] == '[' && has(line, "]");
  const bool key_value = has(line, " = ") || (line[0] == '#' && has(text, " = "));
  if (table_head || key_value) return TextFormat::kToml;
  if (has(line, "move(")) return TextFormat::kBbautotune;
  const bool header = has(line, "session") || has(line, "trial");
  if (header && !has(line, ",") && line.find_first_of(";\t") != line.npos) {
    return TextFormat::kOtherSeparator;
  }
  if (has(line, ";") && !header) return TextFormat::kBbautotune;
  return sniff_table(line);
}

std::string format_name(TextFormat format) { return texts_of(format).name; }

Error wrong_format(std::string_view file, TextFormat found, std::string_view expected) {
  const FormatTexts& texts = texts_of(found);
  std::string remedy = texts.remedy;
  const std::size_t at = remedy.find("$FILE");
  if (at != remedy.npos) remedy.replace(at, 5, file);
  return text_error(file, {}, texts.name, expected, remedy);
}

namespace {

constexpr std::string_view kWord = "# log:";
constexpr std::size_t kHashDigits = 32;

std::string name_of(const std::string& path) {
  return std::filesystem::path(path).filename().string();
}

bool is_hash(std::string_view word) {
  return word.size() == kHashDigits && word.find_first_not_of("0123456789abcdef") == word.npos;
}

LogMark mark_of(std::string_view text) {
  text = trimmed(text);
  const std::size_t blank = text.find_last_of(" \t");
  const std::string_view last = blank == text.npos ? text : text.substr(blank + 1);
  if (!is_hash(last)) return {std::string(text), {}};
  return {std::string(trimmed(text.substr(0, text.size() - last.size()))), std::string(last)};
}

}  // namespace

std::string format_mark(const std::string& log_path, std::string_view log_text) {
  return std::string(kWord) + " " + name_of(log_path) + " " + content_hash(log_text) + "\n";
}

std::vector<LogMark> log_marks(std::string_view text) {
  if (text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);
  std::vector<LogMark> marks;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    if (!is_comment(line)) break;
    if (line.substr(0, kWord.size()) == kWord) marks.push_back(mark_of(line.substr(kWord.size())));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
  }
  return marks;
}

Belonging belonging(const std::vector<LogMark>& marks, const std::string& log_path,
                    std::string_view log_text) {
  const std::string name = name_of(log_path);
  const std::string hash = content_hash(log_text);
  bool named = false;
  for (const LogMark& mark : marks) {
    const bool same_name = mark.file == name;
    // A log that was moved or renamed is still the one.
    if (mark.hash.empty() ? same_name : mark.hash == hash) return Belonging::kYes;
    named = named || same_name;
  }
  return named ? Belonging::kStale : Belonging::kNo;
}

}  // namespace gapfarm
