#include "common/problem/message_parts.h"

namespace gapfarm {

void write_external(const Problem& problem, v1::Problem* message) {
  if (!problem.external) return;
  v1::External* to = message->mutable_external();
  for (const std::string& word : problem.external->command.argv) to->add_argv(word);
  to->set_folder(problem.external->command.folder);
  to->set_answer_limit(problem.external->command.answer_limit_s);
  to->set_introduction(problem.external->introduction);
}

Status check_program(const ExternalProgram& program, const Problem& problem) {
  const bool follows = !program.table.declaration().channels.empty();
  if (follows == problem.windows()) return {};
  return Error{"external program '" + program.command.argv[0] +
               (follows ? "' declares channels, so it follows runs: say scenario = "
                          "\"external_runs\""
                        : "' declares no channels (\"channels\": [\"forward\", \"turn\"], say), "
                          "which scenario external_runs needs")};
}

Status read_external(const v1::Problem& message, Problem* problem) {
  const bool objective = scenario_form(problem->scenario).objective;
  const bool value = is_value(static_cast<FitnessKind>(message.fitness().kind()));
  if (objective != value || (objective && message.commands_size() > 0)) {
    return Error{"problem: scenario '" + problem->scenario + "' has no " +
                 (objective == value ? "commands" : "fitness of that kind")};
  }
  const bool wanted = scenario_form(problem->scenario).program;
  if (wanted != message.has_external()) {
    return Error{"problem: scenario '" + problem->scenario + "' " + (wanted ? "needs" : "has no") +
                 " external program"};
  }
  if (!wanted) return {};
  const v1::External& from = message.external();
  ExternalCommand command{
      {from.argv().begin(), from.argv().end()}, from.folder(), from.answer_limit()};
  if (!(command.answer_limit_s > 0 && command.answer_limit_s <= 1e6)) {
    return Error{"problem: an external program's answer limit must be in (0, 1000000] s"};
  }
  auto program = make_external_program(std::move(command), from.introduction(), objective);
  if (!program) return Error{"problem: " + program.error().message};
  if (Status s = check_program(**program, *problem); !s) {
    return Error{"problem: " + s.error().message};
  }
  problem->external = std::move(*program);
  return {};
}

}  // namespace gapfarm
