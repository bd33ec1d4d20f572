#include "common/problem/message_parts.h"

#include <cmath>

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
  ASSIGN_OR_RETURN(
      problem->external,
      under("problem", make_external_program(std::move(command), from.introduction(), objective)));
  return under("problem", check_program(*problem->external, *problem));
}

namespace {

constexpr unsigned kMostReplicates = 100000;

Error invalid_fitness(const std::string& what) { return Error{"problem: " + what}; }

Status check_objectives(const FitnessSettings& fitness) {
  const std::vector<SearchedObjective>& all = fitness.objectives;
  if (all.empty()) return {};
  if (all.size() < kLeastObjectives || all.size() > kMostObjectives) {
    return invalid_fitness("there must be between " + std::to_string(kLeastObjectives) + " and " +
                           std::to_string(kMostObjectives) + " objectives");
  }
  if (is_value(fitness.kind)) return {};
  for (const SearchedObjective& objective : all) {
    const bool known = objective.name == "position" || objective.name == "heading";
    if (!known || !comes_apart(fitness.kind)) {
      return invalid_fitness(
          "the objectives of trials are the log_score or the energy_score of position "
          "and of heading");
    }
  }
  return {};
}

}  // namespace

void write_fitness(const FitnessSettings& from, v1::Fitness* to) {
  to->set_kind(static_cast<v1::Fitness::Kind>(from.kind));
  to->set_outlier_share(from.outlier_share);
  to->set_roll_penalty(from.roll_penalty);
  to->set_pitch_penalty(from.pitch_penalty);
  to->set_heave_penalty(from.heave_penalty);
  to->set_rest_penalty(from.rest_penalty);
  to->set_rest_limit(from.rest_limit_s);
  for (const SearchedObjective& objective : from.objectives) {
    v1::SearchedObjective* added = to->add_objectives();
    added->set_name(objective.name);
    added->set_maximise(objective.maximise);
  }
}

FitnessSettings fitness_of_message(const v1::Fitness& from) {
  FitnessSettings to = {static_cast<FitnessKind>(from.kind()),
                        from.outlier_share(),
                        from.roll_penalty(),
                        from.pitch_penalty(),
                        from.heave_penalty(),
                        from.rest_penalty(),
                        from.rest_limit()};
  for (const v1::SearchedObjective& objective : from.objectives()) {
    to.objectives.push_back({objective.name(), objective.maximise()});
  }
  return to;
}

Status check_score(const FitnessSettings& fitness, const SpreadSettings& spread) {
  if (!(fitness.outlier_share >= 0 && fitness.outlier_share <= kMostOutliers)) {
    return invalid_fitness("the outlier share must be in [0, 0.5]");
  }
  for (const double value : {fitness.roll_penalty, fitness.pitch_penalty, fitness.heave_penalty,
                             fitness.rest_penalty, fitness.rest_limit_s}) {
    if (!(std::isfinite(value) && value >= 0)) {
      return invalid_fitness("penalties and the rest limit must be finite and not negative");
    }
  }
  RETURN_IF_ERROR(check_objectives(fitness));
  if (spread.kind == SpreadKind::kSampled &&
      !(spread.replicates >= 2 && spread.replicates <= kMostReplicates)) {
    return invalid_fitness("sampled spread needs between 2 and " + std::to_string(kMostReplicates) +
                           " replicates");
  }
  return {};
}

}  // namespace gapfarm
