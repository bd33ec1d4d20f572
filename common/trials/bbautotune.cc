#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "common/trials/format.h"
#include "common/trials/text/csv.h"
#include "common/trials/text/trial_parser.h"

namespace gapfarm {
namespace {

constexpr double kCentimetresPerMetre = 100;
constexpr double kPrintedAngleTolerance = 1e-6;
constexpr double kGreatestCoordinate_cm = 1e6;

// Reads one line from left to right; the first failure sticks.
class LineReader {
 public:
  LineReader(std::string_view text, std::size_t line, std::string_view file)
      : text_(text), line_(line), file_(file) {}

  void expect(std::string_view token, std::string_view expected) {
    skip_blanks();
    if (error_) return;
    const std::string_view rest = text_.substr(at_);
    if (rest.substr(0, token.size()) == token) {
      at_ += token.size();
    } else {
      fail(at_, rest == token.substr(0, rest.size()), expected);
    }
  }

  // The second semicolon of a pair, or a blank in its place.
  void expect_separator_or_blank() {
    if (error_) return;
    const bool blank = at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t');
    skip_blanks();
    if (at_ < text_.size() && text_[at_] == ';') {
      ++at_;
    } else if (!blank || at_ == text_.size()) {
      fail(at_, at_ == text_.size(), "';' or a blank");
    }
  }

  double number(std::string_view what, double limit) {
    skip_blanks();
    if (error_) return 0;
    const std::size_t end = std::min(text_.find_first_of("; \t,)", at_), text_.size());
    const std::string_view word = text_.substr(at_, end - at_);
    const std::optional<double> value = parse_double(word);
    if (!value) {
      fail(at_, word.empty() || word == "-" ? end == text_.size() : false, what);
    } else if (!std::isfinite(*value) || std::abs(*value) > limit) {
      fail(at_, false, std::string(what) + " of at most " + format_double(limit));
    }
    at_ = end;
    return value.value_or(0);
  }

  Pose pose() {
    Pose pose;
    pose.x = number("x in cm", kGreatestCoordinate_cm) / kCentimetresPerMetre;
    expect(";", "';' after x");
    pose.y = number("y in cm", kGreatestCoordinate_cm) / kCentimetresPerMetre;
    expect(";", "';' after y");
    pose.theta = wrap_angle(number("a heading in rad", std::numbers::pi + kPrintedAngleTolerance));
    return pose;
  }

  // `move(25, 0, 0)` drove the motors forward until 25 cm were expected.
  void forward() {
    skip_blanks();
    const std::size_t begin = at_;
    expect("move(", "move(25, 0, 0)");
    double arguments[3] = {};
    for (int i = 0; i < 3; ++i) {
      if (i > 0) expect(",", "',' between the arguments of move()");
      arguments[i] = number("an argument of move()", kGreatestCoordinate_cm);
    }
    expect(")", "')' after the arguments of move()");
    if (error_ || (arguments[0] == 25 && arguments[1] == 0 && arguments[2] == 0)) return;
    error_ = text_error(file_, {line_, begin + 1}, quoted_word(text_.substr(begin, at_ - begin)),
                        "move(25, 0, 0)",
                        "only the command forward is known in this format; write other commands as "
                        "a trials.csv (docs/formats.md)");
  }

  void expect_end() {
    skip_blanks();
    if (!error_ && at_ != text_.size()) fail(at_, false, "the end of the line");
  }

  const std::optional<Error>& error() const { return error_; }
  // The line is the beginning of a good one: it ended too early.
  bool cut_short() const { return cut_short_; }

 private:
  void skip_blanks() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t')) ++at_;
  }

  void fail(std::size_t at, bool cut_short, std::string_view expected) {
    const std::string_view rest = text_.substr(at);
    const std::string found = rest.empty() ? "the end of the line" : quoted_word(rest);
    error_ = text_error(file_, {line_, at + 1}, found, expected,
                        "a line reads x;y;theta;move(25, 0, 0);x';y';theta' in cm and rad");
    cut_short_ = cut_short;
  }

  std::string_view text_;
  std::size_t line_;
  std::string_view file_;
  std::size_t at_ = 0;
  std::optional<Error> error_;
  bool cut_short_ = false;
};

// Cuts the next line off `text`, without its line break.
std::string_view take_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

bool is_blank_line(std::string_view text) { return text.find_first_not_of(" \t\r\n") == text.npos; }

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
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view line = take_line(text);
    if (is_blank_line(line)) continue;
    LineReader reader(line, number, file);
    Trial trial;
    trial.session = session;
    trial.trial = static_cast<std::int64_t>(log.trials.size());
    trial.command = "forward";
    trial.X_WS = reader.pose();
    reader.expect(";", "';' after theta");
    reader.forward();
    reader.expect_separator_or_blank();
    trial.X_WE = reader.pose();
    reader.expect_end();
    if (reader.error()) {
      if (!reader.cut_short() || !is_blank_line(text) || log.trials.empty()) return *reader.error();
      log.notes.push_back(reader.error()->message + "; the last line breaks off and was omitted");
      break;
    }
    log.trials.push_back(std::move(trial));
  }
  return log;
}

}  // namespace gapfarm
