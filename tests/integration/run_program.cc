#include "tests/integration/run_program.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

namespace gapfarm {

std::string text_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

RunningProgram::RunningProgram(const std::string& program,
                               const std::vector<std::string>& arguments,
                               const std::vector<std::string>& environment) {
  const std::string path =
      program.front() == '/' ? program : std::string(GAPFARM_BIN_DIR) + "/" + program;
  const std::string out = folder_ / "out", err = folder_ / "err";
  std::vector<char*> argv = {const_cast<char*>(path.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ != 0) return;
  // A test that is killed leaves nothing running.
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(127);
  for (const std::string& entry : environment) ::putenv(const_cast<char*>(entry.c_str()));
  ::dup2(::open("/dev/null", O_RDONLY), 0);
  ::dup2(::open(out.c_str(), O_WRONLY | O_CREAT, 0600), 1);
  ::dup2(::open(err.c_str(), O_WRONLY | O_CREAT, 0600), 2);
  ::execv(path.c_str(), argv.data());
  ::_exit(127);
}

RunningProgram::~RunningProgram() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
}

void RunningProgram::send(int signal) const { ::kill(pid_, signal); }

std::string RunningProgram::out() const { return text_of(folder_ / "out"); }

std::string RunningProgram::err() const { return text_of(folder_ / "err"); }

bool RunningProgram::ended() const {
  siginfo_t info = {};
  return ::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) != 0 ||
         info.si_pid != 0;
}

Finished RunningProgram::wait() {
  int status = 0;
  rusage usage = {};
  ::wait4(pid_, &status, 0, &usage);
  pid_ = -1;
  Finished finished;
  finished.peak_memory_kB = usage.ru_maxrss;
  finished.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  finished.out = text_of(folder_ / "out");
  finished.err = text_of(folder_ / "err");
  return finished;
}

Finished run_program(const std::string& program, const std::vector<std::string>& arguments,
                     const std::vector<std::string>& environment) {
  return RunningProgram(program, arguments, environment).wait();
}

nlohmann::json status_of(const std::string& run) {
  const Finished finished = gapfarm_command({"status", run, "--json"});
  const auto found = nlohmann::json::parse(finished.out, nullptr, false);
  return found.is_object() ? found : nlohmann::json::object();
}

bool wait_until(const std::function<bool()>& holds) {
  using Clock = std::chrono::steady_clock;
  for (const auto deadline = Clock::now() + std::chrono::minutes(1); !holds();) {
    if (Clock::now() > deadline) return false;
    ::poll(nullptr, 0, 5);
  }
  return true;
}

std::vector<pid_t> children(pid_t pid) {
  std::vector<pid_t> found;
  const std::filesystem::path tasks = "/proc/" + std::to_string(pid) + "/task";
  std::error_code gone;
  for (const auto& task : std::filesystem::directory_iterator(tasks, gone)) {
    std::ifstream in(task.path() / "children");
    for (pid_t child = 0; in >> child;) found.push_back(child);
  }
  return found;
}

}  // namespace gapfarm
