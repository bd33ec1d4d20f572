// Runs gapfarm as a user would, and says what came of it.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "tests/temporary_folder.h"

namespace gapfarm {

struct Finished {
  int exit_code = -1;  // 128 + signal when a signal ended it
  std::string out;
  std::string err;
  long peak_memory_kB = 0;  // of it and of its children that it waited for, whichever had most
};

// A program that is running; destroying it kills it.
class RunningProgram {
 public:
  // `program` is looked for beside the tests' own programs unless it is a whole path.
  // `environment`: "NAME=value" to add.  Belongs to the thread that makes it: ends with it.
  RunningProgram(const std::string& program, const std::vector<std::string>& arguments,
                 const std::vector<std::string>& environment = {});
  ~RunningProgram();
  RunningProgram(const RunningProgram&) = delete;
  RunningProgram& operator=(const RunningProgram&) = delete;

  pid_t pid() const { return pid_; }
  void send(int signal) const;
  // Everything written to stdout so far.
  std::string out() const;
  std::string err() const;
  bool ended() const;
  Finished wait();

 private:
  pid_t pid_ = -1;
  TemporaryFolder folder_;
};

Finished run_program(const std::string& program, const std::vector<std::string>& arguments,
                     const std::vector<std::string>& environment = {});

inline Finished gapfarm_command(const std::vector<std::string>& arguments,
                                const std::vector<std::string>& environment = {}) {
  return run_program("gapfarm", arguments, environment);
}

// `gapfarm status RUN --json`; an empty object where there is none.
nlohmann::json status_of(const std::string& run);

// Looks every few milliseconds; false: not within a minute, which is far beyond what anything
// takes.
bool wait_until(const std::function<bool()>& holds);

// The processes that any thread of `pid` has started and that are running.
std::vector<pid_t> children(pid_t pid);

// The file's bytes; none where it cannot be read.
std::string text_of(const std::filesystem::path& path);

}  // namespace gapfarm
