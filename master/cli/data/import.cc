// gapfarm import FORMAT FILES: other programs' logs to the trial format.

#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/trials/files.h"
#include "common/trials/format.h"
#include "common/trials/read.h"
#include "master/cli/subcommand.h"
#include "master/command/outputs.h"
#include "master/io/logs/bags.h"
#include "master/io/logs/column_map.h"

namespace gapfarm {
namespace {

struct ImportOptions {
  std::string format;
  std::vector<std::string> files;
  std::string out;  // of runs: a folder
  std::string map;  // TOML; empty: guessed
  bool print_map = false;
  Outputs outputs;
  TrialOptions reading;
};

Result<std::vector<Recording>> read_all(const std::vector<std::string>& files, bool skip_invalid) {
  std::vector<Recording> recordings;
  for (const std::string& file : files) {
    ASSIGN_OR_RETURN(Recording recording, read_recording(file, skip_invalid));
    recordings.push_back(std::move(recording));
  }
  return recordings;
}

// What there is, for somebody who has to write a map.
std::string columns_text(const std::vector<Recording>& recordings) {
  std::string text;
  for (const Recording& recording : recordings) {
    for (const LogTable& table : recording.tables) {
      text += "# " + printable(table.source) + " (" + printable(table.type) + ", " +
              std::to_string(table.rows()) + " rows):";
      for (std::size_t i = 0; i < table.columns.size(); ++i) {
        const std::string unit = table.unit_of(table.columns[i]);
        text += (i == 0 ? " " : ", ") + printable(table.columns[i]) +
                (unit.empty() ? "" : " [" + printable(unit) + "]");
      }
      text += "\n";
    }
  }
  return text;
}

// Commands that were not logged, but what the wheels did: that drives the simulation as well.
void drive_by_wheels(LogMap& map) {
  if (!map.commands.columns.empty() || map.wheels.columns.empty()) return;
  map.commands = std::move(map.wheels);
  map.wheels = {};
  map.notes.push_back(
      "the log holds measured wheel speeds and no commands: they stand as commands; say measured = "
      "true in the robot's table");
}

Status check_map(const LogMap& map, const std::vector<Recording>& recordings) {
  const bool poses = !map.poses.columns.empty(), commands = !map.commands.columns.empty();
  if (poses && commands) return {};
  if (!poses && !map.no_heading.empty()) {
    return Error{map.no_heading +
                 ":1: found x and y and no heading, expected theta (or yaw, "
                 "heading; rad, or degrees as theta_deg) or qx, qy, qz, qw beside them; a "
                 "column of another name needs a map (--print-map)"};
  }
  return Error{recordings.front().file + ":1: found no columns that are clearly " +
               (poses      ? "commands"
                : commands ? "poses"
                           : "poses or commands") +
               ", expected poses (t, x, y, heading) and commands (left and right, v and omega, "
               "throttle and steering, ...); write them into a map: gapfarm import runs FILES "
               "--print-map > map.toml lists the columns, --map map.toml uses it"};
}

// Returns the names of those that there are.
Result<std::vector<std::string>> write_files(const std::string& out, const RunFiles& files,
                                             const std::string& map, Outputs& outputs) {
  const Outputs::NamedTexts all = {{"commands.csv", files.commands},
                                   {"poses.csv", files.poses},
                                   {"wheels.csv", files.wheels},
                                   {"gyro.csv", files.gyro},
                                   {"map.toml", map}};
  const auto names = mapped(filtered(all, [](auto& file) { return !file.second.empty(); }),
                            [](auto& file) { return file.first; });
  RETURN_IF_ERROR(outputs.plan_in(out, names));
  RETURN_IF_ERROR(outputs.write_in(out, all));
  return names;
}

Result<int> import_runs(ImportOptions& options, CliContext& context) {
  Console& console = context.console;
  Outputs& outputs = options.outputs;
  for (const std::string& file : options.files) outputs.reads(file);
  if (!options.map.empty()) outputs.reads(options.map);
  ASSIGN_OR_RETURN(const std::vector<Recording> recordings,
                   read_all(options.files, options.reading.read.skip_invalid));
  ASSIGN_OR_RETURN(
      LogMap map, options.map.empty() ? guess_map(recordings) : parse_file(options.map, parse_map));
  if (options.map.empty()) drive_by_wheels(map);
  for (const std::string& note : map.notes) console.note(printable(note));
  std::string map_text = format_map(map);
  if (map_text.empty()) {
    map_text =
        "# No column was recognised.  Name them, and give this by --map (docs/formats.md):\n"
        "# [poses]\n# t = \"\"\n# x = \"\"\n# y = \"\"\n# theta = \"\"\n# [commands]\n# t = \"\"\n"
        "# left = \"\"\n# right = \"\"\n";
  } else if (options.map.empty()) {
    map_text.insert(0, "# Guessed from names and numbers; correct it and give it by --map.\n");
  }
  if (options.print_map) {
    console.result(columns_text(recordings) + map_text, {{"map", map_text}});
    return kExitDone;
  }
  if (Status s = check_map(map, recordings); !s) {
    for (const Recording& recording : recordings) {
      for (const std::string& note : recording.notes) console.note(printable(note));
    }
    return s.error();
  }
  ASSIGN_OR_RETURN(const ImportedRuns runs, to_runs(recordings, map));
  for (const std::string& line : runs.report) console.note(printable(line));
  if (runs.log.runs.empty()) {
    return Error{options.files.front() +
                 ":1: found no run with two poses and commands, expected one; give the files of "
                 "both, in the same order"};
  }
  ASSIGN_OR_RETURN(const auto names,
                   write_files(options.out, format_runs(runs.log), map_text, outputs));
  const std::string done = std::to_string(runs.log.runs.size()) + " runs written to " +
                           options.out + " (" + joined(names) + ")\n";
  console.result((options.map.empty() ? map_text + "\n" : "") + done,
                 {{"out", options.out},
                  {"runs", runs.log.runs.size()},
                  {"channels", runs.log.channels},
                  {"clock_start_s", runs.clock_start_s},
                  {"report", runs.report},
                  {"map", map_text}});
  return kExitDone;
}

// Drives of ground robots, in any of the formats of master/io/logs.
constexpr const char* kRuns = "runs";
constexpr const char* kBbautotune = "bbautotune";  // its robot is an SRV-1

Result<TrialLog> read_bbautotune(const ImportOptions& options) {
  if (options.format != kBbautotune) {
    const std::vector<std::string> known = {kBbautotune, kRuns};
    return Error{"unknown format '" + options.format + "'" + suggestion(options.format, known)};
  }
  for (const std::string& file : options.files) {
    ASSIGN_OR_RETURN(const std::string text, read_text_file(file));
    const TextFormat found = sniff_format(text);
    if (found != TextFormat::kBbautotune) {
      return wrong_format(file, found, format_name(TextFormat::kBbautotune));
    }
  }
  return read_trial_files(options.files, command_names(default_commands("srv1")),
                          options.reading.read);
}

Result<int> run_import(ImportOptions& options, CliContext& context) {
  Console& console = context.console;
  if (options.out.empty() && !options.print_map) {
    return Error{"--out is missing, expected where to write; --out trials.csv"};
  }
  if (options.format == kRuns) return import_runs(options, context);
  const bool to_stdout = options.out == "-";
  ASSIGN_OR_RETURN(const TrialLog log, read_bbautotune(options));
  show_notes(log, console);
  if (to_stdout && console.json()) {
    return Error{"--json and --out - both want standard output; name a file"};
  }
  if (to_stdout) {
    console.print(format_trials(log));
    return kExitDone;
  }
  options.outputs.reads(log);
  ASSIGN_OR_RETURN(const auto files, trial_files(log, options.out));
  for (const TrialFile& file : files) {
    RETURN_IF_ERROR(options.outputs.plan(file.path));
  }
  context.begun = true;
  for (const TrialFile& file : files) {
    RETURN_IF_ERROR(options.outputs.write(file.path, file.text));
  }
  const std::size_t sessions = count_sessions(log);
  console.result(std::to_string(log.trials.size()) + " trials in " + std::to_string(sessions) +
                     " sessions written to " + options.out + "\n",
                 {{"out", options.out},
                  {"trials", log.trials.size()},
                  {"sessions", sessions},
                  {"read", log.files},
                  {"notes", log.notes}});
  return kExitDone;
}

}  // namespace

SubcommandRun setup_import(CLI::App& app) {
  auto options = std::make_shared<ImportOptions>();
  app.add_option("FORMAT", options->format,
                 "bbautotune: its trials; runs: drives of a ground robot as a table (separated by "
                 "commas, semicolons or tabs), TUM, Motive, rostopic or ros2 topic echo, "
                 "PlotJuggler, .bag, .db3 or .mcap")
      ->required();
  app.add_option("FILES", options->files, "Logs; each becomes a session or a run")->required();
  app.add_option("-o,--out", options->out,
                 "Trial log to write, - for standard output; of runs: a folder");
  app.add_option(
      "--map", options->map,
      "Of runs: TOML that says which column is what, with unit, scale, offset, sign and gear");
  app.add_flag("--print-map", options->print_map, "Of runs: print columns and map; write nothing");
  options->outputs.declare(app);
  options->reading.declare_reading(app);
  app.footer(
      "Examples:\n"
      "  gapfarm import bbautotune logs/*.dat --out trials.csv\n"
      "  gapfarm import runs drive.bag --out drive\n"
      "  gapfarm import runs drive.csv --print-map > map.toml\n"
      "  gapfarm import runs drive.csv --map map.toml --out drive");
  return [options](CliContext& context) { return run_import(*options, context); };
}

}  // namespace gapfarm
