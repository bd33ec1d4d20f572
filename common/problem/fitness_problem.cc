#include <cmath>

#include "common/base/try.h"
#include "common/problem/message_parts.h"

namespace gapfarm {
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
