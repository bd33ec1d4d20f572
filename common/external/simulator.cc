#include "common/external/simulator.h"

#include <fcntl.h>
#include <poll.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/external/line_json.h"
#include "common/process/child.h"

namespace gapfarm {

namespace {

void close_fd(int* fd) {
  if (*fd >= 0) close(*fd);
  *fd = -1;
}

}  // namespace

LineProgram::LineProgram(std::vector<std::string> argv, std::string folder, LineLimits limits,
                         Clock clock)
    : argv_(std::move(argv)), folder_(std::move(folder)), limits_(limits), clock_(clock) {}

LineProgram::~LineProgram() { kill(); }

std::string LineProgram::name() const { return joined(argv_, " "); }

std::string LineProgram::by_hand(const std::vector<std::string>& lines) const {
  return "cd " + shell_quoted(folder_.empty() ? "." : folder_) + " && printf '%s\\n' " +
         joined(lines, " ", shell_quoted) + " | " + joined(argv_, " ", shell_quoted);
}

void LineProgram::kill() {
  close_fd(&to_);
  close_fd(&from_);
  rest_.clear();
  if (pid_ <= 0) return;
  // Not reaped before, so that the group's number is nobody else's.
  ::kill(-pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
  if (guard_ > 0) waitpid(guard_, nullptr, 0);
  close_fd(&guarded_);
  pid_ = guard_ = 0;
}

Error LineProgram::failed(const std::string& what) {
  kill();
  return Error{"external program '" + name() + "' " + what};
}

bool LineProgram::has_ended(siginfo_t* how) const {
  how->si_pid = 0;
  return waitid(P_PID, static_cast<id_t>(pid_), how, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         how->si_pid == pid_;
}

// How it ended, of one that closed its pipe.
Error LineProgram::ended() {
  constexpr int kPatience_ms = 1000;  // between closing its pipe and being gone
  siginfo_t how{};
  for (int waited = 0; waited < kPatience_ms && !has_ended(&how); ++waited) poll(nullptr, 0, 1);
  if (!has_ended(&how)) return failed("closed its output and goes on; it has to answer on stdout");
  if (how.si_code != CLD_EXITED) {
    const int signal = how.si_status;
    return failed("crashed with signal " + std::to_string(signal) + " (" + strsignal(signal) + ")");
  }
  return failed("ended with status " + std::to_string(how.si_status) + " instead of answering");
}

// A shell in the program's group that waits for the end of a pipe: this process's end, however it
// comes, closes it.
void LineProgram::start_guard() {
  int in[2];
  if (pipe2(in, O_CLOEXEC) != 0) return;
  ChildSetup setup;
  setup.arguments = {"/bin/sh", "-c", "read line; kill -s KILL 0"};
  setup.in = in[0];
  setup.death_signal = 0;
  setup.joins_group = pid_;
  const Result<pid_t> guard = start_child(setup);
  close(in[0]);
  guarded_ = in[1];
  if (guard) guard_ = *guard;
}

Status LineProgram::start() {
  if (argv_.empty()) return failed("has no name");
  // A socket, since writing to one that is closed can be made to raise no signal.
  int in[2], out[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, in) != 0) {
    return failed(std::string("got no pipe: ") + strerror(errno));
  }
  if (pipe2(out, O_CLOEXEC) != 0) return failed(std::string("got no pipe: ") + strerror(errno));
  ChildSetup setup;
  setup.arguments = argv_;
  setup.folder = folder_;
  setup.in = in[1];
  setup.out = out[1];
  setup.leads_group = true;
  const Result<pid_t> pid = start_child(setup);
  close(in[1]);
  close(out[1]);
  to_ = in[0];
  from_ = out[0];
  answered_ = false;
  if (!pid) return failed("cannot be started in '" + folder_ + "': " + pid.error().message);
  pid_ = *pid;
  start_guard();
  return {};
}

bool LineProgram::wait_for(int fd, short events, double until) const {
  for (;;) {
    const double left = until - clock_();
    pollfd one{fd, events, 0};
    const int ready =
        poll(&one, 1, left > 0 ? static_cast<int>(std::ceil(std::min(left, 1.0) * 1e3)) : 0);
    if (ready > 0) return true;
    if (ready == 0 && left <= 0) return false;
    if (waiting_) waiting_();
  }
}

Status LineProgram::send(const std::string& line, double until) {
  const std::string text = line + "\n";
  for (std::size_t at = 0; at < text.size();) {
    if (!wait_for(to_, POLLOUT, until)) return failed("does not read what it is asked");
    const ssize_t n = ::send(to_, text.data() + at, text.size() - at, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n > 0) {
      at += static_cast<std::size_t>(n);
    } else if (errno != EAGAIN && errno != EINTR) {
      return ended();
    }
  }
  return {};
}

Result<std::string> LineProgram::receive(double until, double limit_s) {
  for (;;) {
    const std::size_t end = rest_.find('\n');
    if (std::min(end, rest_.size()) > limits_.answer_bytes) {
      return failed("sent more than the " + std::to_string(limits_.answer_bytes) +
                    " bytes that a line may have: " + line_json::shown(rest_));
    }
    if (end != rest_.npos) {
      std::string line = rest_.substr(0, end);
      rest_.erase(0, end + 1);
      return line;
    }
    if (!wait_for(from_, POLLIN, until)) {
      siginfo_t how{};
      if (has_ended(&how)) return ended();  // and what it started has its output
      return failed("did not answer within " + formatted("%g s", limit_s));
    }
    char bytes[65536];
    const ssize_t n = read(from_, bytes, sizeof bytes);
    if (n > 0) {
      rest_.append(bytes, static_cast<std::size_t>(n));
    } else if (n == 0 || errno != EINTR) {
      return ended();
    }
  }
}

Result<std::string> LineProgram::ask(const std::string& line) {
  if (!running()) {
    RETURN_IF_ERROR(start());
  }
  if (rest_.empty() && wait_for(from_, POLLIN, clock_())) {
    char bytes[80];
    const ssize_t n = read(from_, bytes, sizeof bytes);
    if (n <= 0) return ended();
    rest_.assign(bytes, static_cast<std::size_t>(n));
  }
  if (!rest_.empty()) {
    const char* when = answered_ ? "answered twice, or late: " : "spoke before it was asked: ";
    return failed(when + line_json::shown(rest_));
  }
  const double limit_s = answered_ ? limits_.answer_s : limits_.start_s;
  const double until = clock_() + limit_s;
  RETURN_IF_ERROR(send(line, until));
  Result<std::string> answer = receive(until, limit_s);
  if (answer) answered_ = true;
  return answer;
}

namespace {

// Interpreters and physics engines take their time to load.
constexpr double kLeastStart_s = 60;

std::atomic<bool> programs_allowed{false};

LineLimits limits_of(const ExternalCommand& command) {
  LineLimits limits;
  limits.answer_s = command.answer_limit_s;
  limits.start_s = std::max(kLeastStart_s, command.answer_limit_s);
  return limits;
}

}  // namespace

void allow_external_programs(bool allowed) { programs_allowed = allowed; }
bool external_programs_allowed() { return programs_allowed; }

ExternalSimulator::ExternalSimulator(const ExternalCommand& command, Clock clock)
    : ExternalSimulator(command, limits_of(command), clock) {}

ExternalSimulator::ExternalSimulator(const ExternalCommand& command, LineLimits limits, Clock clock)
    : program_(command.argv, command.folder, limits, clock) {}

Result<std::string> ExternalSimulator::introduce() {
  if (program_.running()) return introduction_;
  const Result<std::string> line = program_.ask(hello_line());
  if (!line) return Error{line.error().message, ErrorCode::kNoProgram};
  if (const auto declaration = parse_declaration(*line); !declaration) {
    program_.kill();
    return Error{"external program '" + program_.name() + "' " + declaration.error().message,
                 ErrorCode::kNoProgram};
  }
  introduction_ = *line;
  return introduction_;
}

template <class Answer, class Request>
Result<Answer> ExternalSimulator::ask(Request& request, const std::string& declared) {
  ASSIGN_OR_RETURN(const std::string introduction, introduce());
  if (introduction != declared) {
    program_.kill();
    return Error{
        "external program '" + program_.name() +
            "' declares other things than when the problem was made; check the config again, "
            "and give every machine the same program",
        ErrorCode::kNoProgram};
  }
  request.id = ++asked_;
  const std::string question = request_line(request);
  const auto failed = [&](const std::string& what) {
    return Error{what + "\nby hand: " + program_.by_hand({hello_line(), question})};
  };
  const Result<std::string> line = program_.ask(question);
  if (!line) return failed(line.error().message);
  Result<Answer> answer = parse_answer(*line, request);
  if (answer) return answer;
  program_.kill();
  return failed("external program '" + program_.name() + "' " + answer.error().message);
}

template Result<ExternalAnswer> ExternalSimulator::ask(ExternalRequest&, const std::string&);
template Result<ExternalRunAnswer> ExternalSimulator::ask(ExternalRunRequest&, const std::string&);

}  // namespace gapfarm
