// gapfarm export ros|ranges|runs: what a log says, in the words of its user's own tools.

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/json/matrix.h"
#include "common/trials/files.h"
#include "master/cli/data/export_command.h"
#include "master/diagnose/result/diagnosis_json.h"
#include "master/ground/reference.h"
#include "master/ground/report/ranges.h"
#include "master/ground/report/ros_export.h"
#include "master/ground/report/simulator_model.h"
#include "master/io/robot_files/controllers.h"
#include "master/io/robot_files/understand.h"
#include "master/store/run_reader.h"

namespace gapfarm {
namespace {

constexpr int kMostSamplesOut = 9999;

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
  return Error{
      source + ": scenario " + problem.scenario +
      " has no robot file whose values could go back; only ground robots have.  Ranges come "
      "of any diagnosis, too: gapfarm diagnose CONFIG --out DIAGNOSIS"};
}

// A ground robot and the log that it is fitted to.
struct GroundSource {
  GroundRobot robot;
  std::vector<std::string> logs;  // folders
  RosFriction friction;           // as simulated, of a run that searched for it
};

// Every value of the robot's kinematics by its log.
Result<GroundReference> fit_source(const GroundSource& source, Console& console) {
  const GroundRobot& robot = source.robot;
  ASSIGN_OR_RETURN(const auto logged, read_run_folders(source.logs, robot.channels));
  const RunChecks checks = check_runs(logged, robot.motors.command_timeout_s);
  for (const SanityFinding& f : checks.findings) {
    if (checks.none_is_left(logged)) return Error{f.text + " " + f.remedy};
    console.note("warning: " + f.text + " " + f.remedy);
  }
  const RunLog log = without(logged, checks);
  console.note("fitting the robot's kinematics to the log");
  const WindowSettings usual = GroundWork().windows, windows = windows_of_rows(log, usual);
  const auto ask = [&](const WindowSettings& of) {
    return ask_what_changed(robot, log, of, 1, nullptr, /*alone=*/true);
  };
  ASSIGN_OR_RETURN(auto asked, ask(windows));
  const double delay_s = asked.reference->value_or("delay", robot.motors.delay_s);
  if (windows.horizons_s != usual.horizons_s && reads_apart(robot, delay_s)) {
    ASSIGN_OR_RETURN(asked, ask(usual));
  }
  return *std::move(asked.reference);
}

// By values.json of a ground robot's diagnosis, where there is one.
Result<std::optional<ReportedValues>> values_in(const std::string& folder) {
  const auto path = std::filesystem::path(folder) / "values.json";
  if (!is_there(path)) return std::optional<ReportedValues>();
  ASSIGN_OR_RETURN(auto values, parse_file(path.string(), parse_values));
  return std::optional(std::move(values));
}

// Of a config or a run.
Result<GroundSource> read_ground_source(const std::string& source, Console& console) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(source, ignored)) {
    ASSIGN_OR_RETURN(const auto config,
                     open_config(source, {}, console, [](Config&) { return Status(); }));
    RETURN_IF_ERROR(check_ground(config.problem, source));
    return GroundSource{
        config.problem.ground->robot_at(config.problem.values), config.trial_files, {}};
  }
  const auto reader = RunReader::open(source);
  if (!reader) {
    return Error{source + ": neither a config nor the diagnosis of a ground robot nor a run (" +
                 reader.error().message + ")"};
  }
  ASSIGN_OR_RETURN(const auto problem, stored_problem(*reader));
  RETURN_IF_ERROR(check_ground(problem, source));
  ASSIGN_OR_RETURN(const auto model, read_model_of(source, console));
  ASSIGN_OR_RETURN(const auto config, parse_stored(reader->info(), problem));
  return GroundSource{problem.ground->robot(), config.trial_files,
                      simulated_friction(problem, model)};
}

constexpr double kSame = 1e-4;  // of a size, as files round it

// All but the names of what is the user's.
Result<RosExport> read_source_of_export(const std::string& source, Console& console) {
  ASSIGN_OR_RETURN(const auto diagnosed, values_in(source));
  if (diagnosed) return RosExport{source, "", *diagnosed, {}, ros_friction(*diagnosed), {}};
  ASSIGN_OR_RETURN(const auto ground, read_ground_source(source, console));
  ASSIGN_OR_RETURN(const auto fit, fit_source(ground, console));
  ReportedValues values = {ground.robot, ground.logs, {}};
  for (std::size_t k = 0; k < fit.names.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    values.values.push_back({fit.names[k], value_in_file(ground.robot, fit.names[k]), fit.values[i],
                             interval_of(fit, i), fit.shown[k] != 0});
  }
  const RosFriction friction = ground.friction.across ? ground.friction : ros_friction(values);
  return RosExport{source, "", std::move(values), fit.covariance, friction, {}};
}

// By DriveKind.
constexpr const char* kUsualControllers[] = {
    "diff_drive_controller",       "diff_drive_controller",    "diff_drive_controller",
    "omni_wheel_drive_controller", "mecanum_drive_controller", "ackermann_steering_controller",
    "tricycle_steering_controller"};

Status name_wheels_of_export(const std::string& urdf, const GroundRobot& robot, RosExport* data) {
  if (urdf.empty()) {
    for (const RobotWheel& w : robot.wheels) {
      if (w.driven) data->wheels.push_back({w.name + "_link", {}, {}, Eigen::Vector3d::UnitY()});
    }
    return {};
  }
  ASSIGN_OR_RETURN(const auto model, parse_file(urdf, parse_urdf));
  ASSIGN_OR_RETURN(const auto reading, understand_robot(model, {}));
  for (std::size_t i = 0; i < reading.sources.size(); ++i) {
    const WheelSource& source = reading.sources[i];
    if (reading.robot.wheels[i].driven) {
      data->wheels.push_back({source.link, source.mu1, source.mu2, source.axle});
    }
  }
  return {};
}

// What is exported is in place of the robot's own values: the controller has to have the same.
Status check_controller(const DriveFacts& file, const GroundRobot& robot,
                        std::vector<ReportedValue> values) {
  if (const auto& separation = robot.controller.wheel_separation_m) {
    values.push_back({"wheel_separation", *separation, 0, {}, false});
  }
  for (const RobotWheel& wheel : robot.wheels) {
    const auto& believed = robot.controller.wheel_radius_m;
    if (!wheel.driven || !wheel.radius_m) continue;
    values.push_back({"wheel_radius", believed ? *believed : *wheel.radius_m, 0, {}, false});
  }
  for (const ReportedValue& row : values) {
    const StatedNumber* stated = file.number(row.name);
    if (stated == nullptr || std::abs(stated->value - row.had) <= kSame * std::abs(row.had)) {
      continue;
    }
    return Error{fmt::format(
        "{}: {} is {:.6g}, expected {:.6g} as the robot's file has it; what is exported is in "
        "place of that: make robot.toml anew with gapfarm robot URDF --controllers {}",
        file.place(stated->line), stated->key, stated->value, row.had, file.file)};
  }
  return {};
}

Result<RosExport> export_of(const ExportCommand& command, Console& console) {
  ASSIGN_OR_RETURN(auto data, read_source_of_export(command.source, console));
  const GroundRobot& robot = data.reported.given;
  data.controller = kUsualControllers[static_cast<std::size_t>(robot.drive)];
  if (!command.controllers.empty()) {
    ASSIGN_OR_RETURN(const auto read, parse_file(command.controllers, parse_controllers));
    data.controller = read.drives.front().name;
    RETURN_IF_ERROR(check_controller(read.drives.front(), robot, ros_values(data.reported)));
  }
  RETURN_IF_ERROR(name_wheels_of_export(command.urdf, robot, &data));
  return data;
}

Json export_json(const RosExport& data) {
  Json json = {{"controller", data.controller},
               {"values", values_json(ros_values(data.reported), "key", "known")},
               {"robot", values_json(robot_sizes(data.reported), "key", "known")},
               {"kinematics", values_json(data.reported.values)}};
  if (data.covariance.size() > 0) json["covariance"] = data.covariance;
  if (data.friction.across) json["mu1"] = *data.friction.across;
  if (data.friction.across) json["mu2"] = *data.friction.along;
  return json;
}

Result<int> export_ros(ExportCommand& command, CliContext& context) {
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

Result<Ranges> ranges_of_trials(const std::string& path) {
  ASSIGN_OR_RETURN(const auto text, read_text_file(path));
  ASSIGN_OR_RETURN(const auto diagnosis, under(path, parse_diagnosis(text)));
  return under(path, ranges_of(diagnosis));
}

Result<Ranges> read_ranges(const std::string& source, Console& console) {
  ASSIGN_OR_RETURN(const auto values, values_in(source));
  const auto diagnosis = std::filesystem::path(source) / "diagnosis.json";
  if (!values && is_there(diagnosis)) {
    return ranges_of_trials(diagnosis.string());
  }
  GroundSource ground;
  if (values) {
    ground.robot = values->given;
    ground.logs = mapped(values->logs, [&](auto& log) { return path_from(values->folder, log); });
  } else {
    ASSIGN_OR_RETURN(ground, read_ground_source(source, console));
  }
  ASSIGN_OR_RETURN(const auto fit, fit_source(ground, console));
  if (ground.friction.along) ground.robot.friction = *ground.friction.along;
  Ranges ranges = ranges_of(ground.robot, fit);
  ranges.logs = ground.logs;
  return ranges;
}

std::string model_name(int sample) {
  return sample == 0 ? "robot.xml" : fmt::format("robot_{:04}.xml", sample);
}

// `sample`: 0 for the means.
std::string model_of(const Ranges& ranges, const Eigen::VectorXd& values, int sample) {
  return mujoco_model(robot_at(ranges, values), *ranges.robot,
                      sample == 0 ? "Means of ranges.toml, from " + ranges.source + "."
                                  : fmt::format("Draw {} of samples.csv.", sample));
}

// What a simulation is to be randomised by.
Result<int> export_ranges(ExportCommand& command, CliContext& context) {
  std::vector<std::string> names = {"ranges.toml", "ranges.yaml", "samples.csv", "robot.sdf",
                                    "scene.xml"};
  for (int k = 0; k <= command.samples; ++k) names.push_back(model_name(k));
  if (command.samples > 0 && command.out.empty() && !context.console.json()) {
    return Error{"--samples: name a folder to write them to with --out"};
  }
  if (!command.out.empty()) RETURN_IF_ERROR(command.outputs.plan_in(command.out, names));
  ASSIGN_OR_RETURN(auto ranges, read_ranges(command.source, context.console));
  ranges.source = command.source;
  const Eigen::MatrixXd draws = draw_values(ranges, command.samples, command.seed);
  nlohmann::ordered_json json = ranges_json(ranges);
  const std::string toml = ranges_toml(json), yaml = ranges_yaml(json);
  if (command.samples > 0) json["samples"] = Eigen::MatrixXd(draws.transpose());
  if (command.out.empty()) {
    context.console.result(ranges_table(ranges) + "\n" + toml, json);
    return kExitDone;
  }
  Outputs::NamedTexts files = {{"ranges.toml", toml}, {"ranges.yaml", yaml}};
  if (command.samples > 0) files.emplace_back("samples.csv", samples_csv(ranges, draws));
  if (ranges.robot && has_simulator_model(*ranges.robot)) {
    const Eigen::VectorXd means = means_of(ranges);
    files.emplace_back("robot.sdf", sdf_model(robot_at(ranges, means), *ranges.robot,
                                              "Means of ranges.toml, from " + ranges.source + "."));
    files.emplace_back("scene.xml", mujoco_scene());
    files.emplace_back(model_name(0), model_of(ranges, means, 0));
    for (int k = 1; k <= command.samples; ++k) {
      files.emplace_back(model_name(k), model_of(ranges, draws.col(k - 1), k));
    }
  }
  context.begun = true;
  RETURN_IF_ERROR(command.outputs.write_in(command.out, files));
  context.console.result(ranges_table(ranges), json);
  context.console.note(fmt::format("wrote {} files to {}: {} ... {}", files.size(), command.out,
                                   files.front().first, files.back().first));
  return kExitDone;
}

constexpr OptionOf kExportOptions[] = {{"--controllers", "export ros"},
                                       {"--urdf", "export ros"},
                                       {"--samples", "export ranges"},
                                       {"--seed", "export ranges"},
                                       {"--trials", "export runs"}};

}  // namespace

SubcommandRun setup_export(CLI::App& app) {
  auto command = std::make_shared<ExportCommand>();
  app.add_option("TOOLS", command->format,
                 "ros: controllers.yaml and <gazebo> tags; ranges: of every value with their "
                 "covariance (TOML, YAML) and models for MuJoCo and Gazebo; runs: simulated beside "
                 "measured poses (MCAP, CSV)")
      ->required()
      ->check(CLI::IsMember({"ros", "ranges", "runs"}));
  app.add_option("CONFIG|RUN|DIAGNOSIS", command->source,
                 "Of a ground robot: a config's log is fitted to, a run's was; ranges: any "
                 "diagnosis; runs: a config or run")
      ->required();
  app.add_option("--controllers", command->controllers,
                 "ros: your controller file, whose controller's name is taken");
  app.add_option("--urdf", command->urdf,
                 "ros: your URDF, whose wheels' links and friction are taken");
  app.add_option("--samples", command->samples,
                 "ranges: so many draws, in samples.csv and as models robot_0001.xml ...")
      ->check(CLI::Range(1, kMostSamplesOut));
  app.add_option("--seed", command->seed, "ranges: of the draws")->capture_default_str();
  app.add_option("--trials", command->runs,
                 "runs: folders with commands.csv and poses.csv (default: those fitted to)");
  app.add_option("--out", command->out, "Folder to write to (default: all is printed)");
  command->declare(app, LongOptions::Leaves::kFolder, false);
  app.footer(
      "Examples:\n"
      "  gapfarm export ros run/husky\n"
      "  gapfarm export ros diagnosis --controllers control.yaml --urdf husky.urdf --out ros\n"
      "  gapfarm export ranges run/husky --samples 100 --seed 1 --out ranges\n"
      "  gapfarm export runs run/husky --trials tuesday --out foxglove");
  return [command, &app](CliContext& context) -> Result<int> {
    RETURN_IF_ERROR(check_options_of("export " + command->format, kExportOptions, app));
    if (context.dry_run && command->format != "runs") {
      context.console.result("dry run: nothing was fitted or written\nwould export " +
                                 command->format + " of " + command->source + "\n",
                             {{"dry_run", true}, {"out", command->out}});
      return kExitDone;
    }
    return command->format == "ros"      ? export_ros(*command, context)
           : command->format == "ranges" ? export_ranges(*command, context)
                                         : export_runs(*command, context);
  };
}

}  // namespace gapfarm
