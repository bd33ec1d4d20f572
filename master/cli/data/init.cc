// gapfarm init LOG...: a config for a log, with what the log says put in and what it cannot say as
// questions; of a robot's URDF: robot_setup.cc.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/config/config.h"
#include "common/math/statistics.h"
#include "common/score/motion_model.h"
#include "master/cli/data/robot_setup.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {
namespace {

struct InitOptions {
  TrialOptions trials;
  std::string out = "-";
  Outputs outputs;
};

// What of a robot can be read off a log of commands.
struct LogFigures {
  std::vector<CommandSpec> commands;  // of the log, each as it was mostly given
  std::map<std::string, std::size_t> counts;
  std::optional<double> speed_m_s;  // at full duty, of straight drives
  std::string unit_question;        // of lengths that are in no metres
};

bool drives_straight(const CommandSpec& c) { return c.left == c.right && c.left != 0; }

LogFigures figures_of(const TrialLog& log, const std::vector<CommandSpec>& known) {
  LogFigures figures;
  std::map<std::string, std::vector<CommandSpec>> given;
  std::vector<double> speeds;
  for (const Trial& trial : log.trials) {
    const CommandSpec c = resolved_command(trial, known);
    ++figures.counts[trial.command];
    given[trial.command].push_back(c);
    if (!drives_straight(c) || c.duration_s <= 0) continue;
    const Pose X_SE = between(trial.X_WS, trial.X_WE);
    speeds.push_back(std::hypot(X_SE.x, X_SE.y) / (std::abs(c.left) * c.duration_s));
  }
  if (!speeds.empty()) figures.speed_m_s = median(speeds);
  for (const auto& [name, all] : given) {
    CommandSpec typical{name, 0, 0, 0};
    const auto middle = [&](double CommandSpec::*of) { return median(mapped(all, of)); };
    typical.left = middle(&CommandSpec::left);
    typical.right = middle(&CommandSpec::right);
    typical.duration_s = middle(&CommandSpec::duration_s);
    figures.commands.push_back(typical);
  }
  return figures;
}

// Faster or slower than an SRV-1 may be.
bool is_another_robot(const LogFigures& figures) {
  const Parameter& row = srv1_table()[row_of(Srv1::kFullSpeed)];
  return figures.speed_m_s && !(*figures.speed_m_s >= row.lower && *figures.speed_m_s <= row.upper);
}

// What is to be measured: of an SRV-1 here, of another robot in a file of its own.
std::string robot_text(const LogFigures& figures) {
  if (figures.unit_question.empty() && is_another_robot(figures)) {
    return fmt::format(
        "# QUESTION: what robot is this?  None of the SRV-1's size makes {:.3g} m/s.  Copy\n"
        "# configs/robots/srv1.toml, measure, and name the copy here (docs/formats.md):\n"
        "[robot]\nfile = \"robot.toml\"\n\n[parameters]\n"
        "robot = \"treads\"      # QUESTION: treads, or wheels (four)?\n",
        *figures.speed_m_s);
  }
  const auto nominal = [](Srv1 row) { return srv1_table()[row_of(row)].nominal; };
  return fmt::format(
      "[parameters]\n"
      "robot = \"treads\"      # QUESTION: treads, or wheels (four)?\n"
      "mass = {:g}           # kg.  QUESTION: what does it weigh?\n"
      "track_gauge = {:g}   # m.  QUESTION: how far apart are its two sides?\n"
      "mass_height = {:g}    # m.  QUESTION: how high over the floor is its centre of mass?\n",
      nominal(Srv1::kMass), nominal(Srv1::kTrackGauge), nominal(Srv1::kMassHeight));
}

std::string speed_gene(const LogFigures& figures) {
  const Parameter& row = srv1_table()[row_of(Srv1::kFullSpeed)];
  if (is_another_robot(figures)) {
    return fmt::format("full_speed = \"table\"             # m/s; straight drives made {:.3g}\n",
                       *figures.speed_m_s);
  }
  if (!figures.speed_m_s) {
    return "# QUESTION: how fast is it at full duty?  No command of the log drives straight.\n"
           "full_speed = \"table\"             # m/s\n";
  }
  const double lower = std::clamp(*figures.speed_m_s / 2, row.lower, row.upper / 2);
  const double upper = std::clamp(*figures.speed_m_s * 2, lower * 1.01, row.upper);
  return fmt::format("full_speed = [{:.3g}, {:.3g}]      # m/s; straight drives made {:.3g}\n",
                     lower, upper, *figures.speed_m_s);
}

std::string command_text(const LogFigures& figures, const std::vector<CommandSpec>& known) {
  std::string text;
  for (const CommandSpec& c : figures.commands) {
    const auto same = [&](const CommandSpec& k) {
      return k.name == c.name && k.left == c.left && k.right == c.right &&
             k.duration_s == c.duration_s;
    };
    if (std::ranges::any_of(known, same)) continue;
    text += fmt::format(
        "\n[commands.{}]          # the middle of its {} trials\nleft = {:g}\nright = {:g}\n"
        "duration = {:g}\n",
        c.name, figures.counts.at(c.name), c.left, c.right, c.duration_s);
  }
  return text;
}

std::string config_of_log(const LogFigures& figures, const TrialLog& log,
                          const std::vector<CommandSpec>& known, const InitOptions& options) {
  const std::string files = joined(options.trials.files, ", ", [&](const std::string& file) {
    return '"' + file_seen_from(options.out, file) + '"';
  });
  std::string counts;
  for (const auto& [name, count] : figures.counts) counts += fmt::format(" {} {},", count, name);
  counts.pop_back();
  return fmt::format(
             "# Made by `gapfarm init` of {} trials in {} sessions:{}.\n"
             "# Lines with QUESTION are guesses; answer them, then `gapfarm check` this file.\n",
             log.trials.size(), count_sessions(log), counts) +
         "scenario = \"srv1\"     # a robot on two sides that stands still before and after a "
         "command\n"
         "seed = 1\ntrials = [" +
         files + "]\n" + figures.unit_question + "\n" + robot_text(figures) +
         "\n# What evolution searches.\n[genes]\n" + speed_gene(figures) +
         "# QUESTION: how long is the contact with the floor?  Half to twice that serves.\n"
         "contact_length = \"table\"         # m\n"
         "friction = [0.1, 1.5]\n"
         "drive_noise_common = [0.0, 0.15]\ndrive_noise_side = [0.0, 0.15]\n"
         "# QUESTION: how well does the camera see?  Its repeats on a robot at rest say it.\n"
         "pose_noise_position = [0.0005, 0.03]   # m\npose_noise_heading = [0.002, 0.15]     # "
         "rad\n" +
         command_text(figures, known) +
         "\n[fitness]\nkind = \"log_score\"\n\n[evolution.stop]\nevaluations = 600\n";
}

Result<int> run_init(InitOptions& options, CliContext& context) {
  if (names_a_robot(options.trials.files)) {
    return run_init_robot(options.trials.files, options.out, options.outputs, context);
  }
  Console& console = context.console;
  const std::vector<CommandSpec> known = default_commands("srv1");
  ASSIGN_OR_RETURN(const TrialLog log, read_trial_files(options.trials.files, command_names(known),
                                                        options.trials.read));
  if (log.trials.empty()) return Error{"the logs hold no trial to make a config of"};
  show_notes(log, console);
  options.outputs.reads(log);
  RETURN_IF_ERROR(options.outputs.plan(options.out));
  context.begun = true;
  LogFigures figures = figures_of(log, known);
  ASSIGN_OR_RETURN(Config config, parse_config("", options.out));
  config.problem.log = log;
  for (const SanityFinding& finding : check_sanity(config.problem)) {
    if (finding.name != "unit_error") continue;
    figures.unit_question += "# QUESTION: " + finding.text + " " + finding.remedy + "\n";
  }
  const std::string text = config_of_log(figures, log, known, options);
  Json json = {{"out", options.out}, {"trials", log.trials.size()}};
  if (figures.speed_m_s) json["full_speed"] = *figures.speed_m_s;
  if (options.out != "-") RETURN_IF_ERROR(options.outputs.write(options.out, text));
  show_config(options.out, std::to_string(log.trials.size()) + " trials", text, std::move(json),
              console);
  return kExitDone;
}

}  // namespace

SubcommandRun setup_init(CLI::App& app) {
  auto options = std::make_shared<InitOptions>();
  app.add_option("LOG|URDF", options->trials.files,
                 "Trial logs of a robot on two sides; or a robot's URDF, with its controller YAML "
                 "and folders of its runs")
      ->required();
  app.add_option("--out", options->out, "Config to write; - for stdout")->capture_default_str();
  options->trials.declare_reading(app);
  options->outputs.declare(app);
  app.footer(
      "Of a URDF it writes what `gapfarm robot URDF --out CONFIG_robot.toml --config CONFIG --runs "
      "RUNS`\nwrites; that command shows the robot, too, and draws it (docs/ground.md).\n"
      "\n"
      "Examples:\n"
      "  gapfarm init logs/monday.csv --out robot.toml\n"
      "  gapfarm init logs/*.dat\n"
      "  gapfarm init husky.urdf control.yaml monday --out husky.toml");
  return [options](CliContext& context) { return run_init(*options, context); };
}

}  // namespace gapfarm
