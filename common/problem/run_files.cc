#include "common/problem/run_files.h"

#include <filesystem>

#include "common/base/ranges.h"
#include "common/recordings/read.h"
#include "common/recordings/windows.h"

namespace gapfarm {

std::vector<std::string> command_names(const std::vector<CommandSpec>& commands) {
  return mapped(commands, &CommandSpec::name);
}

Result<RunLog> read_run_folders(std::span<const std::string> folders,
                                std::span<const std::string> channels) {
  RunLog all;
  for (const std::string& folder : folders) {
    const std::filesystem::path path(folder);
    ASSIGN_OR_RETURN(auto log, read_runs((path / "commands.csv").string(),
                                         (path / "poses.csv").string(), channels));
    log.wheel_channels = all.wheel_channels;
    const std::filesystem::path wheels = path / "wheels.csv";
    if (std::error_code none; std::filesystem::exists(wheels, none)) {
      RETURN_IF_ERROR(read_wheel_speeds(wheels.string(), &log));
    }
    for (const auto& [name, read] :
         {std::pair{"gyro.csv", &read_yaw_rates}, {"returns.csv", &read_returns}}) {
      const std::filesystem::path beside = path / name;
      if (std::error_code none; std::filesystem::exists(beside, none)) {
        RETURN_IF_ERROR(read(beside.string(), &log));
      }
    }
    all.wheel_channels = log.wheel_channels;
    all.relative = all.relative || log.relative;
    for (LoggedRun& run : log.runs) {
      // Runs of two folders may bear one name.
      if (folders.size() > 1 && run.session.empty()) run.session = path.filename().string();
      all.runs.push_back(std::move(run));
    }
    all.notes.insert(all.notes.end(), log.notes.begin(), log.notes.end());
  }
  return all;
}

Status read_problem_runs(std::span<const std::string> folders, const WindowSettings& windows,
                         Problem* problem) {
  ASSIGN_OR_RETURN(const auto all, read_run_folders(folders, problem->channels()));
  ASSIGN_OR_RETURN(auto cut, cut_windows(all, windows));
  if (problem->ground) {
    const GroundRobot& robot = problem->ground->robot();
    if (is_throttled(robot)) {
      cut = restart_at_measured_speed(all, std::move(cut), windows.run_in_s, kWindowMargin_s);
    }
    cut.log.notes.insert(cut.log.notes.end(), robot.notes.begin(), robot.notes.end());
  }
  problem->runs = std::move(cut.runs);
  problem->log = std::move(cut.log);
  const Result<Problem> sound = from_proto(to_proto(*problem));
  return sound ? Status() : Status(sound.error());
}

}  // namespace gapfarm
