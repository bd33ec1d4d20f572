// gapfarm horizons RUN|CONFIG: how far off a ground robot's simulation is at several horizons.
#include "master/ground/horizons.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/trials/text/csv.h"
#include "master/cli/subcommand.h"
#include "master/command/outputs.h"
#include "master/ground/paths.h"

namespace gapfarm {
namespace {

struct HorizonsCommand : LongOptions {
  std::string source;
  std::vector<std::string> runs;
  std::vector<double> horizons = {0.5, 2, 5, 0};
  std::string picture;
};

Result<int> run_horizons(HorizonsCommand& command, CliContext& context) {
  Console& console = context.console;
  ASSIGN_OR_RETURN(const auto fitted, open_fitted(command.source, command.runs, console));
  command.outputs.reads(command.source);
  command.outputs.reads(fitted.robot_path);
  command.outputs.reads_runs(fitted.folders);
  RETURN_IF_ERROR(command.outputs.plan({command.picture, command.out}));
  if (!fitted.problem.windows()) {
    return Error{command.source + ": scenario " + fitted.problem.scenario +
                 " has no runs to cut into windows; gapfarm predict compares its trials"};
  }
  for (std::size_t i = 0; i < fitted.folders.size(); ++i) {
    const auto before = std::span(fitted.folders).first(i);
    if (std::ranges::any_of(before, [&](const std::string& other) {
          std::error_code ignored;
          return std::filesystem::equivalent(other, fitted.folders[i], ignored);
        })) {
      return Error{"--trials: found " + fitted.folders[i] +
                   " again, expected each log once: its windows would count twice"};
    }
  }
  ASSIGN_OR_RETURN(const auto runs, read_run_folders(fitted.folders, fitted.problem.channels()));
  for (const std::string& note : runs.notes) console.note(note);
  std::vector<double> horizons_s;
  for (const double horizon : command.horizons) {
    if (!contains(horizons_s, horizon)) horizons_s.push_back(horizon);
  }
  command.horizons = std::move(horizons_s);
  if (context.dry_run) {
    return print_dry_run("measure horizons of " + command.source,
                         {{"source", command.source}, {"horizons", command.horizons}}, command.farm,
                         {}, context);
  }
  ASSIGN_OR_RETURN(auto farm, start_farm(command.farm, {}, context));
  ASSIGN_OR_RETURN(const auto horizons,
                   measure_horizons(*farm, fitted.problem, fitted.values, runs,
                                    {command.horizons, fitted.windows.run_in_s}));
  if (!command.picture.empty()) {  // whole runs, before and after
    ASSIGN_OR_RETURN(const auto paths, drive_paths(*farm, fitted.problem, fitted.values, runs));
    RETURN_IF_ERROR(command.outputs.write(command.picture, draw_paths(paths)));
    console.note("paths drawn in " + command.picture);
  }
  if (!command.out.empty()) {
    RETURN_IF_ERROR(command.outputs.write(command.out, windows_csv(horizons)));
  }
  for (const double horizon : command.horizons) {
    if (!contains(horizons.rows, horizon, &HorizonRow::horizon_s)) {
      console.note("no window of " + format_double(horizon) + " s fits into these runs");
    }
  }
  console.result(format_horizons(horizons), horizons_json(horizons));
  return kExitDone;
}

}  // namespace

SubcommandRun setup_horizons(CLI::App& app) {
  auto command = std::make_shared<HorizonsCommand>();
  app.add_option(
         "RUN|CONFIG", command->source,
         "A finished run, or a config for its own values, of scenario ground or external_runs")
      ->required();
  app.add_option("--trials", command->runs,
                 "Folders with commands.csv and poses.csv (default: those that were fitted to)");
  app.add_option("--horizons", command->horizons, "Lengths of windows, s; 0: whole runs")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--picture", command->picture,
                 "Draw the runs: logged, as simulated before and after the fit (SVG)");
  app.add_option("--out", command->out, "Every window with its errors, m and rad (CSV)");
  command->declare(app, LongOptions::Leaves::kFolder, false);
  app.footer(
      "Beside the simulation stand the robot's own kinematics, fitted by least squares to the "
      "windows\nthat the run was fitted to (of a config: to those of --trials), of the config's "
      "lengths, and\nconstant velocity. A program of yours has the latter alone.\n\n"
      "Examples:\n"
      "  gapfarm horizons run/warthog --trials held_out --picture paths.svg\n"
      "  gapfarm horizons warthog.toml --horizons 1 10");
  return [command](CliContext& context) { return run_horizons(*command, context); };
}

}  // namespace gapfarm
