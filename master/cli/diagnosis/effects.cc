// gapfarm effects: the catalogue, and pictures of what each effect does.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/config/config.h"
#include "master/cli/subcommand.h"
#include "master/command/inputs.h"
#include "master/command/long_command.h"
#include "master/command/outputs.h"
#include "master/experiments/blind_check/cases/sizing.h"
#include "master/farm/planned_trials.h"
#include "master/report/figures/figures.h"

namespace gapfarm {
namespace {

struct EffectsOptions : LongOptions {
  std::string config;
  std::string figures;
};

// In figures each strength stands this far from neutral toward its upper bound; places stay where
// the catalogue has them.
constexpr double kFigureStrength = 0.3;
constexpr Pose kFigureStart{-0.1, -0.1, 0};
constexpr double kFigureSessionTime_s = 600;
constexpr double kFigurePathInterval_s = 0.1;
constexpr unsigned kFigureDraws = 6;  // of an effect of chance
// Draws that end closer than this are one line in the picture.
constexpr double kAlike_m = 2e-3;
constexpr double kAlike_rad = 5e-3;

const char* stage_name(EffectStage stage) {
  constexpr const char* kNames[] = {"drive", "floor", "camera"};
  return kNames[static_cast<std::size_t>(stage)];
}

std::string value_text(const Parameter& p, double value) {
  if (!p.choices.empty()) return p.choices[static_cast<std::size_t>(value)];
  return fmt::format("{:.4g}", value);
}

std::string range_text(const Parameter& p, bool strength) {
  std::string text;
  if (p.choices.empty()) {
    text = fmt::format("{:.4g} to {:.4g}", p.lower, p.upper);
  } else {
    for (const std::string& choice : p.choices) text += (text.empty() ? "" : " or ") + choice;
  }
  return text + (strength ? ", neutral " : ", default ") + value_text(p, p.nominal);
}

std::string listing(std::span<const Effect> effects) {
  std::string text;
  for (const Effect& effect : effects) {
    text += fmt::format("{} ({}): {}\n", effect.name, stage_name(effect.stage), effect.summary);
    for (std::size_t i = 0; i < effect.parameters.size(); ++i) {
      const Parameter& p = effect.parameters[i];
      text += fmt::format("    {:<12} {:<6} {}; {}\n", p.key, p.unit, p.summary,
                          range_text(p, i < effect.strengths));
    }
  }
  return text;
}

Json to_json(std::span<const Effect> effects) {
  Json all = Json::array();
  for (const Effect& effect : effects) {
    Json parameters = Json::array();
    for (std::size_t i = 0; i < effect.parameters.size(); ++i) {
      const Parameter& p = effect.parameters[i];
      Json entry = {
          {"key", p.key},         {"unit", p.unit},
          {"summary", p.summary}, {i < effect.strengths ? "neutral" : "default", p.nominal},
          {"lower", p.lower},     {"upper", p.upper}};
      if (!p.choices.empty()) entry["choices"] = p.choices;
      parameters.push_back(std::move(entry));
    }
    all.push_back({{"name", effect.name},
                   {"stage", stage_name(effect.stage)},
                   {"summary", effect.summary},
                   {"parameters", std::move(parameters)}});
  }
  return all;
}

std::vector<double> figure_values(const Effect& effect) {
  std::vector<double> values;
  for (std::size_t i = 0; i < effect.parameters.size(); ++i) {
    const Parameter& p = effect.parameters[i];
    const double share = i < effect.strengths ? kFigureStrength : 0;
    values.push_back(p.nominal + share * (p.upper - p.nominal));
  }
  return values;
}

// Every command from one place, late in a session, some times over; where the last direction
// matters, after a drive the other way.
v1::Task figure_task(const Problem& problem, const Effect& effect,
                     const std::vector<v1::Override>& overrides) {
  v1::Task task;
  v1::SimulateTask* simulate = task.mutable_simulate();
  simulate->mutable_point()->mutable_overrides()->Add(overrides.begin(), overrides.end());
  simulate->set_path_interval(kFigurePathInterval_s);
  const bool reversing = effect.context & kLastDirection;
  Trial trial;
  trial.session = "s";
  trial.t_s = kFigureSessionTime_s;
  trial.X_WS = kFigureStart;
  for (const CommandSpec& command : problem.commands) {
    trial.command = command.name;
    for (unsigned draw = 0; draw < kFigureDraws; ++draw) {
      for (const double sense : {-1.0, 1.0}) {
        if (sense < 0 && !reversing) continue;
        trial.left = sense * command.left;
        trial.right = sense * command.right;
        v1::PlannedTrial* planned = simulate->add_plan();
        planned->set_moved(sense < 0 || !reversing);
        *planned->mutable_trial() = to_proto(trial);
        ++trial.trial;
      }
    }
  }
  return task;
}

// As the log has it: seen from the logged start.
LoggedDrive logged_drive(const v1::Trial& trial) {
  const Pose X_WS = from_proto(trial.start());
  LoggedDrive drive;
  for (const v1::PathSample& s : trial.path()) {
    drive.path.push_back(between(X_WS, from_proto(s.pose())));
  }
  drive.end = between(X_WS, from_proto(trial.end()));
  return drive;
}

bool alike(const LoggedDrive& a, const LoggedDrive& b) {
  const Pose d = between(a.end, b.end);
  return std::hypot(d.x, d.y) < kAlike_m && std::abs(d.theta) < kAlike_rad;
}

std::vector<EffectDrives> drives_of(const Problem& problem, const v1::SimulateResult& without,
                                    const v1::SimulateResult& with) {
  std::vector<EffectDrives> all;
  const auto drawn = static_cast<std::size_t>(with.trials_size()) / problem.commands.size();
  const std::size_t every = drawn / kFigureDraws;  // the drive itself comes last
  for (std::size_t c = 0; c < problem.commands.size(); ++c) {
    const auto trial = [&](std::size_t draw) {
      return static_cast<int>(c * drawn + (draw + 1) * every - 1);
    };
    EffectDrives drives;
    drives.command = problem.commands[c].name;
    drives.without = logged_drive(without.trials(trial(0)));
    for (std::size_t draw = 0; draw < kFigureDraws; ++draw) {
      LoggedDrive drive = logged_drive(with.trials(trial(draw)));
      const bool seen = std::ranges::any_of(
          drives.with, [&](const LoggedDrive& other) { return alike(drive, other); });
      if (!seen) drives.with.push_back(std::move(drive));
    }
    all.push_back(std::move(drives));
  }
  return all;
}

Result<Config> figure_config(const EffectsOptions& options) {
  Config config;
  if (options.config.empty()) {
    config.problem.values = config.problem.table().nominal();
    config.problem.commands = default_commands(config.problem.scenario);
  } else {
    ASSIGN_OR_RETURN(auto read, read_config(options.config));
    RETURN_IF_ERROR(check_moves(read.problem.scenario, options.config));
    if (scenario_form(read.problem.scenario).pieces) {
      return Error{options.config +
                   ": --figures draws what effects do to a robot's commands, and scenario " +
                   read.problem.scenario +
                   " has none; omit --figures to list its effects (docs/effects.md describes "
                   "them), or give a config of scenario srv1"};
    }
    config = std::move(read);
  }
  Problem& problem = config.problem;
  problem = without_log(std::move(problem));
  for (const Srv1 row : {Srv1::kDriveNoiseCommon, Srv1::kDriveNoiseSide, Srv1::kPoseNoisePosition,
                         Srv1::kPoseNoiseHeading}) {
    problem.values[row_of(row)] = problem.table()[row_of(row)].lower;
  }
  return config;
}

// A second one of a kind does what the first does.
std::vector<std::size_t> pictured(const ParameterTable& table) { return *effects_named(table); }

// Pairs of tasks: every effect's drives without it and with it.
std::vector<v1::Task> figure_tasks(const Problem& problem) {
  const ParameterTable& table = problem.table();
  std::vector<v1::Task> tasks;
  for (const std::size_t e : pictured(table)) {
    const Effect& effect = table.effects()[e];
    std::vector<v1::Override> off, on;
    const std::vector<double> values = figure_values(effect);
    for (std::size_t i = 0; i < values.size(); ++i) {
      off.push_back(override_of(table.effect_row(e) + i, effect.parameters[i].nominal));
      on.push_back(override_of(table.effect_row(e) + i, values[i]));
    }
    tasks.push_back(figure_task(problem, effect, off));
    tasks.push_back(figure_task(problem, effect, on));
  }
  return tasks;
}

Result<int> draw_figures(EffectsOptions& options, CliContext& context) {
  ASSIGN_OR_RETURN(const Config config, figure_config(options));
  std::vector<std::string> names;
  const ParameterTable& table = config.problem.table();
  for (const std::size_t e : pictured(table)) names.push_back(table.effects()[e].name + ".svg");
  options.outputs.reads(config);
  RETURN_IF_ERROR(options.outputs.plan_in(options.figures, names));
  if (context.dry_run) {
    return print_dry_run(
        "draw " + std::to_string(names.size()) + " pictures into " + options.figures,
        {{"out", options.figures}, {"files", names}}, options.farm, config.farm, context);
  }
  ASSIGN_OR_RETURN(auto farm, start_farm(options.farm, config.farm, context));
  const Problem& problem = config.problem;
  const std::string hash = farm->add_problem(to_proto(problem));
  ASSIGN_OR_RETURN(const auto results, farm->run(hash, figure_tasks(problem)));
  const std::vector<std::size_t> effects = pictured(problem.table());
  for (std::size_t k = 0; k < effects.size(); ++k) {
    const Effect& effect = problem.table().effects()[effects[k]];
    for (const v1::TaskResult& result : {results[2 * k], results[2 * k + 1]}) {
      RETURN_IF_ERROR(ended_well(result, effect.name + ": the simulation"));
    }
    const auto drives =
        drives_of(problem, results[2 * k].simulate(), results[2 * k + 1].simulate());
    const std::string picture = effect_figure(effect, figure_values(effect), kFigureStart, drives);
    const std::string path = (std::filesystem::path(options.figures) / names[k]).string();
    RETURN_IF_ERROR(options.outputs.write(path, picture));
  }
  context.console.result(options.figures + ": " + std::to_string(effects.size()) + " pictures\n",
                         {{"out", options.figures}, {"files", names}});
  return kExitDone;
}

// Of the config's scenario, or of tracked robots.
Result<std::vector<Effect>> catalogue_of(const EffectsOptions& options) {
  const std::span<const Effect> tracked = srv1_effects();
  if (options.config.empty()) return std::vector<Effect>(tracked.begin(), tracked.end());
  ASSIGN_OR_RETURN(const Config config, read_config(options.config));
  const ParameterTable& table = config.problem.table();
  return mapped(pictured(table), [&](std::size_t e) { return table.effects()[e]; });
}

Result<int> run_effects(EffectsOptions& options, CliContext& context) {
  if (!options.figures.empty()) return draw_figures(options, context);
  ASSIGN_OR_RETURN(const std::vector<Effect> effects, catalogue_of(options));
  const std::string none = "its scenario has no catalogue of effects\n";
  context.console.result(effects.empty() ? options.config + ": " + none : listing(effects),
                         to_json(effects));
  return kExitDone;
}

}  // namespace

SubcommandRun setup_effects(CLI::App& app) {
  auto options = std::make_shared<EffectsOptions>();
  app.add_option(
      "CONFIG", options->config,
      "Whose catalogue, and the robot of the pictures; default: tracked robots, a nominal one");
  app.add_option("--figures", options->figures,
                 "Draw what each effect does to a robot's commands, as SVG, into this folder");
  options->declare(app, LongOptions::Leaves::kFolder, false);
  app.footer(
      "Examples:\n"
      "  gapfarm effects\n"
      "  gapfarm effects configs/srv1.toml --figures pictures");
  return [options](CliContext& context) { return run_effects(*options, context); };
}

}  // namespace gapfarm
