#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/base/hash.h"
#include "common/problem/problem.h"
#include "common/robot/robot.h"
#include "common/trials/files.h"
#include "master/cli/diagnosis/diagnose_command.h"
#include "master/command/inputs.h"
#include "master/command/long_command.h"
#include "master/command/provenance.h"
#include "master/ground/diagnose_ground.h"
#include "master/ground/fit/fit_file.h"
#include "master/ground/fit/window_fit.h"
#include "master/ground/program_runs.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFits = "fits.jsonl";

// The folders of a log, or those that a run's model was fitted to.
Result<std::vector<std::string>> reference_folders(const std::vector<std::string>& named,
                                                   Console& console) {
  std::vector<std::string> folders;
  for (const std::string& name : named) {
    if (is_there(fs::path(name) / "commands.csv")) {
      folders.push_back(name);
      continue;
    }
    const auto model = read_model_of(name, console);
    if (!model) {
      return Error{"--reference " + name + ": neither a folder with commands.csv and poses.csv " +
                   "nor a run or model (" + model.error().message + ")"};
    }
    for (const std::string& folder : model->data.files) {
      if (is_there(fs::path(folder) / "commands.csv")) {
        folders.push_back(folder);
        continue;
      }
      return Error{"--reference " + name + ": the log that it was fitted to, " + folder +
                   ", is not there; name its folder instead"};
    }
  }
  return folders;
}

}  // namespace

Status read_reference(DiagnoseCommand* command, const Config& config, Console& console) {
  if (command->reference.empty()) return {};
  if (!config.problem.ground) {
    return Error{"--reference: asks what changed of a ground robot, but the scenario is " +
                 config.problem.scenario + "; diagnose both logs, or use crossfit"};
  }
  ASSIGN_OR_RETURN(const auto folders, reference_folders(command->reference, console));
  ASSIGN_OR_RETURN(
      command->reference_log,
      under("--reference", read_run_folders(folders, config.problem.ground->robot().channels)));
  for (const std::string& note : command->reference_log->notes) console.note("reference: " + note);
  return {};
}

std::string log_hash(const RunLog& log) {
  Hasher hasher;
  for (const LoggedRun& run : log.runs) {
    hasher.add(run.session).add(run.run);
    add_rows(run.commands, &hasher);
    add_rows(run.wheel_speeds, &hasher);
    for (const PoseRow& row : run.poses) {
      hasher.add(row.t_s).add(row.X_WM.x).add(row.X_WM.y).add(row.X_WM.theta);
    }
  }
  return hasher.finish();
}

Result<int> run_diagnose_runs(DiagnoseCommand& command, const Config& config,
                              const std::vector<Gene>& searched, const std::string& stamp,
                              CliContext& context) {
  const bool kinematic = config.problem.ground != nullptr;
  Problem problem = config.problem;
  ASSIGN_OR_RETURN(const auto runs, read_run_folders(config.trial_files, problem.channels()));
  if (command.reference_log && log_hash(*command.reference_log) == log_hash(runs)) {
    return Error{"--reference: found the log that is diagnosed, expected an earlier one"};
  }
  context.begun = true;
  RETURN_IF_ERROR(LongCommand::begin(
      "diagnose", {command.out}, {std::begin(kGroundStages), std::end(kGroundStages)}, context));
  ASSIGN_OR_RETURN(const auto page, open_page(command.page, command.out, context));
  const fs::path out(command.out);
  RETURN_IF_ERROR(command.outputs.write((out / kStampFile).string(), stamp));
  LongCommand& work = *context.work;
  GroundDiagnoseOptions options;
  options.excluded = command.exclude;
  options.seed = config.seed;
  options.windows.run_in_s = config.windows.run_in_s;
  options.reference = command.reference_log;
  options.on_stage = [&](const std::string& stage) { work.stage(stage); };
  options.on_finding = [&](Finding finding) { work.found(std::move(finding)); };
  options.on_progress = [&](std::size_t done, std::size_t total) { work.advance(done, total); };
  options.stopped = [&] { return context.stop.requested(); };
  std::optional<FitFile> fits;
  Outputs::NamedTexts files;
  std::string left;
  std::optional<GroundDiagnosis> result;
  if (kinematic) {
    const GroundRobot robot = problem.ground->robot_at(problem.values);
    fits.emplace(out / kFits);
    work.keeps_also("fitted", out / kFits);
    options.memo = &*fits;
    ASSIGN_OR_RETURN(result, diagnose_ground(robot, runs, options));
    files = {{"robot.toml", format_robot(result->corrected)},
             {"values.json", format_values({robot, config.trial_files, result->values,
                                            std::filesystem::current_path().string()})}};
    left = "robot.toml with what was named put in; next: gapfarm export ros " + command.out;
  } else {
    ASSIGN_OR_RETURN(const auto farm, start_recorded(command.farm, config.farm, context));
    const std::vector<Gene> tuned = command.model.empty() ? searched : std::vector<Gene>();
    ASSIGN_OR_RETURN(result, diagnose_program_runs(*farm, tuned, runs, options, &problem));
    Model model = model_of_problem(problem, problem.values);
    model.kind = "diagnosed";
    model.data = {problem_hash(to_proto(config.problem)), problem.log.trials.size(),
                  config.trial_files};
    files = {{"model.toml", format_model(model)}};
    left = "model.toml with what was tuned and named put in";
  }
  add_diagnosis_provenance(config, command, &result->diagnosis);
  for (const std::string& name : command.reference) {
    result->diagnosis.provenance.emplace_back("reference", name);
  }
  RETURN_IF_ERROR(leave_diagnosis(command, result->diagnosis, std::move(files), "and " + left,
                                  context.console));
  if (fits) fits->remove();
  return kExitDone;
}

}  // namespace gapfarm
