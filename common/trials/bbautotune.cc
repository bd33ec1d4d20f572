#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/trials/format.h"
#include "common/trials/text/csv.h"
#include "common/trials/text/trial_parser.h"

namespace gapfarm {
namespace {

constexpr double kCentimetresPerMetre = 100;
constexpr double kPrintedAngleTolerance = 1e-6;
constexpr double kGreatestCoordinate_cm = 1e6;
// It drove the motors forward until 25 cm were expected.
constexpr const char* kForward = "move(25, 0, 0)";
constexpr double kForwardMove[] = {25, 0, 0};

// What stands in a line: letters are numbers, M is "move(", | a semicolon or a blank in its place.
constexpr std::string_view kLine = "x;y;t;Ma,a,a)|x;y;t";
constexpr char kMove = 'M', kSeparator = '|', kLastOfMove = ')';

struct LineNumber {
  char letter;
  const char* expected;
  double most;
};
constexpr LineNumber kLineNumbers[] = {
    {'x', "x in cm", kGreatestCoordinate_cm},
    {'y', "y in cm", kGreatestCoordinate_cm},
    {'t', "a heading in rad", std::numbers::pi + kPrintedAngleTolerance},
    {'a', "an argument of move()", kGreatestCoordinate_cm}};

bool is_blank_line(std::string_view text) { return trimmed(text).empty(); }

// Reads one line; the first failure ends it.
class LineReader {
 public:
  LineReader(std::string_view text, std::size_t line, std::string_view file)
      : text_(text), line_(line), file_(file) {}

  // Its numbers, from left to right.
  Result<std::vector<double>> read() {
    std::size_t move_at = 0;
    for (const char part : kLine) {
      const std::size_t behind = at_;
      at_ = std::min(text_.find_first_not_of(" \t", at_), text_.size());
      if (const LineNumber* form = find_by(kLineNumbers, part, &LineNumber::letter)) {
        RETURN_IF_ERROR(number(*form));
        continue;
      }
      if (part == kMove) move_at = at_;
      const bool separator = part == kSeparator;
      const std::string token = part == kMove ? "move(" : std::string(1, separator ? ';' : part);
      if (text_.substr(at_).starts_with(token)) {
        at_ += token.size();
      } else if (!separator || at_ == behind || at_ == text_.size()) {
        return wrong(token.starts_with(text_.substr(at_)),
                     part == kMove ? kForward : "'" + token + (separator ? "' or a blank" : "'"));
      }
      if (part == kLastOfMove && !std::ranges::equal(std::span(numbers_).last(3), kForwardMove)) {
        return text_error(file_, {line_, move_at + 1},
                          quoted_word(text_.substr(move_at, at_ - move_at)), kForward,
                          "only the command forward is known in this format; write other commands "
                          "as a trials.csv (docs/formats.md)");
      }
    }
    if (!is_blank_line(text_.substr(at_))) return wrong(false, "the end of the line");
    return numbers_;
  }

  // The line is the beginning of a good one: it ended too early.
  bool cut_short() const { return cut_short_; }

 private:
  Status number(const LineNumber& form) {
    const std::size_t end = std::min(text_.find_first_of("; \t,)", at_), text_.size());
    const std::string_view word = text_.substr(at_, end - at_);
    const std::optional<double> value = parse_double(word);
    if (!value) return wrong((word.empty() || word == "-") && end == text_.size(), form.expected);
    if (!std::isfinite(*value) || std::abs(*value) > form.most) {
      return wrong(false, std::string(form.expected) + " of at most " + format_double(form.most));
    }
    numbers_.push_back(*value);
    at_ = end;
    return {};
  }

  Error wrong(bool cut_short, std::string_view expected) {
    cut_short_ = cut_short;
    const std::string_view rest = trimmed(text_.substr(at_));
    return text_error(file_, {line_, at_ + 1},
                      rest.empty() ? "the end of the line" : quoted_word(rest), expected,
                      "a line reads x;y;theta;move(25, 0, 0);x';y';theta' in cm and rad");
  }

  std::string_view text_;
  std::size_t line_;
  std::string_view file_;
  std::size_t at_ = 0;
  std::vector<double> numbers_;
  bool cut_short_ = false;
};

Pose pose_of(std::span<const double> cm_cm_rad) {
  return {cm_cm_rad[0] / kCentimetresPerMetre, cm_cm_rad[1] / kCentimetresPerMetre,
          wrap_angle(cm_cm_rad[2])};
}

}  // namespace

Result<TrialLog> parse_bbautotune(std::string_view text, const std::string& file,
                                  const std::string& session,
                                  std::span<const std::string> commands) {
  const TextFormat format = sniff_format(text);
  if (format != TextFormat::kBbautotune) return wrong_format(file, format, "a bbautotune log");
  if (std::find(commands.begin(), commands.end(), "forward") == commands.end()) {
    return text_error(file, {}, "a log of the command forward", "a command of the scenario",
                      "this format belongs to scenario srv1");
  }
  if (text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);
  TrialLog log;
  const std::vector<std::string_view> lines = lines_of(text);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (is_blank_line(lines[i])) continue;
    LineReader reader(lines[i], i + 1, file);
    const auto numbers = reader.read();
    if (!numbers) {
      const bool last = std::all_of(lines.begin() + static_cast<std::ptrdiff_t>(i) + 1, lines.end(),
                                    is_blank_line);
      if (!reader.cut_short() || !last || log.trials.empty()) return numbers.error();
      log.notes.push_back(numbers.error().message + "; the last line breaks off and was omitted");
      break;
    }
    Trial trial;
    trial.session = session;
    trial.trial = static_cast<std::int64_t>(log.trials.size());
    trial.command = "forward";
    trial.X_WS = pose_of(std::span(*numbers).first(3));
    trial.X_WE = pose_of(std::span(*numbers).last(3));
    log.trials.push_back(std::move(trial));
  }
  return log;
}

}  // namespace gapfarm
