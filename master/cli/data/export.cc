// gapfarm export ros RUN|DIAGNOSIS: what a log says, in the words of its user's own files.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

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

// Every value of the robot's kinematics by the log that a run was fitted to.
Result<ReportedValues> values_of_run(const Problem& problem, const Model& model, Console& console) {
  ReportedValues reported_values;
  reported_values.given = problem.ground->robot();
  reported_values.logs = model.data.files;
  ASSIGN_OR_RETURN(const auto log,
                   read_run_folders(reported_values.logs, reported_values.given.channels));
  console.note("fitting the robot's kinematics to the log of the run, for intervals");
  ASSIGN_OR_RETURN(const auto asked,
                   ask_what_changed(reported_values.given, log, {{0.5, 2, 5}, 0.5}, 1, nullptr));
  const GroundReference& fit = *asked.reference;
  for (std::size_t k = 0; k < fit.names.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    std::vector<double> drawn;
    for (Eigen::Index d = 0; d < fit.draws.cols(); ++d) {
      drawn.push_back(fit.values[i] + fit.draws(i, d));
    }
    std::sort(drawn.begin(), drawn.end());
    const auto at = [&](double share) {
      return drawn[static_cast<std::size_t>(share * static_cast<double>(drawn.size() - 1))];
    };
    reported_values.values.push_back({fit.names[k],
                                      value_in_file(reported_values.given, fit.names[k]),
                                      fit.values[i],
                                      {at(kLow), at(kHigh)},
                                      true});
  }
  return reported_values;
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

struct Reported {
  ReportedValues values;
  RosFriction friction;
};

Result<Reported> read_source_of_export(const std::string& source, Console& console) {
  const fs::path values = fs::path(source) / "values.json";
  std::error_code ignored;
  if (fs::exists(values, ignored)) {
    ASSIGN_OR_RETURN(const auto text, read_text_file(values.string()));
    ASSIGN_OR_RETURN(auto reported_values, parse_values(text, values.string()));
    const RosFriction friction = ros_friction(reported_values);
    return Reported{std::move(reported_values), friction};
  }
  const auto reader = RunReader::open(source);
  if (!reader) {
    return Error{source + ": neither the diagnosis of a ground robot nor a run (" +
                 reader.error().message + ")"};
  }
  ASSIGN_OR_RETURN(const auto problem, stored_problem(*reader));
  if (!problem.ground) {
    return Error{source + ": scenario " + problem.scenario +
                 " has no robot file whose values could go back; only ground robots have"};
  }
  ASSIGN_OR_RETURN(const auto model, read_model_of(source, console));
  ASSIGN_OR_RETURN(auto reported_values, values_of_run(problem, model, console));
  RosFriction friction = simulated_friction(problem, model);
  if (!friction.across) friction = ros_friction(reported_values);
  return Reported{std::move(reported_values), friction};
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
  data.values = ros_values(reported_values.values);
  data.remarks = ros_remarks(reported_values.values);
  data.friction = reported_values.friction;
  RETURN_IF_ERROR(name_wheels_of_export(command.urdf, reported_values.values.given, &data));
  return data;
}

nlohmann::ordered_json export_json(const RosExport& data) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const RosValue& row : data.values) {
    rows.push_back({{"key", row.key},
                    {"had", row.had},
                    {"says", row.reported},
                    {"lo", row.interval.lower},
                    {"hi", row.interval.upper},
                    {"known", row.known}});
  }
  nlohmann::ordered_json json = {{"controller", data.controller},
                                 {"values", rows},
                                 {"kinematics", values_json(data.kinematics)}};
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
  app.add_option("RUN|DIAGNOSIS", command->source, "Of a ground robot")->required();
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
