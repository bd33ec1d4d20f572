#include "master/command/console.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>

namespace gapfarm {
namespace {

bool dumb_terminal() {
  const char* term = std::getenv("TERM");
  return term && std::string_view(term) == "dumb";
}

bool colour_wanted() {
  const char* no_color = std::getenv("NO_COLOR");
  return !(no_color && *no_color) && !dumb_terminal();
}

// False: not all of it was taken, as errno says.
bool write_whole(std::FILE* file, std::string_view text) {
  return std::fwrite(text.data(), 1, text.size(), file) == text.size() && std::fflush(file) == 0;
}

}  // namespace

Console::Console(std::FILE* out, std::FILE* err, Clock clock)
    : out_(out),
      err_(err),
      clock_(clock),
      out_is_terminal_(::isatty(::fileno(out)) == 1),
      err_is_terminal_(::isatty(::fileno(err)) == 1),
      colour_(out_is_terminal_ && colour_wanted()),
      redraws_(err_is_terminal_ && !dumb_terminal()) {}

Console::~Console() { clear_progress(); }

void Console::result(std::string_view text, const Json& value) {
  if (!json_) return print(text);
  // What comes from a log's text may be anything.
  print(json_text(value, 2) + "\n");
}

int Console::end(int exit_code) {
  if (!lost_.empty()) {
    error({"stdout: cannot be written: " + lost_});
    return exit_code == kExitDone ? kExitFailed : exit_code;
  }
  if (!json_ || printed_ || exit_code == 0) return exit_code;
  const std::string message = !errors_.empty()  ? errors_
                              : exit_code > 128 ? "stopped by a signal"
                                                : "stopped";
  result("", {{"error", {{"message", message}, {"exit_code", exit_code}}}});
  return exit_code;
}

void Console::print(std::string_view text) {
  clear_progress();
  printed_ = true;
  if (!write_whole(out_, text)) lost_ = std::strerror(errno);
}

Status Console::keep(const std::string& file) {
  LogOptions options;
  options.program = "gapfarm";
  options.level = LogLevel::kInfo;
  options.file = file;
  auto log = std::make_unique<Log>(options);
  if (!log->trouble().empty()) return Error{file + ": cannot keep a log: " + log->trouble()};
  kept_ = std::move(log);
  return {};
}

void Console::note(std::string_view text) {
  if (log_ != nullptr) return log_->write(LogLevel::kInfo, text);
  if (kept_) kept_->write(LogLevel::kInfo, text);
  clear_progress();
  write_whole(err_, std::string(text) + "\n");
}

void Console::error(const Error& error) {
  errors_ += (errors_.empty() ? "" : "\n") + error.message;
  if (log_ != nullptr) return log_->write(LogLevel::kError, error.message);
  if (kept_) kept_->write(LogLevel::kError, error.message);
  clear_progress();
  write_whole(err_, "gapfarm: " + error.message + "\n");
}

void Console::progress(std::string_view text, bool news) {
  const double now = clock_();
  if (news) lines_ = LineCadence();
  if (lines_.due(now)) {
    if (log_ != nullptr) return log_->write(LogLevel::kInfo, text);
    if (kept_) kept_->write(LogLevel::kInfo, text);
    if (!redraws_) write_whole(err_, std::string(text) + "\n");
  }
  if (!redraws_ || log_ != nullptr) return;
  if (progress_shown_ && now - last_progress_s_ < 0.1) return;
  last_progress_s_ = now;
  progress_shown_ = true;
  // A line that wraps could not be taken back.
  write_whole(err_, "\r\x1b[K" + std::string(text.substr(0, std::max(1u, width()) - 1)));
}

void Console::clear_progress() {
  if (!progress_shown_) return;
  progress_shown_ = false;
  write_whole(err_, "\r\x1b[K");
}

unsigned Console::width() const {
  winsize size{};
  const int fd = ::fileno(out_is_terminal_ ? out_ : err_);
  if (::ioctl(fd, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  return 80;
}

std::string Console::styled(std::string_view text, const char* code) const {
  if (!colour_) return std::string(text);
  return "\x1b[" + std::string(code) + "m" + std::string(text) + "\x1b[0m";
}

std::string printable(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f) c = '?';
  }
  return result;
}

}  // namespace gapfarm
