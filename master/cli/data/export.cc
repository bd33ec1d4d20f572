// gapfarm export ros CONFIG|RUN|DIAGNOSIS: what a log says, in the words of its user's own files.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/base/try.h"
#include "common/problem/run_files.h"
#include "common/trials/files.h"
#include "master/cli/subcommand.h"
#include "master/command/inputs.h"
#include "master/command/outputs.h"
#include "master/ground/reference.h"
#include "master/ground/report/ros_export.h"
#include "master/io/robot_files/controllers.h"
#include "master/io/robot_files/understand.h"
#include "master/store/run_reader.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

struct ExportCommand {
  std::string format;
  std::string source;
  std::string controllers;
  std::string urdf;
  std::string out;
  Outputs outputs;
};

constexpr double kLow = 0.05, kHigh = 0.95;
constexpr double kLeastShift_s = 1e-3;
constexpr double kEachRow_s = 1e-3;  // a horizon that every way between two poses is longer than

struct Reported {
  ReportedValues values;
  RosFriction friction;
  Eigen::MatrixXd covariance;  // of the values; of a fit
};

// Whether rows that hold wheels and increments were read at other times after all.
bool clocks_are_apart(const GroundRobot& robot, const GroundReference& fit) {
  for (std::size_t k = 0; k < fit.names.size(); ++k) {
    const double value = fit.values[k];
    if (fit.names[k] == "delay") return std::abs(value - robot.motors.delay_s) > kLeastShift_s;
  }
  return false;
}

// Every value of the robot's kinematics by a log.
Result<Reported> fitted_values(const GroundRobot& robot, const std::vector<std::string>& folders,
                               Console& console) {
  Reported fitted;
  ReportedValues& reported_values = fitted.values;
  reported_values.given = robot;
  reported_values.logs = folders;
  ASSIGN_OR_RETURN(const auto log,
                   read_run_folders(reported_values.logs, reported_values.given.channels));
  console.note("fitting the robot's kinematics to the log");
  // Increments err each by itself: a window of several knows nothing that they do not, unless
  // wheels were read at other times.
  const bool together = log.relative && shares_a_clock(log);
  const WindowSettings each_row = {{kEachRow_s}, 0.5}, summed = {{0.5, 2, 5}, 0.5};
  const auto ask = [&](const WindowSettings& windows) {
    return ask_what_changed(reported_values.given, log, windows, 1, nullptr);
  };
  ASSIGN_OR_RETURN(auto asked, ask(together ? each_row : summed));
  if (together && clocks_are_apart(reported_values.given, *asked.reference)) {
    ASSIGN_OR_RETURN(asked, ask(summed));
  }
  const GroundReference& fit = *asked.reference;
  for (std::size_t k = 0; k < fit.names.size(); ++k) {
    std::vector<double> drawn;
    for (Eigen::Index d = 0; d < fit.draws.cols(); ++d) {
      drawn.push_back(fit.values[k] + fit.draws(k, d));
    }
    std::sort(drawn.begin(), drawn.end());
    const auto at = [&](double share) {
      return drawn[static_cast<std::size_t>(share * static_cast<double>(drawn.size() - 1))];
    };
    reported_values.values.push_back({fit.names[k],
                                      value_in_file(reported_values.given, fit.names[k]),
                                      fit.values[k],
                                      {at(kLow), at(kHigh)},
                                      fit.shown[k] != 0});
  }
  fitted.covariance = fit.covariance;
  return fitted;
}

// Friction as the run has it, where the run searched for it.
RosFriction simulated_friction(const Problem& problem, const Model& model) {
  RosFriction friction;
  for (const Gene& gene : problem.genes) {
    const std::string& key = problem.table()[gene.row].key;
    if (key != "friction" && key != "friction_ratio") continue;
    const GroundRobot robot = problem.ground->robot_at(model.values);
    friction.along = robot.friction;
    friction.across = robot.friction * robot.friction_ratio;
    friction.from = "as evolved; other values may explain the motion as well";
  }
  return friction;
}

Status check_ground(const Problem& problem, const std::string& source) {
  if (problem.ground) return {};
  return Error{source + ": scenario " + problem.scenario +
               " has no robot file whose values could go back; only ground robots have"};
}

Result<Reported> read_source_of_export(const std::string& source, Console& console) {
  const fs::path values = fs::path(source) / "values.json";
  std::error_code ignored;
  if (fs::exists(values, ignored)) {
    ASSIGN_OR_RETURN(const auto text, read_text_file(values.string()));
    ASSIGN_OR_RETURN(auto reported_values, parse_values(text, values.string()));
    const RosFriction friction = ros_friction(reported_values);
    return Reported{std::move(reported_values), friction, {}};
  }
  if (fs::is_regular_file(source, ignored)) {
    ASSIGN_OR_RETURN(const auto config,
                     open_config(source, {}, console, [](Config&) { return Status(); }));
    RETURN_IF_ERROR(check_ground(config.problem, source));
    const GroundRobot robot = config.problem.ground->robot_at(config.problem.values);
    ASSIGN_OR_RETURN(auto fitted, fitted_values(robot, config.trial_files, console));
    fitted.friction = ros_friction(fitted.values);
    return fitted;
  }
  const auto reader = RunReader::open(source);
  if (!reader) {
    return Error{source + ": neither a config nor the diagnosis of a ground robot nor a run (" +
                 reader.error().message + ")"};
  }
  ASSIGN_OR_RETURN(const auto problem, stored_problem(*reader));
  RETURN_IF_ERROR(check_ground(problem, source));
  ASSIGN_OR_RETURN(const auto model, read_model_of(source, console));
  ASSIGN_OR_RETURN(auto fitted, fitted_values(problem.ground->robot(), model.data.files, console));
  fitted.friction = simulated_friction(problem, model);
  if (!fitted.friction.across) fitted.friction = ros_friction(fitted.values);
  return fitted;
}

std::string usual_controller(DriveKind drive) {
  switch (drive) {
    case DriveKind::kMecanum:
      return "mecanum_drive_controller";
    case DriveKind::kOmni:
      return "omni_wheel_drive_controller";
    case DriveKind::kAckermann:
      return "ackermann_steering_controller";
    case DriveKind::kTricycle:
      return "tricycle_steering_controller";
    default:
      return "diff_drive_controller";
  }
}

Status name_wheels_of_export(const std::string& urdf, const GroundRobot& robot, RosExport* data) {
  if (urdf.empty()) {
    for (const RobotWheel& w : robot.wheels) {
      if (w.driven) data->wheels.push_back({w.name + "_link", {}, {}});
    }
    return {};
  }
  ASSIGN_OR_RETURN(const auto text, read_text_file(urdf));
  ASSIGN_OR_RETURN(const auto model, parse_urdf(text, urdf));
  ASSIGN_OR_RETURN(const auto reading, understand_robot(model, {}));
  for (std::size_t i = 0; i < reading.sources.size(); ++i) {
    const WheelSource& source = reading.sources[i];
    if (reading.robot.wheels[i].driven) {
      data->wheels.push_back({source.link, source.mu1, source.mu2});
    }
  }
  return {};
}

Result<RosExport> export_of(const ExportCommand& command, Console& console) {
  ASSIGN_OR_RETURN(auto reported_values, read_source_of_export(command.source, console));
  RosExport data;
  data.source = command.source;
  data.logs = reported_values.values.logs;
  data.controller = usual_controller(reported_values.values.given.drive);
  if (!command.controllers.empty()) {
    ASSIGN_OR_RETURN(const auto text, read_text_file(command.controllers));
    ASSIGN_OR_RETURN(const auto read, parse_controllers(text, command.controllers));
    data.controller = read.drives.front().name;
  }
  data.kinematics = reported_values.values.values;
  data.sizes = robot_sizes(reported_values.values);
  data.covariance = reported_values.covariance;
  data.values = ros_values(reported_values.values);
  data.remarks = ros_remarks(reported_values.values);
  data.friction = reported_values.friction;
  RETURN_IF_ERROR(name_wheels_of_export(command.urdf, reported_values.values.given, &data));
  return data;
}

Json rows_json(const std::vector<RosValue>& values) {
  Json rows = mapped(values, [&](const RosValue& row) -> Json {
    return {{"key", row.key},           {"had", row.had},           {"says", row.reported},
            {"lo", row.interval.lower}, {"hi", row.interval.upper}, {"known", row.known}};
  });
  return rows;
}

Json export_json(const RosExport& data) {
  Json json = {{"controller", data.controller},
               {"values", rows_json(data.values)},
               {"robot", rows_json(data.sizes)},
               {"kinematics", values_json(data.kinematics)}};
  Json covariance = mapped(data.covariance.rowwise(), [&](const auto& row) -> Json {
    return std::vector<double>(row.begin(), row.end());
  });
  if (!covariance.empty()) json["covariance"] = covariance;
  if (data.friction.across) json["mu1"] = *data.friction.along;
  if (data.friction.across) json["mu2"] = *data.friction.across;
  return json;
}

Result<int> run_export(ExportCommand& command, CliContext& context) {
  Console& console = context.console;
  for (const std::string* path : {&command.controllers, &command.urdf}) {
    if (!path->empty()) command.outputs.reads(*path);
  }
  if (!command.out.empty()) {
    RETURN_IF_ERROR(command.outputs.plan_in(command.out, {"controllers.yaml", "gazebo.xml"}));
  }
  ASSIGN_OR_RETURN(const auto data, export_of(command, console));
  const std::string yaml = ros_yaml(data), gazebo = ros_gazebo(data);
  std::string text = ros_table(data);
  if (command.out.empty()) {
    text += "\n" + yaml + (gazebo.empty() ? "" : "\n" + gazebo);
    console.result(text, export_json(data));
    return kExitDone;
  }
  context.begun = true;
  RETURN_IF_ERROR(
      command.outputs.write_in(command.out, {{"controllers.yaml", yaml}, {"gazebo.xml", gazebo}}));
  console.result(text, export_json(data));
  console.note("wrote: " + command.out + "/controllers.yaml" +
               (gazebo.empty() ? "" : ", gazebo.xml"));
  return kExitDone;
}

}  // namespace

SubcommandRun setup_export(CLI::App& app) {
  auto command = std::make_shared<ExportCommand>();
  app.add_option("TOOLS", command->format, "ros: controllers.yaml and <gazebo> tags")
      ->required()
      ->check(CLI::IsMember({"ros"}));
  app.add_option("CONFIG|RUN|DIAGNOSIS", command->source,
                 "Of a ground robot: a config's log is fitted to, a run's was")
      ->required();
  app.add_option("--controllers", command->controllers,
                 "Your controller file: its controller's name is taken");
  app.add_option("--urdf", command->urdf, "Your URDF: its wheels' links and friction are taken");
  app.add_option("--out", command->out, "Folder to write to (default: all is printed)");
  command->outputs.declare(app);
  app.footer(
      "Examples:\n"
      "  gapfarm export ros run/husky\n"
      "  gapfarm export ros diagnosis --controllers control.yaml --urdf husky.urdf --out ros");
  return [command](CliContext& context) { return run_export(*command, context); };
}

}  // namespace gapfarm
