#include "master/cli/serve_drive.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/json/json.h"
#include "common/score/motion_model.h"
#include "master/cli/inputs.h"
#include "master/cli/run_model.h"
#include "master/cli/run_page.h"
#include "master/experiment/plan.h"
#include "master/store/run_reader.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kPlayedInterval_s = 0.02;
constexpr std::size_t kMostPlayed = 400;  // samples of a path
constexpr std::size_t kMostKept = 200;    // answers

// More digits than a screen can show would only be sent.
double micro(double value) { return std::round(1e6 * value) / 1e6; }

Json path_json(const std::vector<PathSample>& path, const Pose& X_WS) {
  Json list = Json::array();
  const std::size_t each = std::max<std::size_t>(1, (path.size() + kMostPlayed - 1) / kMostPlayed);
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (i % each != 0 && i + 1 != path.size()) continue;
    const Pose X_SP = between(X_WS, path[i].pose);
    list.push_back({path[i].t_s, micro(X_SP.x), micro(X_SP.y), micro(X_SP.theta)});
  }
  return list;
}

// Where a drive's path was not logged, its end alone.
Json measured_json(const Trial& trial, double duration_s) {
  if (trial.path.size() > 1) return path_json(trial.path, trial.X_WS);
  const Pose X_SE = between(trial.X_WS, trial.X_WE);
  return Json::array({{duration_s, X_SE.x, X_SE.y, X_SE.theta}});
}

// Overrides that take everything random out of `values`, the problem's own.
std::vector<v1::Override> muted(const Problem& problem, ParameterValues values) {
  const ParameterTable& table = problem.table();
  table.without_chance(&values);
  std::vector<v1::Override> overrides;
  const auto set = [&](std::size_t row, double value) {
    v1::Override& to = overrides.emplace_back();
    to.set_parameter(static_cast<std::uint32_t>(row));
    to.set_value(value);
  };
  for (std::size_t row = 0; row < table.size(); ++row) {
    const std::string& key = table[row].key;
    const bool noise = key.starts_with("drive_noise_") || key.starts_with("pose_noise_");
    const double value = noise ? table[row].lower : values[row];
    if (value != problem.values[row]) set(row, value);
  }
  return overrides;
}

v1::Task drive_task(const Problem& problem, const Trial& trial, const ParameterValues& values) {
  v1::PlannedTrial planned;
  *planned.mutable_trial() = to_proto(trial);
  planned.mutable_trial()->clear_path();
  planned.set_moved(true);
  return simulate_tasks({{planned}}, muted(problem, values), 1, kPlayedInterval_s)[0];
}

struct BestOf {
  StoredIndividual individual;
  std::uint64_t generation = 0;
};

Result<BestOf> best_of(const RunReader& reader, std::optional<std::uint64_t> generation) {
  if (!generation) {
    const auto generations = reader.generations();
    if (!generations) return generations.error();
    if (generations->empty()) return Error{"no generation was completed yet; look again later"};
    generation = generations->back().generation;
  }
  const auto individuals = reader.individuals(*generation);
  if (!individuals) return individuals.error();
  if (individuals->empty()) {
    return Error{"the run has no generation " + std::to_string(*generation)};
  }
  if (individuals->front().outcome != "OK") return Error{"nothing of it ended well"};
  return BestOf{individuals->front(), *generation};
}

// Those that were evolved on, then those that were kept apart, where they can still be read.
std::vector<Trial> all_trials(const RunInfo& info, const Problem& problem) {
  std::vector<Trial> all = problem.log.trials;
  const auto apart = trials_kept_apart(info, problem);
  if (apart && *apart) all.insert(all.end(), (*apart)->trials.begin(), (*apart)->trials.end());
  return all;
}

std::string title_of(const Trial& trial, std::size_t number) {
  return fmt::format("Trial {} ({}, {} of session {})", number, trial.command, trial.trial,
                     trial.session);
}

}  // namespace

Result<std::string> DriveShower::show(const DriveQuestion& question) {
  const auto reader = RunReader::open(question.run);
  if (!reader) return reader.error();
  const auto problem = stored_problem(*reader);
  if (!problem) return problem.error();
  if (!problem->pieces.empty()) return Error{"pushes of pieces have no drive to show"};
  const auto trials = all_trials(reader->info(), *problem);
  if (question.trial >= trials.size()) {
    return Error{
        fmt::format("the run has {} trials, those that it kept apart included, and no "
                    "trial {}",
                    trials.size(), question.trial + 1)};
  }
  const bool apart = question.trial >= problem->log.trials.size();
  const auto best = best_of(*reader, question.generation);
  if (!best) return best.error();
  const std::string key =
      fmt::format("{}|{}|{}|{}", question.run.string(), reader->info().problem_hash, question.trial,
                  best->individual.birth_id);
  if (const auto known = shown_.find(key); known != shown_.end()) return known->second;
  if (!farm_) {
    FarmOptions local;
    local.workers = 1;
    auto farm = start_farm(local, {}, context_);
    if (!farm) return farm.error();
    farm_ = *std::move(farm);
  }
  const Trial& trial = trials[question.trial];
  const auto results =
      farm_->run(farm_->add_problem(to_proto(*problem)),
                 {drive_task(*problem, trial, problem->values),
                  drive_task(*problem, trial, problem->values_of(best->individual.genome))});
  if (!results) return results.error();
  const double duration_s = resolved_command(trial, problem->commands).duration_s;
  Json json = {{"title", title_of(trial, question.trial + 1) + (apart ? ", kept apart" : "")},
               {"kept_apart", apart},
               {"duration_s", duration_s},
               {"measured", measured_json(trial, duration_s)}};
  std::string failed;
  const char* const names[] = {"before", "best"};
  for (std::size_t k = 0; k < results->size(); ++k) {
    const v1::TaskResult& result = (*results)[k];
    if (result.outcome() != v1::OK) {
      failed += fmt::format(" {} ends with {}.", names[k], v1::Outcome_Name(result.outcome()));
      continue;
    }
    const Trial simulated = from_proto(result.simulate().trials(0));
    json[names[k]] = path_json(simulated.path, simulated.X_WS);
  }
  json["said"] = fmt::format(
      "Best: genome {} of generation {}, {} {}.{}", best->individual.birth_id, best->generation,
      reader->info().fitness,
      best->individual.fitness ? fmt::format("{:.6g}", *best->individual.fitness) : "unknown",
      failed);
  json["note"] = std::string(apart ? "▲ Kept apart: evolution never saw this trial. " : "") +
                 (trial.path.size() > 1 ? ""
                                        : "Faint: no path was measured, an arc joins the start to "
                                          "the measured end.");
  if (shown_.size() >= kMostKept) shown_.clear();
  return shown_[key] = json_text(json);
}

}  // namespace gapfarm
