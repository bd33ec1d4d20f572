// gapfarm drive RUN|MODEL: a list of commands or way-points, many times.
#include "master/experiments/drive/drive.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "common/base/ranges.h"
#include "common/trials/text/csv.h"
#include "master/cli/subcommand.h"
#include "master/command/outputs.h"

namespace gapfarm {
namespace {

constexpr double kSpacing_m = 0.02;  // between points of paths that are compared

struct DriveCommand : LongOptions {
  std::string model;
  std::vector<std::string> commands, waypoints, mined;
  TrialOptions reading;
  std::string start = "0,0,0";
  std::string log;  // blendersim's
  unsigned runs = 200;
  double coverage = 0.9;
  DriveSettings settings;
};

struct Task {
  Pose start;
  std::vector<CommandSpec> commands;     // either these
  std::vector<Eigen::Vector2d> targets;  // or those
  std::vector<PathPoint> real;
};

Result<std::vector<double>> numbers(const std::string& text, std::size_t count,
                                    const std::string& what) {
  const auto found = mapped(parts_of(text, ','),
                            [](std::string_view part) { return parse_double(part).value_or(NAN); });
  if (found.size() != count ||
      !std::ranges::all_of(found, [](double v) { return std::isfinite(v); })) {
    return Error{what + " is '" + text + "', expected " + std::to_string(count) +
                 " numbers with commas between"};
  }
  return found;
}

// "forward" or "turn_ccw:0.5".
Result<CommandSpec> command_of(const std::string& text, const std::vector<CommandSpec>& known) {
  const auto [name, duration] = cut_at(text, ':');
  const CommandSpec* spec = find_by(known, name, &CommandSpec::name);
  if (!spec) {
    return Error{"there is no command '" + name + "'" + suggestion(name, command_names(known))};
  }
  if (!duration) return *spec;
  ASSIGN_OR_RETURN(const auto seconds, numbers(*duration, 1, "the duration of " + name));
  if (!(seconds[0] > 0 && seconds[0] <= kLongestCommand_s)) {
    return Error{fmt::format("command '{}' lasts outside (0, {:g}] s", text, kLongestCommand_s)};
  }
  CommandSpec command = *spec;
  command.duration_s = seconds[0];
  return command;
}

Result<Task> read_task(const DriveCommand& command, const Model& model) {
  if (command.commands.empty() + command.waypoints.empty() + command.log.empty() != 2) {
    return Error{"give one of --commands, --waypoints and --log"};
  }
  Task task;
  ASSIGN_OR_RETURN(const auto start, numbers(command.start, 3, "--start"));
  if (std::abs(start[2]) > 2 * std::numbers::pi) {
    return Error{"--start is '" + command.start + "': a heading of " +
                 fmt::format("{:g}", start[2]) +
                 " rad is more than a turn; degrees are multiplied by pi/180 first"};
  }
  task.start = {start[0], start[1], wrap_angle(start[2])};
  for (const std::string& text : command.commands) {
    ASSIGN_OR_RETURN(const auto spec, command_of(text, model.commands));
    task.commands.push_back(spec);
  }
  for (const std::string& text : command.waypoints) {
    ASSIGN_OR_RETURN(const auto xy, numbers(text, 2, "a way-point"));
    task.targets.emplace_back(xy[0], xy[1]);
  }
  if (command.log.empty()) return task;
  ASSIGN_OR_RETURN(const auto log, read_waypoint_log(command.log));
  task.start = log.path.front().pose;
  task.targets = log.targets;
  task.real = floor_path(log.path, kSpacing_m);
  return task;
}

// How far the straight lines between the targets are from the real path.
std::optional<RealDistances> targets_to_real(const Task& task) {
  if (task.real.empty()) return std::nullopt;
  std::vector<PathSample> lines = {{0, task.start}};
  for (const Eigen::Vector2d& target : task.targets) {
    const Pose from = lines.back().pose;
    const double length = std::hypot(target.x() - from.x, target.y() - from.y);
    const int steps = std::max(1, static_cast<int>(length / kSpacing_m));
    for (int i = 1; i <= steps; ++i) {
      const double share = static_cast<double>(i) / steps;
      lines.push_back(
          {0, {from.x + share * (target.x() - from.x), from.y + share * (target.y() - from.y), 0}});
    }
  }
  const std::vector<DrivenRun> straight = {{Leg{{}, lines}}};
  return distances_to(straight, task.real, 0);
}

Result<DriveReport> drive_all(const DriveCommand& command, const Task& task, const Problem& problem,
                              const TrialLog& log, Farm& farm) {
  const DriveSettings& settings = command.settings;
  DriveReport report{command.coverage, {}, task.real, task.targets, targets_to_real(task)};
  const auto add = [&](const std::string& name, Result<std::vector<DrivenRun>> runs, bool spread) {
    if (!runs) return Status(runs.error());
    DriverReport& driver = report.drivers.emplace_back();
    driver.name = name;
    driver.runs = *std::move(runs);
    driver.end = end_ellipse(driver.runs, command.coverage);
    if (spread) driver.band = path_band(driver.runs, command.coverage);
    if (!task.real.empty()) driver.real = distances_to(driver.runs, task.real, kSpacing_m);
    return Status();
  };
  // `rates`: what a pilot would have measured of the robot that the mover moves.
  const auto drive = [&](const Mover& mover, const std::vector<ConstantVelocity>& rates,
                         unsigned runs) -> Result<std::vector<DrivenRun>> {
    if (task.targets.empty()) return drive_commands(mover, task.start, task.commands, runs);
    ASSIGN_OR_RETURN(const auto pilot, make_pilot(rates));
    return drive_waypoints(mover, pilot, task.start, task.targets, runs);
  };
  ASSIGN_OR_RETURN(auto constant, nominal_velocities(farm, problem));
  RETURN_IF_ERROR(
      add("simulation",
          task.targets.empty()
              ? drive_commands(farm, problem, task.start, task.commands, command.runs, settings)
              : drive(simulated_mover(farm, problem, settings), constant, command.runs),
          true));
  if (!command.mined.empty()) {
    ASSIGN_OR_RETURN(constant, constant_velocities(log, problem.commands));
    ASSIGN_OR_RETURN(const auto mined, MotionModel::mine(log, problem.commands));
    const auto mover = mined_mover(mined, settings);
    RETURN_IF_ERROR(add("mined motion model", drive(mover, constant, command.runs), true));
  }
  const auto mover = constant_velocity_mover(constant, settings);
  RETURN_IF_ERROR(add("constant velocity", drive(mover, constant, 2), false));
  return report;
}

Json to_json(const DriveReport& report) {
  Json drivers = Json::array();
  for (const DriverReport& d : report.drivers) {
    Json driver = {{"name", d.name}, {"runs", d.runs.size()}};
    if (d.real) {
      for (std::size_t k = 0; k < d.real->size(); ++k) {
        driver["to_real_m"][kPathDistances[k].name] = (*d.real)[k].median;
      }
    }
    Json ends = Json::array();
    for (const DrivenRun& run : d.runs) {
      if (run.empty() || run.back().path.empty()) continue;
      const Pose end = run.back().path.back().pose;
      ends.push_back({end.x, end.y, end.theta});
    }
    driver["ends"] = std::move(ends);
    drivers.push_back(std::move(driver));
  }
  return {{"coverage", report.coverage}, {"drivers", std::move(drivers)}};
}

constexpr const char* kBand = "band.csv";
constexpr const char* kEnds = "ends.csv";
constexpr const char* kPage = "drive.html";

Status plan_outputs(DriveCommand& command) {
  command.outputs.reads(command.model);
  command.outputs.reads(command.log);
  for (const std::string& file : command.mined) command.outputs.reads(file);
  for (const std::string& file : command.reading.read.paths) command.outputs.reads(file);
  return command.outputs.plan_in(command.out, {kBand, kEnds, kPage});
}

Result<int> run_drive(DriveCommand& command, CliContext& context) {
  ASSIGN_OR_RETURN(const auto model, read_model_of(command.model, context.console));
  RETURN_IF_ERROR(check_can(model.scenario, kSimulates, command.model));
  RETURN_IF_ERROR(check_no_residual(model, command.model, "drive"));
  ASSIGN_OR_RETURN(const Task task, read_task(command, model));
  RETURN_IF_ERROR(plan_outputs(command));
  const Problem problem = problem_of(model);
  command.settings.frame_x_m = model.frame_x_m;
  command.settings.frame_y_m = model.frame_y_m;
  TrialLog mined;
  if (!command.mined.empty()) {
    ASSIGN_OR_RETURN(mined, read_trial_files(command.mined, command_names(problem.commands),
                                             command.reading.read));
    show_notes(mined, context.console);
  }
  // The commands' nominal motions, then the runs; way-points are a turn and a way each.
  const std::uint64_t legs = task.targets.empty() ? 1 : 2 * task.targets.size();
  const std::uint64_t tasks = problem.commands.size() + legs * command.runs;
  if (context.dry_run) {
    return print_dry_run(fmt::format("drive {} times by {}, {} simulations, into {}", command.runs,
                                     command.model, tasks, command.out),
                         {{"out", command.out}, {"runs", command.runs}, {"simulations", tasks}},
                         command.farm, {}, context);
  }
  ASSIGN_OR_RETURN(const auto asked, command.begin("drive", {{"drive", 1, tasks}}, {}, context));
  context.work->stage(0);
  ASSIGN_OR_RETURN(const auto report, drive_all(command, task, problem, mined, *asked));
  RETURN_IF_ERROR(command.outputs.write_in(
      command.out,
      {{kBand, band_csv(report)},
       {kEnds, ends_csv(report)},
       {kPage, drive_page(report, "Driven " + std::to_string(command.runs) + " times")}}));
  Json json = to_json(report);
  json["out"] = command.out;
  context.console.result(drive_text(report), json);
  context.console.note("wrote: " + (std::filesystem::path(command.out) / kPage).string() +
                       ", band.csv, ends.csv");
  return kExitDone;
}

}  // namespace

SubcommandRun setup_drive(CLI::App& app) {
  auto command = std::make_shared<DriveCommand>();
  app.add_option("MODEL", command->model, "Model file, or a run or diagnosis with a model.toml")
      ->required();
  app.add_option("--commands", command->commands, "Commands in order, NAME or NAME:SECONDS");
  app.add_option("--waypoints", command->waypoints, "Way-points in order, X,Y in m");
  app.add_option("--log", command->log,
                 "A blendersim way-point log: start, way-points and the real path come from it");
  app.add_option("--start", command->start, "X,Y,THETA in m and rad")->capture_default_str();
  app.add_option("--mined", command->mined,
                 "Trial logs that the mined motion model and constant velocities are fitted to");
  command->reading.declare_reading(app);
  app.add_option("--runs", command->runs)->check(CLI::Range(8, 1000000))->capture_default_str();
  app.add_option("--coverage", command->coverage, "Share of paths that the band is to hold")
      ->check(CLI::Range(0.05, 0.99))
      ->capture_default_str();
  app.add_option("--seed", command->settings.seed)->capture_default_str();
  app.add_option("--interval", command->settings.interval_s, "Seconds between path samples")
      ->check(CLI::Range(0.005, 1.0))
      ->capture_default_str();
  app.add_option("--out", command->out, "Folder for the tables and the page")->required();
  command->declare(app, LongOptions::Leaves::kFolder, true);
  app.footer(
      "Constant velocity, and with --mined the motion model mined from a log, drive the same "
      "list.\n"
      "Way-points are driven as a robot under a camera does: turn toward the next, go as far as "
      "it\n"
      "is, look again.\n\n"
      "Examples:\n"
      "  gapfarm drive run/demo --commands forward turn_ccw:0.5 forward --out driven\n"
      "  gapfarm drive model.toml --waypoints 0.5,0 0.5,0.5 0,0.5 --runs 400 --out driven\n"
      "  gapfarm drive model.toml --log waypoint_1.log --mined trials.csv --out driven");
  return [command](CliContext& context) { return run_drive(*command, context); };
}

}  // namespace gapfarm
