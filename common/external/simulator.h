// A simulator of the user's, asked for one motion at a time.
#pragma once

#include <signal.h>
#include <sys/types.h>

#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/external/protocol.h"

namespace gapfarm {

struct LineLimits {
  double answer_s = 60;                // to one line
  double start_s = 60;                 // to the first one: interpreters take their time
  std::size_t answer_bytes = 1 << 20;  // of one line
};

// Started with the first ask() and again after one that failed; dies with the thread that started
// it.  What it starts dies with it.  Its stderr is this process's.  One thread at a time.
class LineProgram {
 public:
  // `words`: program and arguments, found by PATH, started in `folder`.
  LineProgram(std::vector<std::string> argv, std::string folder, LineLimits limits, Clock clock);
  ~LineProgram();
  LineProgram& operator=(LineProgram&&) = delete;

  // The line that answers `line`, both without their end.  Errors name the program and what it did:
  // it cannot be started, has ended (with what status or signal), does not answer in time, says
  // more than a line may hold, or sent something before it was asked.  After an error it is dead.
  Result<std::string> ask(const std::string& line);

  // Called about once a second of waiting for it.
  void while_waiting(std::function<void()> call) { waiting_ = std::move(call); }

  bool running() const { return pid_ > 0; }
  std::string name() const;  // its words, as typed
  // What asks it these lines in a shell.
  std::string by_hand(const std::vector<std::string>& lines) const;
  // Ends it and what it started with SIGKILL.
  void kill();

 private:
  Status start();
  void start_guard();
  bool has_ended(siginfo_t* how) const;
  Status send(const std::string& line, double until);
  Result<std::string> receive(double until, double limit_s);
  Error ended();
  Error failed(const std::string& what);
  bool wait_for(int fd, short events, double until) const;

  std::vector<std::string> argv_;
  std::string folder_;
  LineLimits limits_;
  Clock clock_;
  std::function<void()> waiting_;
  pid_t pid_ = 0;    // and of its process group
  pid_t guard_ = 0;  // ends the group when this process is gone; 0: none
  int guarded_ = -1;
  int to_ = -1;
  int from_ = -1;
  bool answered_ = false;
  std::string rest_;  // read beyond the last answer
};

// Whether this process may start the programs that problems name: they come from whoever is the
// master.  False until it is reported.
void allow_external_programs(bool allowed);
bool external_programs_allowed();

class ExternalSimulator {
 public:
  ExternalSimulator(const ExternalCommand& command, Clock clock);
  ExternalSimulator(const ExternalCommand& command, LineLimits limits, Clock clock);

  // The line in which it introduces itself; starts it if it does not run.  Errors: LineProgram's
  // and parse_declaration()'s, of code kNoProgram: none was asked for values.
  Result<std::string> introduce();

  void while_waiting(std::function<void()> call) { program_.while_waiting(std::move(call)); }

  // `declared`: the line that the problem was made with; a program that now declares something else
  // is an error of code kNoProgram.  Sets the request's id.  Errors name the program and what it
  // did, then in a second line how to ask it the same by hand, and leave it dead: the next question
  // starts it again.
  Result<ExternalAnswer> simulate(ExternalRequest& request, const std::string& declared) {
    return ask<ExternalAnswer>(request, declared);
  }
  Result<ExternalRunAnswer> simulate(ExternalRunRequest& request, const std::string& declared) {
    return ask<ExternalRunAnswer>(request, declared);
  }

 private:
  template <class Answer, class Request>
  Result<Answer> ask(Request& request, const std::string& declared);

  LineProgram program_;
  std::string introduction_;  // of the running program
  std::uint64_t asked_ = 0;
};

}  // namespace gapfarm
