// gapfarm export ranges: what a simulation is to be randomised by.
#include <spdlog/fmt/fmt.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/json/matrix.h"
#include "common/trials/files.h"
#include "master/cli/data/export_source.h"
#include "master/diagnose/result/diagnosis_json.h"
#include "master/ground/report/ranges.h"
#include "master/ground/report/simulator_model.h"

namespace gapfarm {
namespace {

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

}  // namespace

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

}  // namespace gapfarm
