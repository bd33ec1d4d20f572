// A simulator of the user's, asked for one motion at a time.
#pragma once

#include <functional>
#include <string>
#include <utility>

#include "common/base/result.h"
#include "common/external/line_program.h"
#include "common/external/protocol.h"

namespace gapfarm {

// Whether this process may start the programs that problems name: they come from whoever is the
// master.  False until it is reported.
void allow_external_programs(bool allowed);
bool external_programs_allowed();

class ExternalSimulator {
 public:
  ExternalSimulator(const ExternalCommand& command, LineProgram::Clock clock);
  ExternalSimulator(const ExternalCommand& command, LineLimits limits, LineProgram::Clock clock);

  // The line in which it introduces itself; starts it if it does not run.  Errors: LineProgram's
  // and parse_declaration()'s.
  Result<std::string> introduce();

  void while_waiting(std::function<void()> call) { program_.while_waiting(std::move(call)); }

  // `declared`: the line that the problem was made with; a program that now declares something else
  // is an error.  Sets the request's id.  Errors name the program and what it did, then in a second
  // line how to ask it the same by hand, and leave it dead: the next question starts it again.
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
