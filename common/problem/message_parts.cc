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

namespace {

using RowByRow = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// A last row that breaks off is omitted, which check_residual() then misses.
Eigen::MatrixXd rows_of(const google::protobuf::RepeatedField<double>& numbers, int columns) {
  const int rows = columns > 0 ? numbers.size() / columns : 0;
  return Eigen::Map<const RowByRow>(numbers.data(), rows, columns);
}

void write_rows(const RowByRow& rows, google::protobuf::RepeatedField<double>* numbers) {
  numbers->Add(rows.data(), rows.data() + rows.size());
}

}  // namespace

void write_residual(const Problem& problem, v1::Problem* message) {
  if (auto outliers = problem.residual.outliers) {
    v1::OutlierDrives* to = message->mutable_outliers();
    to->set_kind(static_cast<std::uint32_t>(outliers->kind));
    for (const auto& [key, value] : outlier_values(*outliers)) {
      to->GetReflection()->SetDouble(to, to->GetDescriptor()->FindFieldByName(key), *value);
    }
  }
  for (const ResidualTerm& term : problem.residual.field) {
    v1::ResidualTerm* to = message->add_residual();
    to->set_frame(static_cast<std::uint32_t>(term.frame));
    to->set_by_drive(term.by_drive);
    for (const std::size_t c : term.covariates) to->add_covariates(static_cast<std::uint32_t>(c));
    for (const double length : term.lengths) to->add_lengths(length);
    write_rows(term.centres, to->mutable_centres());
    for (const ResidualWeights& w : term.weights) {
      v1::ResidualTerm::Weights* weights = to->add_weights();
      weights->set_command(w.command);
      write_rows(w.shifts, weights->mutable_shifts());
    }
  }
}

namespace {

Status read_outliers(const v1::Problem& message, Problem* problem) {
  if (!message.has_outliers()) return {};
  const v1::OutlierDrives& from = message.outliers();
  if (from.kind() >= outlier_kind_names().size()) {
    return Error{"problem: residual.strays of kind number " + std::to_string(from.kind()) +
                 "; master and worker must be the same build"};
  }
  OutlierDrives outliers;
  outliers.kind = static_cast<OutlierKind>(from.kind());
  for (const auto& [key, value] : outlier_values(outliers)) {
    *value = from.GetReflection()->GetDouble(from, from.GetDescriptor()->FindFieldByName(key));
  }
  RETURN_IF_ERROR(under("problem", check_outliers(outliers)));
  problem->residual.outliers = outliers;
  return {};
}

}  // namespace

Status read_residual(const v1::Problem& message, Problem* problem) {
  if (message.residual_size() == 0 && !message.has_outliers()) return {};
  if (!scenario_form(problem->scenario).residual) {
    return Error{"problem: scenario '" + problem->scenario +
                 "' takes no residual; leave [residual] out of its model"};
  }
  for (const v1::ResidualTerm& from : message.residual()) {
    ResidualTerm term;
    if (from.frame() >= residual_frame_names().size()) {
      return Error{"problem: a residual of frame number " + std::to_string(from.frame()) +
                   "; master and worker must be the same build"};
    }
    term.frame = static_cast<ResidualFrame>(from.frame());
    term.by_drive = from.by_drive();
    term.covariates.assign(from.covariates().begin(), from.covariates().end());
    term.lengths.assign(from.lengths().begin(), from.lengths().end());
    term.centres = rows_of(from.centres(), from.covariates_size());
    for (const v1::ResidualTerm::Weights& w : from.weights()) {
      term.weights.push_back({w.command(), rows_of(w.shifts(), 3)});
    }
    problem->residual.field.push_back(std::move(term));
  }
  RETURN_IF_ERROR(read_outliers(message, problem));
  return under("problem",
               check_residual(problem->residual.field, command_names(problem->commands)));
}

}  // namespace gapfarm
