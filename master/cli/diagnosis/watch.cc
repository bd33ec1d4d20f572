// gapfarm watch DIR: many runs of several robots of one kind: what changed since when, and of
// which.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "common/base/hash.h"
#include "common/base/ranges.h"
#include "common/robot/robot.h"
#include "common/trials/files.h"
#include "master/cli/subcommand.h"
#include "master/command/outputs.h"
#include "master/command/provenance.h"
#include "master/ground/fit/fit_file.h"
#include "master/ground/fit/wheel_loop.h"
#include "master/ground/watch/changes.h"
#include "master/ground/watch/watch_report.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFittedRuns = "runs.jsonl";
constexpr const char* kRobotFile = "robot.toml";
constexpr const char* kFitVersion = "3";  // of fit_run_values(): what it gave before is made anew
constexpr double kEpoch_s = 1e8;          // times from here on are those of a calendar's clock

struct WatchCommand {
  std::string folder;
  std::string robot;
  std::string out;
  std::uint64_t seed = 1;
  Outputs outputs;
};

struct RunFolder {
  fs::path path;
  std::string name;
  RunLog log = {};
  std::string fault = {};  // why it cannot be read
  double begin_s = 0;      // of one that cannot be read, that of the one before by name
};

struct RobotFolder {
  std::string name;
  fs::path path;
  GroundRobot robot;
  std::vector<RunFolder> runs;
};

bool is_run(const fs::path& folder) {
  return is_there(folder / "commands.csv") || is_there(folder / "poses.csv");
}

std::vector<std::string> folders_in(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    if (entry.is_directory(ignored)) names.push_back(entry.path().filename().string());
  }
  std::ranges::sort(names, comes_before);
  return names;
}

// DIR/ROBOT/RUN; of one robot DIR/RUN.
std::vector<RobotFolder> find_robots(const fs::path& folder) {
  std::vector<RobotFolder> robots;
  RobotFolder own{fs::absolute(folder / ".").lexically_normal().parent_path().filename().string(),
                  folder,
                  {},
                  {}};
  for (const std::string& name : folders_in(folder)) {
    if (is_run(folder / name)) {
      own.runs.push_back({folder / name, name});
      continue;
    }
    RobotFolder robot{name, folder / name, {}, {}};
    for (const std::string& run : folders_in(folder / name)) {
      if (is_run(folder / name / run)) robot.runs.push_back({folder / name / run, run});
    }
    if (!robot.runs.empty()) robots.push_back(std::move(robot));
  }
  if (!own.runs.empty()) robots.insert(robots.begin(), std::move(own));
  return robots;
}

// Of each robot its own file, else one for all.
Status read_robots(const WatchCommand& command, std::vector<RobotFolder>* robots) {
  for (RobotFolder& robot : *robots) {
    fs::path file = command.robot;
    if (file.empty()) file = robot.path / kRobotFile;
    if (!is_there(file)) file = fs::path(command.folder) / kRobotFile;
    if (command.robot.empty() && !is_there(file)) {
      const bool one = robot.path == fs::path(command.folder);
      return Error{"found no robot file for " + robot.name + ": put robot.toml into " +
                   command.folder + (one ? "" : " (one for all) or " + robot.path.string()) +
                   ", or name it with --robot"};
    }
    ASSIGN_OR_RETURN(robot.robot,
                     read_robot(command.robot.empty() ? file.string() : command.robot));
  }
  return {};
}

std::string kind_of(const GroundRobot& robot) {
  return drive_names()[static_cast<std::size_t>(robot.drive)] + " commanded by " +
         joined(robot.channels, " ");
}

// Robots of another kind than most are omitted.
void keep_one_kind(std::vector<RobotFolder>* robots, WatchedFleet* fleet) {
  const auto alike = [&](const std::string& kind) {
    return std::ranges::count(*robots, kind, [](auto& one) { return kind_of(one.robot); });
  };
  std::string most = kind_of(robots->front().robot);
  for (const RobotFolder& robot : *robots) {
    if (alike(kind_of(robot.robot)) > alike(most)) most = kind_of(robot.robot);
  }
  std::erase_if(*robots, [&](const RobotFolder& robot) {
    if (kind_of(robot.robot) == most) return false;
    fleet->skipped.push_back({robot.name, "",
                              "another kind of robot: " + kind_of(robot.robot) + ", and most are " +
                                  most + "; watch it by itself"});
    return true;
  });
}

void read_logs(std::vector<RobotFolder>* robots, WatchedFleet* fleet) {
  for (RobotFolder& robot : *robots) {
    bool dated = true;
    double begin_s = 0;
    for (RunFolder& run : robot.runs) {
      const std::vector<std::string> folder = {run.path.string()};
      auto log = read_run_folders(folder, robot.robot.channels);
      if (log) {
        for (const std::string& note : log->notes) {
          fleet->notes.push_back(robot.name + "/" + run.name + ": " + note);
        }
        run.log = std::move(*log);
        begin_s = run.log.runs.front().poses.front().t_s;
        dated = dated && begin_s > kEpoch_s;
      } else {
        run.fault = log.error().message;
      }
      run.begin_s = begin_s;
    }
    // Runs at one time stay by name.
    if (dated) std::ranges::stable_sort(robot.runs, {}, &RunFolder::begin_s);
  }
}

// Fits what is not in the cache.  Errors: stopped.
Status fit_runs(std::vector<RobotFolder>* robots, const fs::path& cache_file, CliContext& context,
                WatchedFleet* fleet) {
  RunCache cache(cache_file);
  const bool by_wheels = std::ranges::all_of(*robots, [](const RobotFolder& robot) {
    return std::ranges::all_of(robot.runs, [&](const RunFolder& run) {
      return !run.fault.empty() || has_wheel_speeds(robot.robot, run.log);
    });
  });
  std::size_t all = 0, done = 0;
  std::map<std::string, std::string> seen;  // logs, and whose they are
  for (const RobotFolder& robot : *robots) all += robot.runs.size();
  for (RobotFolder& robot : *robots) {
    WatchedRobot& to = fleet->robots.emplace_back(WatchedRobot{robot.name});
    const auto reject = [&](const RunFolder& run, const std::string& why) {
      to.rejected.push_back({robot.name, run.name, why});
      fleet->skipped.push_back(to.rejected.back());
    };
    for (RunFolder& run : robot.runs) {
      ++done;
      if (!run.fault.empty()) {
        reject(run, run.fault);
        continue;
      }
      if (context.stop.requested()) return Error{"stopped", ErrorCode::kStopped};
      const auto [first, fresh] = seen.try_emplace(log_hash(run.log), robot.name + "/" + run.name);
      if (!fresh) {  // copied, or linked
        fleet->skipped.push_back({robot.name, run.name, "repeats " + first->second});
        continue;
      }
      const GroundRobot driven = by_wheels ? driven_by_wheels(robot.robot, run.log) : robot.robot;
      const RunLog log = by_wheels ? driven_by_wheels(std::move(run.log)) : std::move(run.log);
      const std::string key =
          Hasher().add(kFitVersion).add(format_robot(driven)).add(log_hash(log)).finish();
      std::optional<Result<OffsetFit>> fit = cache.find(key);
      const bool now = !fit;
      if (now) {
        context.console.progress(
            fmt::format("fitting run {} of {}: {}/{}", done, all, robot.name, run.name));
        fit = fit_run_values(driven, log, {{0.5, 2, 5}, 0.5});
        cache.keep(key, *fit);
      }
      if (!*fit) {
        reject(run, fit->error().message);
        continue;
      }
      fleet->fitted += now ? 1 : 0;
      to.runs.push_back(run.name);
      to.fits.push_back(**fit);
      to.times_s.push_back(run.begin_s);
      to.rejected.clear();
    }
  }
  context.console.clear_progress();
  std::erase_if(fleet->robots, [](const WatchedRobot& robot) { return robot.runs.empty(); });
  return {};
}

// Of each robot's runs, where all are dates that rise; else none.
std::vector<std::vector<double>> dates_of(const WatchedFleet& fleet) {
  std::vector<std::vector<double>> times = mapped(fleet.robots, &WatchedRobot::times_s);
  const bool dated = std::ranges::all_of(times, [](const std::vector<double>& of_robot) {
    return of_robot.front() > kEpoch_s &&
           std::ranges::adjacent_find(of_robot, std::greater_equal<>()) == of_robot.end();
  });
  if (!dated) times.clear();
  return times;
}

Result<int> run_watch(WatchCommand& command, CliContext& context) {
  const fs::path out(command.out);
  std::error_code ignored;
  for (const char* name : {"watch.json", "report.html"}) {
    const std::string path = (out / name).string();
    // What it made itself it makes again.
    RETURN_IF_ERROR(is_there(out / kFittedRuns) ? command.outputs.plan_again(path)
                                                : command.outputs.plan(path));
  }
  std::vector<RobotFolder> robots = find_robots(command.folder);
  if (robots.empty()) {
    return Error{command.folder + ": found no runs; a run is a folder ROBOT/RUN in it with " +
                 "commands.csv and poses.csv"};
  }
  RETURN_IF_ERROR(read_robots(command, &robots));
  WatchedFleet fleet;
  keep_one_kind(&robots, &fleet);
  read_logs(&robots, &fleet);
  fs::create_directories(out, ignored);
  context.begun = true;
  if (Status s = fit_runs(&robots, out / kFittedRuns, context, &fleet); !s) {
    if (s.error().code != ErrorCode::kStopped) return s.error();
    context.console.note("stopped; fits are kept in " + (out / kFittedRuns).string() +
                         ", and the same command goes on");
    return kExitResumable;
  }
  if (fleet.robots.empty()) {
    for (const WatchedSkip& skip : fleet.skipped) context.console.note(skip_text(skip));
    return Error{command.folder + ": no run could be fitted"};
  }
  fleet.rows = watched_rows(robots.front().robot);
  const FleetChanges changes = find_changes(fleet.rows, mapped(fleet.robots, &WatchedRobot::fits),
                                            command.seed, dates_of(fleet));
  const Json json = watch_json(fleet, changes);
  RETURN_IF_ERROR(command.outputs.write_in(
      command.out,
      {{"watch.json", json.dump(2) + "\n"}, {"report.html", watch_page(fleet, changes)}}));
  for (const std::string& note : fleet.notes) context.console.note(note);
  context.console.result(watch_text(fleet, changes), json);
  context.console.note("wrote: " + command.out + "/watch.json, report.html");
  return something_changed(fleet, changes) ? kExitChanged : kExitDone;
}

}  // namespace

SubcommandRun setup_watch(CLI::App& app) {
  auto command = std::make_shared<WatchCommand>();
  app.add_option("DIR", command->folder, "Folders ROBOT/RUN with commands.csv and poses.csv")
      ->required();
  app.add_option("--robot", command->robot,
                 "Robot file of all (default: robot.toml of a robot's folder, else of DIR)");
  app.add_option("--out", command->out, "Folder for watch.json, report.html and the runs' fits")
      ->required();
  app.add_option("--seed", command->seed, "Of the draws behind thresholds")->capture_default_str();
  command->outputs.declare(app);
  app.footer(
      "Each run is fitted once; another call fits what is new. Exit code 0: nothing changed,\n"
      "4: something did.\n\n"
      "Examples:\n"
      "  gapfarm watch fleet --out watched\n"
      "  gapfarm watch fleet --robot husky_robot.toml --out watched --json");
  return [command](CliContext& context) { return run_watch(*command, context); };
}

}  // namespace gapfarm
