#include "master/run/validation.h"

#include <algorithm>
#include <filesystem>

#include "common/base/try.h"
#include "common/config/config.h"
#include "common/problem/run_files.h"
#include "common/trials/read.h"
#include "master/evolve/evolve.h"

namespace gapfarm {

Result<std::optional<Problem>> read_validation(const StagePlan& plan, const Config& config) {
  if (plan.validation_files.empty()) return std::optional<Problem>();
  for (const std::string& file : plan.validation_files) {
    const auto same = [&](const std::string& other) {
      std::error_code code;
      return file == other || std::filesystem::equivalent(file, other, code);
    };
    if (std::any_of(config.trial_files.begin(), config.trial_files.end(), same)) {
      return Error{file + " is both evolved on and held out; a validation takes other trials"};
    }
  }
  Problem apart = config.problem;
  if (apart.windows()) {
    const Status read = read_problem_runs(plan.validation_files, config.windows, &apart);
    if (!read) return read.error();
    return std::optional<Problem>(std::move(apart));
  }
  ASSIGN_OR_RETURN(auto log,
                   read_trial_files(plan.validation_files, command_names(config.problem.commands)));
  apart.log = std::move(log);
  return std::optional<Problem>(std::move(apart));
}

Status check_runnable(const Config& config) {
  RETURN_IF_ERROR(check_evolvable(config));
  ASSIGN_OR_RETURN(const auto plan, read_stages(config));
  const auto log = read_validation(plan, config);
  return log ? Status() : Status(log.error());
}

Result<std::vector<Validated>> validate(Farm& farm, const Problem& apart,
                                        const std::vector<Genome>& stages, const Genome& best) {
  std::vector<Validated> rows = {{"the config's own values", {}}};
  std::vector<Genome> genomes = {{}};
  for (std::size_t i = 0; i < stages.size(); ++i) {
    rows.push_back({"after stage " + std::to_string(i + 1), {}});
    genomes.push_back(stages[i]);
  }
  rows.push_back({"the best", {}});
  genomes.push_back(best);
  std::vector<v1::Task> tasks;
  for (const Genome& genome : genomes) tasks.push_back(evaluation_task({0, 0, genome}, 0));
  ASSIGN_OR_RETURN(const auto results, farm.run(farm.add_problem(to_proto(apart)), tasks));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (results[i].outcome() == v1::OK) rows[i].fitness = results[i].evaluate().fitness();
  }
  return rows;
}

}  // namespace gapfarm
