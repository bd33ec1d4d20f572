#include "master/command/run_model.h"

#include <filesystem>

#include "common/base/build_info.h"
#include "common/base/try.h"
#include "common/config/config.h"
#include "master/store/schema.h"

namespace gapfarm {
namespace {

Result<Model> find_model(const std::string& run_or_model, Console& console) {
  namespace fs = std::filesystem;
  const fs::path path(run_or_model);
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) return read_model(run_or_model);
  const fs::path file = path / "model.toml";
  std::optional<Model> left;
  if (fs::exists(file, ignored)) {
    Result<Model> model = read_model(file.string());
    if (!model) return model;
    left = std::move(*model);
  }
  if (!fs::exists(run_store_file(path), ignored)) {
    if (left) return *std::move(left);
    return Error{run_or_model +
                 ": has neither a model.toml nor a run in it; give a model file or "
                 "the folder of a run or a diagnosis"};
  }
  ASSIGN_OR_RETURN(const RunReader run, RunReader::open(path));
  // A finished run that was resumed has gone on from what it left.
  ASSIGN_OR_RETURN(const auto generations, run.generations());
  const std::uint64_t reached = generations.empty() ? 0 : generations.back().generation;
  if (left && left->origin.generation >= reached) return *std::move(left);
  Result<Model> model = current_best(run);
  if (!model) return model;
  console.note(run_or_model + ": this run is not finished; taking its best so far, " +
               run.info().fitness + " " + format_number(model->score) + " of generation " +
               std::to_string(model->origin.generation));
  return model;
}

}  // namespace

Status check_same_robot(const Model& model, const std::string& path, const Config& config,
                        const std::string& config_path) {
  if (model.scenario == config.problem.scenario && model.robot_file == config.problem.robot_file) {
    return {};
  }
  return Error{path + ": is a model of another scenario or robot than " + config_path +
               "; give the config that it was made with"};
}

Status check_no_residual(const Model& model, const std::string& path, const std::string& user) {
  if (model.residual.empty()) return {};
  return Error{path +
               ": the model has a [residual], a correction of trials' ends by their places, "
               "headings and times, which " +
               user + " does not take along; leave that section out of a copy, or give tuned.toml"};
}

Result<Model> read_model_of(const std::string& run_or_model, Console& console) {
  ASSIGN_OR_RETURN(Model model, find_model(run_or_model, console));
  RETURN_IF_ERROR(check_moves(model.scenario, run_or_model));
  return model;
}

}  // namespace gapfarm
