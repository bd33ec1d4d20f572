#include "common/external/simulator.h"

#include <algorithm>
#include <atomic>

#include "common/base/try.h"

namespace gapfarm {
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

ExternalSimulator::ExternalSimulator(const ExternalCommand& command, LineProgram::Clock clock)
    : ExternalSimulator(command, limits_of(command), clock) {}

ExternalSimulator::ExternalSimulator(const ExternalCommand& command, LineLimits limits,
                                     LineProgram::Clock clock)
    : program_(command.argv, command.folder, limits, clock) {}

Result<std::string> ExternalSimulator::introduce() {
  if (program_.running()) return introduction_;
  const Result<std::string> line = program_.ask(hello_line());
  if (!line) return line;
  if (const auto declaration = parse_declaration(*line); !declaration) {
    program_.kill();
    return Error{"external program '" + program_.name() + "' " + declaration.error().message};
  }
  introduction_ = *line;
  return introduction_;
}

template <class Answer, class Request>
Result<Answer> ExternalSimulator::ask(Request& request, const std::string& declared) {
  ASSIGN_OR_RETURN(const std::string introduction, introduce());
  if (introduction != declared) {
    program_.kill();
    return Error{"external program '" + program_.name() +
                 "' declares other things than when the problem was made; check the config again, "
                 "and give every machine the same program"};
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
